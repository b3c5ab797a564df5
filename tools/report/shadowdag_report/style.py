# SPDX-License-Identifier: Apache-2.0
"""The style of charts: a colour-blind-safe palette, fonts for a paper's column, axes with plain numbers.

Colours are Okabe and Ito's; markers, dashes and hatches distinguish series without colour. Text in SVG is outlines, so no
font is needed to read it.
"""
import hashlib
import itertools

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from .palette import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, YELLOW  # noqa: F401 (for charts)
from .scales import log_ticks, plain

COLUMN = 3.33  # inches: a paper's column
MOST_SLUG_BYTES = 100
# Stacked bars take these in turn, then again with a hatch.
STACK = [BLUE, ORANGE, GREEN, PURPLE, YELLOW, VERMILION, "#d5d9de", GREY, SKY, "#3d444d"]

plt.rcParams.update({
    "font.family": "DejaVu Sans", "font.size": 7, "axes.labelsize": 7.5, "axes.titlesize": 8,
    "xtick.labelsize": 6.5, "ytick.labelsize": 6.5, "legend.fontsize": 6.2, "axes.linewidth": 0.6,
    "lines.linewidth": 1.0, "lines.markersize": 3.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4, "ytick.minor.width": 0.4, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "grid.color": "#e3e6ea", "grid.linewidth": 0.5, "axes.axisbelow": True,
    "legend.frameon": False, "legend.handlelength": 1.8, "svg.fonttype": "path", "pdf.fonttype": 42,
    "svg.hashsalt": "shadowdag", "figure.constrained_layout.use": True, "savefig.dpi": 300,
    "text.parse_math": False,  # a name with $ is a name
})


def marks_of(known, names, make):
    """Returns {name: mark}: the known marks in their order, then those that `make` gives other names, in theirs."""
    return known | {name: make(name) for name in names if name not in known}


def slug(name):
    """Returns a name as part of a file's name: short enough for any file system, of two long names another one."""
    text = "".join(c if c.isalnum() else "_" for c in name)
    if len(text.encode()) <= MOST_SLUG_BYTES:
        return text
    return text.encode()[:MOST_SLUG_BYTES - 9].decode(errors="ignore") + "_" + hashlib.sha256(name.encode()).hexdigest()[:8]


def log_axis(axis, low, high, ticks=(1, 2, 5), near=(1, 1.5, 2, 3, 4, 5, 7)):
    """A logarithmic axis with plain numbers at 1, 2, 5 (fewer when it spans many decades, `near` when it spans about one)."""
    axis.axes.set_xscale("log") if axis.axis_name == "x" else axis.axes.set_yscale("log")
    axis.set_major_locator(FixedLocator(log_ticks(low, high, ticks, near)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(plain))
    (axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim)(low, high)


def plural(count, noun):
    """1 scene, 2 scenes."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def error_axis(axes, low, high, zero_size=None, has_zero=True, **ticks):
    """A logarithmic axis of errors from `low`. Where some are 0, which such an axis lacks, they stand at `low`: a little over the
    axis, so that their bars are seen, with the label 0 of zero_size (None: no label), and without ticks that would run into it."""
    if not has_zero:
        log_axis(axes.yaxis, low, high, **ticks)
        return
    span = high / low
    log_axis(axes.yaxis, low / span ** 0.035, high, **ticks)
    axes.yaxis.set_major_locator(FixedLocator([tick for tick in axes.yaxis.get_major_locator()() if tick > low * span ** 0.06]))
    if zero_size:
        axes.annotate("0", (0, low), xycoords=("axes fraction", "data"), xytext=(-4, 0), textcoords="offset points", ha="right",
                      va="center", fontsize=zero_size)


def labels_that_fit(axes):
    """Returns which labels of the x axis can stand without touching: the first, the last, and from the left what leaves space."""
    axes.figure.canvas.draw()  # only now do they have their places
    renderer = axes.figure.canvas.get_renderer()
    boxes = [label.get_window_extent(renderer) for label in axes.get_xticklabels()]
    space = 2 * axes.figure.dpi / 72
    fits = {0, len(boxes) - 1}
    right = boxes[0].x1
    for i in range(1, len(boxes) - 1):
        if boxes[i].x0 > right + space and boxes[i].x1 + space < boxes[-1].x0:
            fits.add(i)
            right = boxes[i].x1
    return fits


def place_labels(axes, labels, points, lines=()):
    """Writes labels beside their points so that none covers another, a point or a line, if there is enough space.

    labels: [(x, y, text, style of annotate)]; points: all that is drawn as a mark; lines: lists of points that a line joins.
    """
    canvas = axes.figure.canvas
    canvas.draw()  # only now does constrained layout stand
    renderer = canvas.get_renderer()
    transform = lambda places: axes.transData.transform(np.array(places, dtype=float).reshape(-1, 2))
    marks = np.concatenate([transform(points)] + [np.linspace(a, b, 40) for line in lines for a, b in itertools.pairwise(transform(line))])
    scale = axes.figure.dpi / 72
    taken = []
    offsets = [(5, 1, "left"), (-5, 1, "right"), (0, 5, "center"), (0, -9, "center"), (6, 7, "left"), (-6, 7, "right"),
               (6, -9, "left"), (-6, -9, "right"), (0, 13, "center"), (0, -17, "center"), (14, 12, "left"),
               (-14, 12, "right"), (14, -15, "left"), (-14, -15, "right")]
    for x, y, text, look in labels:
        best = None
        for rank, (dx, dy, side) in enumerate(offsets):
            label = axes.annotate(text, (x, y), xytext=(dx, dy), textcoords="offset points", ha=side, zorder=7, **look)
            box = label.get_window_extent(renderer)
            covered = sum(box.overlaps(other) for other in taken)
            near = sum(box.x0 - scale < mx < box.x1 + scale and box.y0 - scale < my < box.y1 + scale for mx, my in marks)
            inside = axes.get_window_extent(renderer)
            outside = box.x0 < inside.x0 or box.x1 > inside.x1 or box.y0 < inside.y0 or box.y1 > inside.y1
            cost = (4 * covered + 2 * outside + near, rank)
            if best is None or cost < best[0]:
                if best is not None:
                    best[1].remove()
                best = (cost, label, box)
            else:
                label.remove()
        taken.append(best[2])
