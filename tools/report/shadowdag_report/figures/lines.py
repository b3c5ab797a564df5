# SPDX-License-Identifier: Apache-2.0
"""How lines over frames are drawn: a variant looks the same in every figure."""
import re

import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..style import BLACK, BLUE, COLUMN, GREEN, ORANGE, PURPLE, SKY, VERMILION, log_axis, plt

SPHERE = "sphere × 6 faces"
# Okabe and Ito's and an olive; no two lines of a panel share a colour, and markers distinguish them without colour.
COLORS = [BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK, "#8a7400"]
LINES = ["--", (0, (5, 1, 1, 1, 1, 1)), "-.", "-", ":"]
MARKERS = ["o", "s", "^", "D", "v", "P", "X", "*", "<", ">", "h", "p"]
# The paper's variants and ours, by the part that distinguishes them from their base.
LOOKS = {SPHERE: 6, "CFM": 0, "PMC": 1, "PMCD": 2, "PMCD-EB": 3, "Nk3": 4, "PMCC-EB": 5, "LP": 7, "SO": 0, "SOR": 1,
         "PLOD1": 4, "RT": 6, "Hybrid": 2, "Hybrid:texels:16": 5, "1SM": 0, "2SM": 1, "4SM": 3, "16SM": 2, "u2": 5,
         "u4": 7, "T1": 1, "RL": 2, "embree": 4, "computations": 6,
         "computations, Nk3": 6}


def style(label, i):
    """Returns how a variant is drawn: as LOOKS has it, or by its place."""
    look = LOOKS.get(label, LOOKS.get(label.split("-")[-1], i))
    return {"color": COLORS[look % len(COLORS)], "linestyle": LINES[look % len(LINES)],
            "marker": MARKERS[look % len(MARKERS)], "markersize": 3.2, "linewidth": 0.9, "markeredgewidth": 0,
            "markevery": None, "clip_on": False, "zorder": 3}


def maps_of(part):
    """Returns n of a part nSM of a variant's name, 0 of others."""
    return int(part[:-2]) if re.fullmatch("[0-9]{1,3}SM", part) else 0


def is_detail(label_parts):
    """Returns whether a variant differs in maps a light, undersampling, taps or order alone: lines that figures of
    culling leave out."""
    return any(maps_of(p) or p[:1] in ("u", "T") and p[1:2].isdigit() or p == "RL" for p in label_parts)


def engineering(value, _=None):
    """12 400 000 as 12.4 M."""
    for limit, unit in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= limit:
            return f"{value / limit:.3g} {unit}"
    return f"{value:.3g}"


def axes_over_frames(sequence, axes, label, height=None):
    axes.set_xlabel("frame")
    axes.set_ylabel(label)
    gap = gap_of(sequence.frames)
    if gap > 1 and len(sequence.frames) <= 8:
        axes.set_xticks(sequence.frames)
        axes.grid(axis="x", visible=False)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))
    if len(sequence.frames) > 1:
        beside = gap / 2 if gap > 1 else 0
        axes.set_xlim(sequence.frames[0] - beside, sequence.frames[-1] + beside)


def legend_above(axes, count, columns=3):
    axes.legend(loc="lower left", bbox_to_anchor=(-0.12, 1.0), ncol=min(columns, count), columnspacing=1.0,
                borderaxespad=0.2, handlelength=2.6, labelspacing=0.35, fontsize=6)


def gap_of(frames):
    """Returns the least distance of two frames; 1 where there is one frame alone."""
    return min((b - a for a, b in zip(frames, frames[1:])), default=1)


