# SPDX-License-Identifier: Apache-2.0
"""Draws the stability of errors from stability.json of `shadowdag study stability`: one chart per part of
the file, as SVG and PNG, with charts.json: titles and captions. Designed for both columns of a paper (17.8 cm).

    stability-charts report/stability.json -o docs
"""
from ..collection import Charts
from ..files import expecting, read_json
from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, log_axis, marks_of, plt

VOXELS = "dag believe all"
METHODS = {"maps": (ORANGE, "s"), VOXELS: (SKY, "D"), "dag believe none": (BLACK, "p"), "hybrid": (GREEN, "o")}
GROUPS = [(BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (PURPLE, "D"), (BLACK, "v"), (ORANGE, "P")]


PANELS = 3  # of groups, beside one another


def groups_of(rows):
    return list(dict.fromkeys(row["group"] for row in rows))


def marks_of_groups(groups):
    """Returns (group, colour, marker, line style) of each: the first six differ in colour and marker, more in their lines."""
    return [(group, *GROUPS[i % len(GROUPS)], ("-", "--", ":", "-.")[i // len(GROUPS) % 4]) for i, group in enumerate(groups)]


def panels_of(groups, height):
    """Returns a figure and a panel for each group, in rows that share their labels."""
    columns = min(PANELS, len(groups))
    lines = -(-len(groups) // columns)
    figure, panels = plt.subplots(lines, columns, figsize=(2 * COLUMN + 0.3, lines * height), sharey=True, squeeze=False)
    for axes in panels.flat[len(groups):]:
        axes.set_visible(False)
    return figure, list(panels.flat[:len(groups)])


def short(group):
    return group.split("-", 1)[-1]  # a user's study may have other names of groups


def verdict(results, part):
    """Returns a sentence about the number of passed checks of the part."""
    checks = [c for c in results["checks"] if c["part"] == part]
    broken = sum(not c["holds"] for c in checks)
    if not checks:
        return "No check was made."
    return f"{broken} of {len(checks)} checks do not hold." if broken else f"All {len(checks)} checks hold."


def draw_time(charts, results):
    rows = results["time"]
    groups = groups_of(rows)
    cases = list(dict.fromkeys((row["method"], row["case"]) for row in rows))
    figure, panels = panels_of(groups, 0.55 + 0.24 * len(cases))
    parts = [("held", "nothing switched", BLUE, ""), ("resolution_switch", "resolution switched", ORANGE, "////"),
             ("method_switch", "method switched", VERMILION, "....")]
    for axes, group in zip(panels, groups):
        for place, (method, case) in enumerate(cases):
            row = next(r for r in rows if r["group"] == group and (r["method"], r["case"]) == (method, case))
            left = 0.0
            for key, label, colour, hatch in parts:
                share = 1000 * row[key + "_flicker_count"] / max(1, row["answer_count"])
                axes.barh(place, share, left=left, height=0.66, color=colour, hatch=hatch, edgecolor="white",
                          linewidth=0.4, label=label if place == 0 and group == groups[0] else None)
                left += share
            axes.annotate(f"{left:.2g}" if left else "0", (left, place), xytext=(2, 0), textcoords="offset points",
                          va="center", fontsize=5.8)
        axes.set_title(f"{short(group)}: {row['kind']}", fontsize=7.5, loc="left")
        axes.set_xlabel("flickering (‰ of answers)")
        axes.grid(axis="y", visible=False)
        axes.margins(x=0.18)
    panels[0].set_yticks(range(len(cases)), [f"{m}, {c.replace('every frame for itself', 'nothing held')}"
                                                for m, c in cases])
    panels[0].invert_yaxis()
    panels[0].legend(loc="center right", bbox_to_anchor=(1.0, 0.57))  # where rays have no bars
    charts.save(figure, "stability_time", "Flicker in time",
                "Results that change from one frame to the next while Embree's do not, a tenth of a second between frames. "
                "Held results of a static light must not change at all. " + verdict(results, "time"), part="time")


def draw_perturbation(charts, results):
    rows = results["perturbation"]
    groups = groups_of(rows)
    marks = marks_of(METHODS, (r["method"] for r in rows), lambda name: (GREY, "X"))
    drawn = [m for m in marks if any(r["wrong_share"] for r in rows if r["method"] == m)]
    absent = [m for m in marks if m not in drawn]
    cases = [r["case"] for r in rows if r["group"] == groups[0] and r["method"] == "maps" and r["kind"] != "unperturbed"]
    bands = {(c["group"], c["case"], c["method"]): c for c in results["checks"]
             if c["part"] == "perturbation" and c["measure"] == "wrong_share"}
    figure, panels = panels_of(groups, 0.8 + 0.23 * len(cases))
    for axes, group in zip(panels, groups):
        low, high = 0.5, 2.0
        for index, name in enumerate(drawn):
            offset = 0.27 * (index - (len(drawn) - 1) / 2)
            colour, marker = marks[name]
            for place, case in enumerate(cases):
                row = next((r for r in rows if (r["group"], r["case"], r["method"]) == (group, case, name)), None)
                if row is None:
                    continue
                base = row["wrong_share_unperturbed"]
                if not base or not row["wrong_share"]:
                    continue
                ratio = row["wrong_share"] / base
                band = bands.get((group, case, name))
                if band:
                    axes.plot([max(band["low"] / base, 0.05), min(band["high"] / base, 20)], [place + offset] * 2,
                              color=colour, alpha=0.35, linewidth=2.4, solid_capstyle="butt")
                axes.plot(ratio, place + offset, marker=marker, color=colour, markeredgecolor=BLACK,
                          markeredgewidth=0.4, markersize=2.9, linestyle="none", label=name)
                low, high = min(low, 0.8 * ratio), max(high, 1.25 * ratio)
        axes.axvline(1, color=GREY, linewidth=0.7, zorder=0)
        log_axis(axes.xaxis, low, high)
        axes.set_title(short(group), fontsize=7.5, loc="left")
        axes.set_xlabel("wrong pairs / unperturbed")
    panels[0].set_yticks(range(len(cases)), cases)
    panels[0].invert_yaxis()
    entries = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels())}
    if entries:
        figure.suptitle(" ", fontsize=6)  # room for the legend
        bar = plt.Line2D([], [], color=GREY, alpha=0.5, linewidth=2.4)
        figure.legend([*entries.values(), bar], [*entries, "band of the check"], loc="upper right", ncol=len(entries) + 1)
    charts.save(figure, "stability_perturbation", "The error under perturbation",
                "Wrong pairs over those of the unperturbed scene, each compared with Embree for the same scene; bars: "
                "the band. " + (f"{' and '.join(absent)}: no wrong pair anywhere, so nothing is drawn. " if absent else "")
                + "A case without a wrong pair, moved or unmoved, has no mark. " + verdict(results, "perturbation"), part="perturbation")


def draw_numeric(charts, results):
    rows = [r for r in results["numeric"] if "curves" in r]
    if not rows:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 2.2))
    for (feature, look) in (("a face", (BLUE, "o", "-")), ("an edge", (ORANGE, "s", "--")), ("a corner", (VERMILION, "^", ":"))):
        totals = {}
        for row in rows:
            for point in row["curves"][feature.split()[1]]:
                rays, dark = totals.get(point["margins"], (0, 0))
                totals[point["margins"]] = (rays + point["ray_count"], dark + point["dark_count"])
        xs = sorted(totals)
        axes.plot(xs, [100 * totals[x][1] / max(1, totals[x][0]) for x in xs], color=look[0], marker=look[1], linestyle=look[2],
                  markersize=2.6, label=f"past {feature}")
    axes.axvline(2, color=GREY, linewidth=0.8)
    axes.annotate("beyond, none\nmay stop", (2, 60), xytext=(-3, 0), textcoords="offset points", fontsize=6.2, ha="right")
    axes.set_xlabel("distance from the voxel (2⁻²⁰ of the grid)")
    axes.set_ylabel("rays stopped (%)")
    axes.set_xlim(-0.05, 3.05)
    axes.set_ylim(-4, 104)
    axes.legend(loc="upper right")
    judged = sum(r["judged_count"] for r in rows)
    charts.save(figure, "stability_numeric", "Rays past a voxel, against integers",
                f"{judged} lines in all 26 directions, grids of 2^6 to 2^17. Touching lines must never be lost, lines "
                "farther than two margins must never be blocked, and every tracer must give the same bits. "
                + verdict(results, "numeric"), part="numeric")


def draw_resolution(charts, results):
    rows = results["resolution"]
    groups = groups_of(rows)
    below = len(groups) > len(GROUPS)  # more would cover the curves
    figure, panels = plt.subplots(1, 2, figsize=(2 * COLUMN + 0.3, 2.9 + 0.14 * below * len(groups)), sharey=True)
    shares = [100 * r["wrong_share"] for r in rows if r["wrong_share"] > 0] or [1.0]  # no wrong pair: empty panels
    low, high = 0.7 * min(shares), 1.6 * max(shares)
    for axes, method in zip(panels, (VOXELS, "maps")):
        for group, colour, marker, line in marks_of_groups(groups):
            members = [r for r in rows if r["group"] == group and r["method"] == method and r["wrong_share"] > 0]
            rate = next((r for r in results["rates"]
                         if (r["group"], r["method"], r["case"]) == (group, method, "wrong_share")), None)
            xs = [r["resolution"] if method == VOXELS else 1 / r["undersample"] for r in members]
            axes.plot(xs, [100 * r["wrong_share"] for r in members], color=colour, marker=marker, markersize=3,
                      linestyle=line, markerfacecolor="white", markeredgewidth=0.8,
                      label=f"{short(group)}: " + (f"{rate['slope']:.2f} ± {rate['standard_error']:.2f}" if rate else "none"))
        left, right = (56, 4700) if method == VOXELS else (0.22, 4.6)
        for start in (high * 2, high / 4, high / 32):
            axes.plot([left, right], [start, start * left / right], color=GREY, linewidth=0.5, linestyle=":", zorder=0)
        log_axis(axes.xaxis, left, right)
        ticks = [64, 128, 256, 512, 1024, 2048, 4096] if method == VOXELS else [0.25, 0.5, 1, 2, 4]
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.set_xlabel("voxels an axis" if method == VOXELS else "texels a pixel and axis (1 / undersample)")
        place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.22)} if below else {"loc": "lower left"}
        axes.legend(title=f"{'voxel rays' if method == VOXELS else 'maps'}: rate of wrong pairs", title_fontsize=6.4, handlelength=2.2, **place)
    log_axis(panels[0].yaxis, low / 6, high)
    panels[0].set_ylabel("wrong pairs (%)")
    charts.save(figure, "stability_resolution", "The error over resolution",
                "Share of wrong pairs against voxel depth and texel density, with the fitted rate at which it falls and its "
                "standard error; the checks are of rates of the mean error. Dotted: rate 1. " + verdict(results, "resolution"), part="resolution")


DRAWN = {"time": draw_time, "perturbation": draw_perturbation, "numeric": draw_numeric, "resolution": draw_resolution}


def draw(path, directory):
    """Draws a chart of every part of the file."""
    with expecting(path, "a result of study stability"):
        results = read_json(path)
        parts = {part: results[part] for part in DRAWN}
        results["checks"], results["rates"]
    charts = Charts(directory)
    for part, rows in parts.items():
        if rows:
            DRAWN[part](charts, results)
    charts.finish()


def declare(parser):
    parser.add_argument("results", help="stability.json")
    parser.add_argument("-o", "--output", required=True, help="directory of the charts")


def run(arguments):
    draw(arguments.results, arguments.output)
