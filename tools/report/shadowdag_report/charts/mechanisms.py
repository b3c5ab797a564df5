# SPDX-License-Identifier: Apache-2.0
"""Draws the measurements of `shadowdag study ablation`: ratios with over without, mechanism by mechanism, as SVG and PNG.

    mechanisms-chart ablation.json -o DIR

writes DIR/mechanisms.svg and DIR/mechanisms.png. A row is a mechanism, a panel a metric: its own, time, error, bytes.
Each scene is a mark, the vertical stroke their mean; left of 1 is a gain. Values beyond a panel are at its edge with
an arrow.
"""
from matplotlib.lines import Line2D

from ..collection import Charts
from ..files import Refused, expecting, read_json
from ..style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, FixedLocator, FuncFormatter, NullLocator, plt

WIDTH, ROW = 7.0, 0.158  # inches
LOW, HIGH = 0.2, 5.0
PANELS = (("own_ratio", "own metric"), ("time_ratio", "time"), ("error_ratio", "error"), ("bytes_ratio", "bytes"))
MARKS = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"), (VERMILION, "v"))
METRICS = {"time_ms": "time", "mean_abs_visibility_error": "error", "bytes": "bytes", "triangle_draw_count": "triangles",
           "texel_count": "texels", "false_shadow_count": "false shadow", "false_light_count": "false light",
           "flicker_count": "flicker", "flip": "FLIP", "wrong_pair_count": "wrong pairs"}
VERDICTS = {"default on": "on", "default off, an option": "option",
            "default off, kept for the comparison": "kept", "to be deleted": "delete"}


def stand(axes, ratio, y, color, marker, size, hollow=False):
    """Marks a ratio, at the panel's edge with an arrow if it is beyond."""
    shown = min(max(ratio, LOW), HIGH)
    axes.plot([shown], [y], linestyle="", marker=marker, markersize=size, color=color, markeredgewidth=0.6,
              markerfacecolor="white" if hollow else color, clip_on=False, zorder=3)
    if ratio < LOW or ratio > HIGH:
        axes.annotate("", xy=(LOW / 1.18 if ratio < LOW else HIGH * 1.18, y), xytext=(shown, y), annotation_clip=False,
                      arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 0.6, "mutation_scale": 4,
                                  "shrinkA": 1, "shrinkB": 0})


@plt.rc_context({"figure.constrained_layout.use": False})  # names and verdicts need fixed space
def mechanisms_chart(charts, results):
    rows = results["mechanisms"]
    looks = {scene: MARKS[i % len(MARKS)] for i, scene in enumerate(results["scenes"])}
    height = ROW * len(rows) + 1.2
    figure, panels = plt.subplots(1, len(PANELS), sharey=True, figsize=(WIDTH, height))
    figure.subplots_adjust(left=0.245, right=0.875, top=1 - 0.55 / height, bottom=0.5 / height, wspace=0.12)
    for axes, (key, title) in zip(panels, PANELS):
        axes.axvline(1, color=BLACK, linewidth=0.7, zorder=1)
        for y, row in enumerate(rows):
            for scene in row["scenes"]:
                if scene.get(key) is None:
                    continue
                color, marker = looks.get(scene["scene"], (GREY, "D"))
                stand(axes, scene[key], y, color, marker, 2.9, scene["is_failure"])
            if row.get(key) is not None and LOW <= row[key] <= HIGH:
                axes.plot([row[key]] * 2, [y - 0.42, y + 0.42], color=BLACK, linewidth=0.9, zorder=2)
        axes.set_xscale("log")
        axes.set_xlim(LOW, HIGH)
        axes.xaxis.set_major_locator(FixedLocator([0.2, 0.5, 1, 2, 5]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_title(title, fontsize=7.5)
        axes.tick_params(axis="y", length=0)
        for y in range(0, len(rows), 2):
            axes.axhspan(y - 0.5, y + 0.5, color="#f4f6f8", zorder=0, linewidth=0)
    panels[0].set_yticks(range(len(rows)), [f"{row['name']} ({METRICS[row['metric']]})" for row in rows], fontsize=6)
    panels[0].set_ylim(len(rows) - 0.4, -0.6)
    for y, row in enumerate(rows):
        verdict = VERDICTS[row["verdict"]]
        panels[-1].annotate(verdict + ("" if row["agrees"] else " \u2260 now"), xy=(1.16, y),
                            xycoords=("axes fraction", "data"), va="center", fontsize=6, annotation_clip=False,
                            color=BLACK if verdict == "on" else "#555555",
                            fontweight="normal" if row["agrees"] else "bold")
    panels[-1].annotate("verdict", xy=(1.16, 1.0), xytext=(0, 4), textcoords="offset points",
                        xycoords="axes fraction", fontsize=7.5, annotation_clip=False)
    figure.text(0.56, 0.12 / height, "with over without (left of 1 is a gain)", fontsize=7.5, ha="center")
    handles = [Line2D([], [], linestyle="", marker=marker, markersize=3.2, color=color,
                      label=scene.removeprefix("builtin:")) for scene, (color, marker) in looks.items()]
    handles += [Line2D([], [], linestyle="", marker="D", markersize=3.2, color=GREY, markerfacecolor="white",
                       label="a failure that it is a remedy for"),
                Line2D([], [], linestyle="", marker="|", markersize=6, color=BLACK, label="mean of the scenes")]
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.55, 1.0), ncol=5, handletextpad=0.3, columnspacing=1.4)
    charts.save(figure, "mechanisms", "The gain of each mechanism",
                "Ratios with over without, by mechanism and scene, on a logarithmic axis; left of 1 is a gain.")


def draw(path, directory):
    with expecting(path, "a result of study ablation"):
        results = read_json(path)
        is_empty = not results["mechanisms"]
    if is_empty:
        raise Refused(f"{path}: holds no mechanism")
    charts = Charts(directory)
    mechanisms_chart(charts, results)
    charts.finish()


def declare(parser):
    parser.add_argument("results", help="ablation.json of study ablation")
    parser.add_argument("-o", "--output", required=True, help="where the chart goes")


def run(arguments):
    draw(arguments.results, arguments.output)