def draw_lines(sequence, axes, columns, intervals=None):
    """Draws columns over frames: as lines where every frame was measured, as marks side by side where frames are apart, since
    nothing is known between them. intervals: {name: (below, above)} for error bars"""
    frames, gap = np.array(sequence.frames, dtype=float), gap_of(sequence.frames)
    every = max(1, len(frames) // 12)
    for i, (name, values) in enumerate(columns.items()):
        look = style(name, i)
        shift = 0.0
        if gap > 1:
            look |= {"linestyle": "none", "markeredgewidth": 0.3, "markeredgecolor": BLACK}
            shift = gap * 0.13 * (i - (len(columns) - 1) / 2)
        else:
            look["markevery"] = (i % every, every)
        axes.plot(frames + shift, values, label=name, **look)
        if intervals and name in intervals:
            axes.errorbar(frames + shift, values, yerr=intervals[name], fmt="none", ecolor=look["color"], elinewidth=0.6, capsize=1.0,
                          zorder=2)


def is_of_culling(sequence, label):
    """Returns whether a line belongs to the upper panel: the steps of culling, each beyond the one before."""
    return label == SPHERE or (label in sequence.maps()
                               and not any(p in ("SO", "SOR") or p.startswith("PLOD") for p in sequence.parts(label)))


MOST_IN_PANEL = 5


def panels_of(lines, first):
    """Returns the lines in panels of at most five, `first` at the head of each if it is among them."""
    rest = [name for name in lines if name != first]
    head = [first] if first in lines else []
    size = MOST_IN_PANEL - len(head)
    parts = [rest[i:i + size] for i in range(0, len(rest), size)] or [[]]
    return [{name: lines[name] for name in head + part} for part in parts if head + part]


def draw_panels(sequence, columns, label, prepare, intervals=None, bars=""):
    """Draws the lines in panels of at most five with one scale: the effect of culling; that of reuse, levels of detail and
    rays, each beside the variant that the others are compared with. prepare(axes): its scale. bars: what the bars are, for the
    legend. One panel or one over the other are designed for one column of a paper (8.5 cm), more for both (17.8 cm)."""
    base = base_of(sequence)
    upper = {l: v for l, v in columns.items() if is_of_culling(sequence, l)}
    lower = {l: v for l, v in columns.items() if l not in upper}
    if base in upper and lower:
        lower = {base: upper[base]} | lower
    panels = [columns] if len(columns) <= MOST_IN_PANEL else [p for lines in (upper, lower) if lines for p in panels_of(lines, base)]
    grid_columns = 2 if len(panels) > 2 else 1
    grid_rows = -(-len(panels) // grid_columns)
    figure, grid = plt.subplots(grid_rows, grid_columns, figsize=(COLUMN * grid_columns, 0.3 + 1.75 * grid_rows), sharex=True, sharey=True,
                                squeeze=False)
    for axes, lines in zip(grid.flat, panels):
        draw_lines(sequence, axes, lines, intervals)
        if bars:
            axes.plot([], [], linestyle="none", marker="|", markersize=7, markeredgewidth=0.6, color=BLACK, label=f"bars: {bars}")
        axes_over_frames(sequence, axes, label)
        prepare(axes)
        legend_above(axes, len(lines) + bool(bars))
    for axes in list(grid.flat)[len(panels):]:
        axes.set_visible(False)
    for place, axes in enumerate(list(grid.flat)[:len(panels)]):
        is_lowest = place + grid_columns >= len(panels)
        axes.tick_params(labelbottom=is_lowest)
        if not is_lowest:
            axes.set_xlabel("")
        if place % grid_columns:
            axes.set_ylabel("")
    return figure


def percent(value):
    return f"{value:+.1f} %"


def logarithmic(axes, columns):
    """Gives an axis a logarithmic scale that contains all values above 0."""
    positive = [v for values in columns for v in values if v > 0]
    if positive:
        log_axis(axes.yaxis, min(positive) / 1.3, max(positive) * 1.3)
        axes.yaxis.set_major_formatter(FuncFormatter(engineering))


def change(sequence, a, b, key):
    """Returns the change from a to b in percent, frame by frame."""
    before, after = sequence.values(a, key), sequence.values(b, key)
    return 100 * (after - before) / np.maximum(before, 1e-12)


def spread(values, text):
    return f"{text(np.min(values))} to {text(np.max(values))}, mean {text(np.mean(values))}"


def base_of(sequence):
    """Returns the variant that the others are compared with."""
    return next((l for l in ("PMCD-EB", "PMCD", "PMCC-EB") if sequence.has(l)), None)
