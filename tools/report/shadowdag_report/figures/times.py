# SPDX-License-Identifier: Apache-2.0
"""Figures 10 to 12: frame times, page commits, and stages over the animation."""
import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, plt
from .lines import (axes_over_frames, base_of, change, draw_panels, engineering, gap_of, is_detail, legend_above, percent, spread,
                    style)

STAGE_COLORS = {
    "scene update": GREY, "g-buffer": "#d5d9de", "clusters, lights": PURPLE, "page masks": SKY,
    "page allocation": BLACK, "geometry copy": "#7a4b2a", "culling": ORANGE,
    "rasterization": VERMILION, "shading": BLUE, "rays": GREEN,
}
SPARE = ["#66c2a5", "#a6761d", "#e78ac3"]


def figure_10(figures, sequence):
    chosen = [l for l in sequence.labels
              if l != "Sphere" and (l != "embree" or sequence.is_frame(l)) and not is_detail(sequence.parts(l))]
    if not chosen:
        return "variants to compare"
    columns = {l: sequence.values(l, "time_ms") for l in chosen}
    bars = sequence.bars_text(chosen)
    figure = draw_panels(sequence, columns, "frame time (ms)", lambda axes: axes.set_ylim(bottom=0),
                         {l: sequence.intervals(l) for l in chosen}, bars)
    claims = []
    base = base_of(sequence)
    first = slice(0, max(1, len(sequence.frames) // 3))
    if base and sequence.has("RT"):
        rays, maps = columns["RT"], sequence.values(base, "time_ms")
        wins = int(np.sum(rays[first] < maps[first]))
        claims.append(("rays are faster early in the zoom (first third)", "in HOUSES and NECROPOLIS, consistently",
                       f"in {wins} of {len(rays[first])} frames", wins == len(rays[first])))
        later = slice(first.stop, None)
        wins = int(np.sum(maps[later] < rays[later]))
        claims.append(("maps are faster where many samples are needed (rest)", "generally",
                       f"in {wins} of {len(rays[later])} frames", 2 * wins > len(rays[later])))
    hybrid = next((l for l in sequence.labels if l.startswith("Hybrid")), None)
    if base and hybrid:
        maps, mixed = sequence.values(base, "time_ms"), sequence.values(hybrid, "time_ms")
        claims.append((f"{hybrid} against {base}: worst frame", "not improved",
                       f"{sequence.worst_text(hybrid)} against {sequence.worst_text(base)}",
                       bool(np.max(mixed) >= 0.98 * np.max(maps))))
    if sequence.has("PMCD-EB", "PMCD-EB-SO"):
        both = change(sequence, "PMCD-EB", "PMCD-EB-SO", "time_ms")[sequence.led()]
        claims.append(("SO: frame time after frame 0", "substantially less", spread(both, percent), bool(np.mean(both) < 0)))
    caption = ("Median time of every frame by variant: everything that a frame does, following the moved instances "
               "included, loading and animating not. "
               + (f"Bars: {bars}" if bars else "One run of each")
               + (", marks of a frame stand side by side." if gap_of(sequence.frames) > 1 else "."))
    figures.save(10, sequence, figure, "Frame times over the animation", caption,
                 {f"{l} (ms)": v for l, v in columns.items()}, claims)


def figure_11(figures, sequence):
    kept = [l for l in sequence.maps() if {"SO", "SOR"} & set(sequence.parts(l))]
    if not kept:
        return "a variant with SO or SOR"
    figure, (pages, times) = plt.subplots(2, 1, figsize=(COLUMN, 3.1), sharex=True,
                                          gridspec_kw={"height_ratios": [1.5, 1]})
    columns, claims = {}, []
    handles = []
    # Sparse textures: the driver's own commits. Otherwise pages are ours, and only clears cost.
    is_sparse = figures.provenance.get("gl_pages") == "sparse"
    stage = "page commit" if is_sparse else "page allocation"
    extent = "the driver's commits with their bookkeeping" if is_sparse else "all of page allocation"
    for i, label in enumerate(kept):
        look = style(label, i) | ({"linestyle": "none"} if gap_of(sequence.frames) > 1 else {})
        committed, freed = (sequence.values(label, f"pages_{kind}_count") for kind in ("committed", "freed"))
        milliseconds = sequence.stage(label, stage)
        handles += pages.plot(sequence.frames, committed, label=f"{label}, committed", **look)
        look = dict(look, markerfacecolor="white", markeredgewidth=0.6,
                    linestyle="none" if gap_of(sequence.frames) > 1 else ":")
        handles += pages.plot(sequence.frames, -freed, label=f"{label}, freed", **look)
        times.plot(sequence.frames, milliseconds, label=label, **(style(label, i) | {"linestyle": look["linestyle"]}))
        columns |= {f"{label} committed (pages)": committed, f"{label} freed (pages)": freed,
                    f"{label} {stage} (ms)": milliseconds}
        total = np.sum(committed)
        cost = 1000 * np.sum(milliseconds) / total if total else float("nan")
        claims.append((f"{label}: time a committed page", "7 us",
                       f"{cost:.2f} us ({extent})" if total else "none committed",
                       bool(cost <= 7) if total else None))
        claims.append((f"{label}: longest {stage} of a frame", "over 100 ms (spikes)",
                       f"{np.max(milliseconds):.2f} ms", None))
    pages.axhline(0, color="black", linewidth=0.5)
    pages.yaxis.set_major_formatter(FuncFormatter(lambda v, _: engineering(abs(v))))
    axes_over_frames(sequence, times, "commits (ms)" if is_sparse else "allocation (ms)")
    pages.set_ylabel("pages freed  |  committed")
    times.set_ylim(bottom=0)
    legend_above(pages, len(handles), 2)
    caption = ("Pages that got memory (up) and that lost it (down) from the frame shown before, and the time of "
               + ("the commits of sparse textures by the driver, with their bookkeeping. " if is_sparse
                  else "page allocation with its clears. ") + "Variants without static optimization allocate everything anew.")
    figures.save(11, sequence, figure, "Page commits and frees", caption, columns, claims)


def figure_12(figures, sequence):
    wanted = ["PMCD-EB", "RT", "Hybrid", "PMCD-EB-SO", "CFM", "PMC"]
    hybrids = [l for l in sequence.labels if l.startswith("Hybrid:")]
    chosen = [l for l in wanted + hybrids + sequence.labels if l in sequence.labels and l != "embree"]
    chosen = list(dict.fromkeys(chosen))[:6]
    if not chosen:
        return "variants to compare"
    rows = -(-len(chosen) // 2)
    names = sequence.stages(chosen)
    legend_height = 0.13 * -(-len(names) // 4) + 0.05
    figure = plt.figure(figsize=(COLUMN, 0.3 + legend_height + 1.15 * rows))
    cells = figure.add_gridspec(rows + 1, min(2, len(chosen)), height_ratios=[legend_height] + [1.15] * rows)
    head = figure.add_subplot(cells[0, :])
    head.set_axis_off()
    grid = np.empty((rows, cells.ncols), dtype=object)
    for at in np.ndindex(grid.shape):
        shared = grid[0, 0] if at != (0, 0) else None
        grid[at] = figure.add_subplot(cells[at[0] + 1, at[1]], sharex=shared, sharey=shared)
        grid[at].tick_params(labelbottom=at[0] == rows - 1, labelleft=at[1] == 0)
    columns, top = {}, 0
    for panel, label in zip(grid.flat, chosen):
        stack = [sequence.stage(label, name) for name in names]
        colors = [STAGE_COLORS.get(n, SPARE[i % len(SPARE)]) for i, n in enumerate(names)]
        panel.stackplot(sequence.frames, stack, colors=colors, labels=names, edgecolor="white", linewidth=0.2)
        panel.set_title(label, fontsize=6.5, pad=2)
        panel.grid(axis="x", visible=False)
        top = max(top, np.max(np.sum(stack, axis=0)))
        columns |= {f"{label}: {name} (ms)": values for name, values in zip(names, stack)}
    for panel in list(grid.flat)[len(chosen):]:
        panel.set_visible(False)
    for panel in grid[-1]:
        panel.set_xlabel("frame")
    for row in grid:
        row[0].set_ylabel("time (ms)")
        row[0].set_ylim(0, top * 1.03)
    if len(sequence.frames) > 1:
        grid[0][0].set_xlim(sequence.frames[0], sequence.frames[-1])
    grid[0][0].xaxis.set_major_locator(MaxNLocator(4, integer=True))
    handles, labels = grid[0][0].get_legend_handles_labels()
    head.legend(handles, labels, loc="center", ncol=4, columnspacing=0.9, handlelength=1.0, fontsize=5.6,
                borderaxespad=0)
    claims = []
    if sequence.has("PMCD-EB"):
        drawn, culled = sequence.stage("PMCD-EB", "rasterization"), sequence.stage("PMCD-EB", "culling")
        claims.append(("PMCD-EB: rasterizing costs more than culling", "yes",
                       f"{np.sum(drawn) / max(1e-9, np.sum(culled)):.1f} times as much", bool(np.sum(drawn) > np.sum(culled))))
    if sequence.has("PMCD-EB", "PMCD-EB-SO"):
        change_ = 100 * (np.sum(sequence.stage("PMCD-EB-SO", "rasterization"))
                         / max(1e-9, np.sum(sequence.stage("PMCD-EB", "rasterization"))) - 1)
        claims.append(("SO: time of drawing triangles", "large improvements overall", percent(change_), bool(change_ < 0)))
    if sequence.has("PMCD", "PMCD-EB"):
        ratio = np.sum(sequence.stage("PMCD-EB", "clusters")) / max(1e-9, np.sum(sequence.stage("PMCD", "clusters")))
        claims.append(("EB: cost of finding unique clusters", "roughly doubled", f"{ratio:.2f} times", None))
    caption = "Medians of every stage, one on the other, in the order of the frame; ray tracing is part of shading."
    figures.save(12, sequence, figure, "Where the time goes over the animation", caption, columns, claims)
