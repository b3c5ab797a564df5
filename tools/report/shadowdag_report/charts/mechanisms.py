# SPDX-License-Identifier: Apache-2.0
"""Draws the measurements of `shadowdag study ablation`: ratios with over without, mechanism by mechanism, as SVG and PNG.

    mechanisms-chart ablation.json -o DIR

writes DIR/mechanisms.svg and DIR/mechanisms.png at the width of a column. Rows are grouped by what a mechanism is meant to
reduce; the panels are its own metric, time and error. A tick is a scene, a disc the geometric mean over the scenes, which
differ much; a bar reaches from the least to the greatest scene, of times by the range of the repeats of both. Left of 1 is a
gain; values beyond a panel are at its edge with an arrow. A failure that the mechanism is a remedy for is a hollow mark.
Designed for one column of a paper (8.5 cm).
"""
from matplotlib.lines import Line2D

from ..collection import Charts
from ..files import Refused, expecting, read_json
from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, VERMILION, FixedLocator, FuncFormatter, NullLocator, plt, plural

ROW, GAP = 0.118, 1.3  # inches a row; rows above a group, for its title
LOW, HIGH = 0.2, 5.0
PANELS = (("own_ratio", "own metric"), ("time_ratio", "time"), ("error_ratio", "error"))
METRICS = {"time_ms": "time", "mean_abs_visibility_error": "error", "bytes": "bytes", "triangle_draw_count": "triangles",
           "texel_count": "texels", "false_shadow_count": "false shadow", "false_light_count": "false light",
           "flicker_count": "flicker", "flip": "FLIP", "wrong_pair_count": "wrong pairs"}
GROUPS = (  # title, colour, metrics
    ("texels and bytes", BLUE, ("bytes", "texel_count")), ("triangles", GREEN, ("triangle_draw_count",)),
    ("errors and flicker", VERMILION, ("mean_abs_visibility_error", "false_shadow_count", "false_light_count",
                                       "flicker_count", "flip", "wrong_pair_count")),
    ("time", ORANGE, ("time_ms",)), ("terms of the cost model", PURPLE, ()))
VERDICTS = {"default on": "on", "default off, an option": "option",
            "default off, kept for the comparison": "kept", "to be deleted": "delete"}


def group_of(row):
    """Returns the place of a row's group: terms of the cost model have one of their own."""
    if row.get("kind") == "term" or row["name"].startswith("term-"):
        return len(GROUPS) - 1
    return next((i for i, (_, _, metrics) in enumerate(GROUPS) if row["metric"] in metrics), len(GROUPS) - 2)


def ends_of(scene, key):
    """Returns what a scene's ratio is at least and at most: of times, by the least and the greatest of the repeats."""
    off, on = scene.get("off", {}).get("time_ms"), scene.get("on", {}).get("time_ms")
    if key == "time_ratio" and isinstance(off, list) and isinstance(on, list) and off and on and min(off) > 0:
        return min(on) / max(off), max(on) / min(off)
    return scene[key], scene[key]


def arrow(axes, ratio, y, color):
    """Marks a ratio that is beyond a panel: at its edge, with an arrow."""
    shown, tip = (LOW, LOW / 1.25) if ratio < LOW else (HIGH, HIGH * 1.25)
    axes.annotate("", xy=(tip, y), xytext=(shown, y), annotation_clip=False,
                  arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 0.7, "mutation_scale": 4.5, "shrinkA": 0, "shrinkB": 0})


def draw_row(axes, row, key, y, color):
    scenes = [s for s in row["scenes"] if s.get(key) is not None]
    for scene in (s for s in scenes if s["is_failure"]):
        axes.plot([min(max(scene[key], LOW), HIGH)], [y], linestyle="", marker="D", markersize=2.2, color=GREY,
                  markerfacecolor="white", markeredgewidth=0.5, clip_on=False, zorder=2)
    ends = [ends_of(s, key) for s in scenes if not s["is_failure"]]
    if ends:
        low, high = min(e[0] for e in ends), max(e[1] for e in ends)
        axes.plot([min(max(low, LOW), HIGH), min(max(high, LOW), HIGH)], [y, y], color=color, linewidth=1.0, alpha=0.75,
                  solid_capstyle="butt", zorder=3, clip_on=False)
        places = [min(max(s[key], LOW), HIGH) for s in scenes if not s["is_failure"]]
        axes.plot(places, [y] * len(places), linestyle="", marker="|", markersize=3.6, markeredgewidth=0.6, color=color, zorder=3, clip_on=False)
    if row.get(key) is not None:
        axes.plot([min(max(row[key], LOW), HIGH)], [y], marker="o", markersize=2.6, color=color, markeredgewidth=0, zorder=4,
                  clip_on=False)
        if not LOW <= row[key] <= HIGH:
            arrow(axes, row[key], y, color)


