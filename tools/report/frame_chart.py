#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws what a pair costs in a whole frame, ours beside Embree's, from results of `shadowdag bench voxel --json`.

usage: frame_chart.py RESULT... -o PICTURE.png

One group of bars a scene; the dashed line is a third of rtcOccluded16's time in that scene.
"""
import argparse
import json
import pathlib
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

COLORS = {"streams": "#56B4E9", "rtcOccluded16": "#D55E00"}


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", type=pathlib.Path)
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    options = parser.parse_args(arguments)
    plt.rcParams.update({"font.size": 7, "svg.fonttype": "none"})
    results = [json.loads(path.read_text()) for path in options.results]
    figure, axes = plt.subplots(figsize=(3.33, 0.5 + 0.75 * len(results)))
    y, ticks, names = 0.0, [], []
    for result in results:
        frame = result["frame"]
        embree = next(m for m in frame["methods"] if m["method"] == "rtcOccluded16")["ns_per_pair"]
        start = y
        for method in frame["methods"]:
            name = method["method"]
            axes.barh(y, method["ns_per_pair"], 0.85, color=COLORS[name], edgecolor="black", linewidth=0.4,
                      label=name if result is results[0] else None)
            axes.annotate("{:.0f}".format(method["ns_per_pair"]), (method["ns_per_pair"], y), xytext=(2, 0),
                          textcoords="offset points", va="center", fontsize=6)
            y -= 1
        axes.plot([embree / 3] * 2, [start + 0.5, y + 0.5], color="black", linestyle="--", linewidth=0.9,
                  label="a third of rtcOccluded16" if result is results[0] else None)
        ticks.append((start + y + 1) / 2)
        names.append("{}\n{}³, {} × {}".format(pathlib.Path(result["scene"].removeprefix("builtin:")).stem.replace("_", " "),
                                               result["resolution"], frame["width"], frame["height"]))
        y -= 0.8
    axes.set_yticks(ticks, names)
    axes.set_xlabel("visibility of a pair, one thread (ns)")
    axes.set_xlim(right=axes.get_xlim()[1] * 1.05)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncol=2, frameon=False, fontsize=6)
    for suffix in (".png", ".svg"):
        figure.savefig(options.output.with_suffix(suffix), dpi=300, bbox_inches="tight")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
