# SPDX-License-Identifier: Apache-2.0
"""Draws the effect of the bias of a map's lookup, as SVG, PNG and JSON, from the output of filter_bench.
Designed for both columns of a paper (17.8 cm).

    filter_bench > tests/bench/results/filters.json
    bias tests/bench/results/filters.json -o docs
"""
import os

from ..collection import save_figure
from ..files import expecting, read_json, write_json
from ..style import BLACK, BLUE, COLUMN, GREY, ORANGE, VERMILION, plt

DEFAULT_BIAS = 0.5
STEEPEST = 75  # degrees; what folds do beyond is at grazing light, see shadowmap/FILTERS.md
STYLES = [(BLACK, "o"), (GREY, "x"), (VERMILION, "s"), (ORANGE, "D"), (BLUE, "^")]


def load(path):
    """Returns the results after checking that they are complete."""
    with expecting(path, "what filter_bench prints"):
        data = read_json(path)
        for row in data["acne"]:
            row["shape"], row["dark_count"] + row["point_count"] + row["angle_degrees"] + row["bias_texels"]
        for row in data["detached"]:
            row["lit_texels_mean"] + row["angle_degrees"] + row["bias_texels"]
        for row in data["filters"]:
            row["scene"], row["false_light_count"] + row["false_shadow_count"] + row["point_count"] + row["taps"]
            row["bias_texels"] + 0
        for key in ("acne", "detached", "filters"):
            if not data[key]:
                raise ValueError(f"no {key}")
    return data


def acne_lines(rows):
    """Returns by shape the greatest share of dark points over angles and resolutions, %, bias by bias."""
    lines = {}
    for shape in dict.fromkeys(r["shape"] for r in rows):
        steepest = 85 if shape.startswith("plane") else STEEPEST
        shares = {}
        for r in rows:
            if r["shape"] == shape and r["angle_degrees"] <= steepest:
                share = 100.0 * r["dark_count"] / r["point_count"]
                shares[r["bias_texels"]] = max(share, shares.get(r["bias_texels"], 0.0))
        lines[shape] = sorted(shares.items())
    return lines


def detached_lines(rows):
    """Returns by light angle the mean width of lit floor behind a wall's foot, texels, bias by bias."""
    return {f"light at {angle} degrees": line for angle in (5, 45, 65, 75, 85)
            if (line := sorted((r["bias_texels"], r["lit_texels_mean"]) for r in rows if r["angle_degrees"] == angle))}


def scene_lines(rows):
    """Returns by scene and kind of error the share of wrong points with nine taps, %, bias by bias."""
    rows = [r for r in rows if r["taps"] == 9]
    return {f"{scene}, {name}": sorted((r["bias_texels"], 100.0 * r[key] / r["point_count"])
                                       for r in rows if r["scene"] == scene)
            for scene in dict.fromkeys(r["scene"] for r in rows)
            for key, name in (("false_light_count", "false light"), ("false_shadow_count", "false shadow"))}


def draw_line(axes, line, **style):
    axes.plot([bias for bias, _ in line], [value for _, value in line], linewidth=0.9, **style)


def draw_acne(axes, lines):
    for (shape, line), (colour, marker) in zip(lines.items(), STYLES):
        draw_line(axes, line, marker=marker, color=colour, markersize=3.5, label=shape)
    axes.set_ylabel("lit points that are dark, %,\nat the worst light angle")


def draw_detached(axes, lines):
    for (name, line), (colour, marker) in zip(lines.items(), STYLES):
        draw_line(axes, line, marker=marker, color=colour, markersize=3.5, label=name)
    axes.set_ylabel("lit floor behind a wall's foot, texels")
    axes.set_ylim(0, 4.6)  # space for the legend


def draw_scenes(axes, lines):
    colours = dict(zip(dict.fromkeys(name.rsplit(", ", 1)[0] for name in lines), (BLUE, VERMILION, BLACK, ORANGE)))
    for name, line in lines.items():
        draw_line(axes, line, marker="o", markersize=3, color=colours.get(name.rsplit(", ", 1)[0], GREY),
                 linestyle="-" if name.endswith("light") else "--", label=name)
    axes.set_ylabel("wrong points, %, 512 texels, 9 taps")
    axes.set_ylim(bottom=0)


def declare(parser):
    parser.add_argument("results", help="what filter_bench printed")
    parser.add_argument("-o", "--output", default=".", help="directory")


def run(arguments):
    data = load(arguments.results)
    figure, axes = plt.subplots(1, 3, figsize=(2 * COLUMN + 0.3, 0.75 * COLUMN))
    lines = {"acne_percent": acne_lines(data["acne"]), "detached_texels": detached_lines(data["detached"]),
             "wrong_percent": scene_lines(data["filters"])}
    for draw, each, of in zip((draw_acne, draw_detached, draw_scenes), axes, lines.values()):
        draw(each, of)
    for each in axes:
        each.axvline(DEFAULT_BIAS, color=GREY, linewidth=0.6, linestyle=":")
        each.set_xlabel("bias (texels; dotted: default)")
        each.legend(fontsize=6, loc="upper right" if each is axes[0] else "upper left")
    save_figure(figure, os.path.join(arguments.output, "bias"))
    write_json(os.path.join(arguments.output, "bias.json"), lines, None)
    for kind in ("svg", "png", "json"):
        print(os.path.join(arguments.output, f"bias.{kind}"))
