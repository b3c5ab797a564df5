# SPDX-License-Identifier: Apache-2.0
"""Draws the cost of a pair in a whole frame, ours and Embree's, from results of `shadowdag bench voxel --json`.

One group of bars per scene, with the intervals of the medians.
"""
import pathlib

from ..collection import save_figure
from ..files import expecting, read_json
from ..intervals import confidence_text, interval, least_confidence, pair_time
from ..style import COLUMN, ORANGE, SKY, VERMILION, YELLOW, plt

COLORS = {"streams": SKY, "exact streams": YELLOW, "rtcOccluded16": VERMILION, "rtcOccluded8": ORANGE}


def load(paths):
    """Returns the results, each with a whole frame by known methods."""
    results = []
    for path in paths:
        with expecting(path, "a result of bench voxel with a whole frame"):
            result = read_json(path)
            frame = result["frame"]
            result["scene"], result["resolution"], frame["width"], frame["height"]
            if "rtcOccluded16" not in {COLORS[m["method"]] and m["method"] for m in frame["methods"] if m["ns_per_pair"] > 0}:
                raise ValueError("no rtcOccluded16")
            results.append(result)
    return results


def declare(parser):
    parser.add_argument("results", nargs="+")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path, help="PICTURE.png; the SVG goes beside it")


def run(arguments):
    results = load(arguments.results)
    figure, axes = plt.subplots(figsize=(COLUMN, 0.5 + 0.75 * len(results)))
    y, ticks, names, timed = 0.0, [], [], []
    for result in results:
        frame = result["frame"]
        start = y
        for method in frame["methods"]:
            name = method["method"]
            axes.barh(y, method["ns_per_pair"], 0.85, color=COLORS[name], edgecolor="black", linewidth=0.4,
                      label=name if result is results[0] else None)
            timed.append(pair_time(method, result["repeat_count"]))
            low, high, _ = interval(timed[-1], "ns_per_pair")
            axes.plot([low, high], [y, y], color="black", linewidth=0.8, marker="|", markersize=3.5)
            axes.annotate("{:.0f}".format(method["ns_per_pair"]), (high, y), xytext=(3, 0),
                          textcoords="offset points", va="center", fontsize=6)
            y -= 1
        ticks.append((start + y + 1) / 2)
        names.append("{}\n{}³, {} × {}".format(pathlib.Path(result["scene"].removeprefix("builtin:")).stem.replace("_", " "),
                                               result["resolution"], frame["width"], frame["height"]))
        y -= 0.8
    axes.set_yticks(ticks, names)
    few = min(row["repeat_count"] for row in timed)
    axes.set_xlabel(f"visibility of a pair, one thread (ns)\n{confidence_text(least_confidence(timed, 'ns_per_pair'))} intervals of {few} "
                    "repeats", fontsize=6.5)
    axes.set_xlim(right=axes.get_xlim()[1] * 1.05)
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncol=3)
    save_figure(figure, str(arguments.output.with_suffix("")), bbox_inches="tight")
