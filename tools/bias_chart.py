#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws what the bias of a map's lookup gives and costs, as SVG and PNG, from what filter_bench prints.

    filter_bench > tests/bench/results/filters.json
    bias_chart.py tests/bench/results/filters.json -o docs
"""
import argparse
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from charts import BLACK, BLUE, COLUMN, GREY, ORANGE, VERMILION, plt  # its style as well

DEFAULT_BIAS = 0.5
STEEPEST = 75  # degrees; what folds do beyond is at grazing light, see shadowmap/FILTERS.md
STYLES = [(BLACK, "o"), (GREY, "x"), (VERMILION, "s"), (ORANGE, "D"), (BLUE, "^")]


def fail(message):
    sys.exit(f"bias_chart.py: {message}")


def load(path):
    """Returns the results after checking that they have what is drawn."""
    try:
        with open(path) as file:
            data = json.load(file)
        for row in data["acne"]:
            row["shape"], row["dark_count"] + row["point_count"] + row["angle_degrees"] + row["bias_texels"]
        for row in data["detached"]:
            row["lit_texels_mean"] + row["angle_degrees"] + row["bias_texels"]
        for row in data["filters"]:
            row["scene"], row["false_light_count"] + row["false_shadow_count"] + row["point_count"] + row["taps"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        fail(f"{path}: not what filter_bench prints: {error!r}")
    return data


def biasesOf(rows):
    return sorted({row["bias_texels"] for row in rows})


def drawAcne(axes, rows):
    """Draws the greatest share of dark points over angles and resolutions, a line a shape."""
    for shape, (colour, marker) in zip(dict.fromkeys(r["shape"] for r in rows), STYLES):
        shares = [max(100.0 * r["dark_count"] / r["point_count"] for r in rows
                      if r["shape"] == shape and r["bias_texels"] == bias
                      and r["angle_degrees"] <= (85 if shape.startswith("plane") else STEEPEST))
                  for bias in biasesOf(rows)]
        axes.plot(biasesOf(rows), shares, marker=marker, color=colour, markersize=3.5, linewidth=0.9, label=shape)
    axes.set_ylabel("lit points that are dark, %,\nat the worst light angle")


def drawDetached(axes, rows):
    for angle, (colour, marker) in zip((5, 45, 65, 75, 85), STYLES):
        means = [r["lit_texels_mean"] for r in rows if r["angle_degrees"] == angle]
        axes.plot(biasesOf(rows), means, marker=marker, color=colour, markersize=3.5, linewidth=0.9,
                  label=f"light at {angle} degrees")
    axes.set_ylabel("lit floor behind a wall's foot, texels")
    axes.set_ylim(0, 4.6)  # room for the legend


def drawScenes(axes, rows):
    rows = [r for r in rows if r["taps"] == 9]
    for scene, colour in zip(dict.fromkeys(r["scene"] for r in rows), (BLUE, VERMILION)):
        for key, line, name in (("false_light_count", "-", "false light"), ("false_shadow_count", "--", "false shadow")):
            values = [100.0 * r[key] / r["point_count"] for r in rows if r["scene"] == scene]
            axes.plot(biasesOf(rows), values, line, marker="o", markersize=3, color=colour, linewidth=0.9,
                      label=f"{scene}, {name}")
    axes.set_ylabel("wrong points, %, 512 texels, 9 taps")
    axes.set_ylim(bottom=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results")
    parser.add_argument("-o", "--output", default=".", help="directory")
    arguments = parser.parse_args()
    data = load(arguments.results)
    figure, axes = plt.subplots(1, 3, figsize=(2.05 * COLUMN, 0.72 * COLUMN))
    drawAcne(axes[0], data["acne"])
    drawDetached(axes[1], data["detached"])
    drawScenes(axes[2], data["filters"])
    for each in axes:
        each.axvline(DEFAULT_BIAS, color=GREY, linewidth=0.6, linestyle=":")
        each.set_xlabel("bias, texels (dotted: default)")
        each.legend(fontsize=5.5, loc="upper right" if each is axes[0] else "upper left")
    figure.tight_layout()
    os.makedirs(arguments.output, exist_ok=True)
    for extension in ("svg", "png"):
        path = os.path.join(arguments.output, f"bias.{extension}")
        figure.savefig(path, dpi=200)
        print(path)


if __name__ == "__main__":
    main()