@plt.rc_context({"figure.constrained_layout.use": False})  # names and verdicts need fixed space
def mechanisms_chart(charts, results):
    groups = [[r for r in results["mechanisms"] if group_of(r) == i] for i in range(len(GROUPS))]
    places, y = [], 0.0
    for rows in groups:
        y += GAP if rows else 0
        for row in rows:
            places.append((row, y))
            y += 1
    height = ROW * y + 0.99
    figure, panels = plt.subplots(1, len(PANELS), sharey=True, figsize=(COLUMN, height))
    figure.subplots_adjust(left=0.385, right=0.885, top=1 - 0.66 / height, bottom=0.36 / height, wspace=0.16)
    for axes, (key, title) in zip(panels, PANELS):
        axes.axvline(1, color=BLACK, linewidth=0.6, zorder=1)
        for row, at in places:
            draw_row(axes, row, key, at, GROUPS[group_of(row)][1])
        axes.set_xscale("log")
        axes.set_xlim(LOW, HIGH)
        axes.xaxis.set_major_locator(FixedLocator([0.3, 1, 3]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_title(title, fontsize=6.5, pad=3)
        axes.tick_params(axis="y", length=0)
        axes.tick_params(axis="x", labelsize=5.8)
    panels[0].set_yticks([at for _, at in places], [f"{row['name']} ({METRICS[row['metric']]})" for row, _ in places], fontsize=5.2)
    panels[0].set_ylim(y - 0.4, 0.3)
    for row, at in places:
        verdict = VERDICTS[row["verdict"]]
        panels[-1].annotate(verdict + ("" if row["agrees"] else " \u2260 now"), xy=(1.14, at), xycoords=("axes fraction", "data"),
                            va="center", fontsize=5.2, annotation_clip=False, color=BLACK if verdict == "on" else "#555555",
                            fontweight="normal" if row["agrees"] else "bold")
    for (title, color, _), rows in zip(GROUPS, groups):
        first = next((at for row, at in places if rows and row is rows[0]), None)
        if first is not None:
            panels[0].annotate(title, xy=(-0.04, first - 0.92), xycoords=("axes fraction", "data"), ha="right", va="center", fontsize=5.8,
                               fontweight="bold", color=color, annotation_clip=False)
    figure.text(0.5, 0.09 / height, "with over without (left of 1 is a gain; arrow: beyond the panel)", fontsize=6.2, ha="center")
    count = max((len(row.get("on", {}).get("time_ms", ())) for row in (s for r in results["mechanisms"] for s in r["scenes"])), default=0)
    scene_count = len(results["scenes"])
    repeats = f"; in panel time, of scenes and up to {count} repeats" if count > 1 else ""
    handles = [Line2D([], [], linestyle="", marker="o", markersize=2.6, color=BLACK, label=f"geometric mean of {plural(scene_count, 'unlike scene')}"),
               Line2D([], [], linestyle="", marker="|", markersize=3.6, markeredgewidth=0.6, color=BLACK, label="one scene"),
               Line2D([], [], color=BLACK, linewidth=1.0, label=f"range of scenes{repeats}"),
               Line2D([], [], linestyle="", marker="D", markersize=2.4, color=GREY, markerfacecolor="white", label="a failure that it is a remedy for")]
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 1.0), ncol=1, fontsize=5.6, handletextpad=0.4, labelspacing=0.25)
    charts.save(figure, "mechanisms", "The gain of each mechanism",
                "Ratios with over without, by what a mechanism is meant to reduce, on a logarithmic axis; left of 1 is a gain. "
                "Discs are geometric means over scenes that differ much, ticks the scenes: "
                + ", ".join(scene.removeprefix("builtin:") for scene in results["scenes"])
                + ". Bars reach from the least to the greatest scene; of times, from the least to the greatest ratio of any two repeats.")


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
