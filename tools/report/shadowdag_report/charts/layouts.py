# SPDX-License-Identifier: Apache-2.0
"""Draws bytes against ray rate of the layouts in layouts.json (voxel/LAYOUT.md), as SVG and PNG.

    layouts tests/bench/results/layouts.json -o docs
"""
import os

from ..collection import save_figure
from ..files import Refused, expecting, read_json
from ..style import BLACK, BLUE, COLUMN, GREY, VERMILION, plt

RESOLUTION = 4096
SHAPES = {  # colour and marker: each alone distinguishes them
    "8-ary": (BLUE, "o"), "8-ary symmetric": (BLUE, "D"), "64-ary": (VERMILION, "s"),
    "64-ary symmetric": (VERMILION, "^")}


def load(path):
    """Returns the rows to draw, by scene, after checking that they are complete."""
    with expecting(path, "a file of layouts"):
        drawn = [r for r in read_json(path)["traced"] if r["resolution"] == RESOLUTION]
        for row in drawn:
            if row["shape"] not in SHAPES:
                raise Refused(f"{path}: unknown shape {row['shape']!r}; there are {', '.join(SHAPES)}")
            float(row["traced_bytes"]), float(row["rate_ratio"]), row["label"]
    scenes = {}
    for row in drawn:
        scenes.setdefault(row["scene"], []).append(row)
    if not scenes:
        raise Refused(f"{path}: no rows at {RESOLUTION}^3")
    return scenes


def panel(axes, scene, rows, isFirst):
    """Draws one scene: one point per layout, numbered as in the list below the charts."""
    for shape, (colour, marker) in SHAPES.items():
        members = [r for r in rows if r["shape"] == shape]
        if not members:
            continue
        xs = [r["traced_bytes"] / 1e6 for r in members]
        ys = [r["rate_ratio"] for r in members]
        spread = [[y - r["rate_ratio_min"] for y, r in zip(ys, members)],
                  [r["rate_ratio_max"] - y for y, r in zip(ys, members)]]
        axes.errorbar(xs, ys, yerr=spread, fmt="none", ecolor=GREY, elinewidth=0.6, zorder=2)
        axes.plot(xs, ys, linestyle="none", marker=marker, markersize=4.4, color=colour,
                  markerfacecolor="white" if "symmetric" in shape else colour, markeredgewidth=0.9,
                  zorder=3, label=shape if isFirst else None)
    kept = [r for r in rows if r["kept"]]
    axes.plot([r["traced_bytes"] / 1e6 for r in kept], [r["rate_ratio"] for r in kept], "o",
              markersize=9.5, markerfacecolor="none", markeredgecolor=BLACK, markeredgewidth=0.8,
              zorder=4, label="in the code" if isFirst else None)
    # Labels of neighbours alternate above and below their points; of two that touch, the upper has its own above.
    near = 0.03 * max(r["traced_bytes"] for r in rows)
    for shape in ("8-ary", "64-ary"):
        members = sorted((r for r in rows if r["shape"].startswith(shape)), key=lambda r: r["traced_bytes"])
        above = [i % 2 == 1 for i in range(len(members))]
        for i, (left, right) in enumerate(zip(members, members[1:])):
            if right["traced_bytes"] - left["traced_bytes"] < near:
                above[i] = left["rate_ratio"] > right["rate_ratio"]
                above[i + 1] = not above[i]
        for r, isAbove in zip(members, above):
            axes.annotate(r["label"], (r["traced_bytes"] / 1e6, r["rate_ratio_max" if isAbove else "rate_ratio_min"]),
                          xytext=(0, 4.5 if isAbove else -4.5), textcoords="offset points", ha="center",
                          va="bottom" if isAbove else "top", fontsize=6.4)
    axes.set_title(f"{scene}, {RESOLUTION}³", fontsize=7.5, loc="left")
    axes.set_xlim(0, 1.08 * max(r["traced_bytes"] for r in rows) / 1e6)
    axes.set_ylim(0.6, max(r["rate_ratio_max"] for r in rows) + 0.22)
    axes.set_ylabel("rays a second\n(8-ary, 32 bit: 1)")


def declare(parser):
    parser.add_argument("data", help="layouts.json")
    parser.add_argument("-o", "--output", required=True, help="directory")


def run(arguments):
    scenes = load(arguments.data)
    figure, all_axes = plt.subplots(len(scenes), 1, figsize=(COLUMN, 1.75 * len(scenes) + 1.5), squeeze=False)
    for i, (scene, rows) in enumerate(sorted(scenes.items(), reverse=True)):
        panel(all_axes[i][0], scene, rows, i == 0)
    all_axes[-1][0].set_xlabel("bytes as traced (MB)")
    all_axes[0][0].legend(loc="lower center", bbox_to_anchor=(0.45, 1.12), ncol=3, columnspacing=1.0,
                          handletextpad=0.2)
    key = {r["label"]: r["variant"] for rows in scenes.values() for r in rows}
    text = "\n".join(f"{label}  {name}".replace("^3", "³") for label, name in key.items())
    all_axes[-1][0].text(0.0, -0.38, text, transform=all_axes[-1][0].transAxes, fontsize=5.8, va="top",
                         linespacing=1.35)
    save_figure(figure, os.path.join(arguments.output, "layouts"), bbox_inches="tight")
