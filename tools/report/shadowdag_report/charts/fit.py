# SPDX-License-Identifier: Apache-2.0
"""Draws the measurements of `shadowdag fit`: error against time or bytes, the bound, and the choice, as SVG and PNG.

Every measured model is a point: filled if it keeps the bound, hollow if it breaks it. Times are those of
the first frame, which every measured model has; errors are the worst of the frames in which it was measured. Exact
models are on the lowest line, marked 0.
"""
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from ..collection import save_figure
from ..style import BLACK, BLUE, COLUMN, GREY, PURPLE, VERMILION, FuncFormatter, NullLocator, marks_of, plain, plt

METHODS = {"dag": (BLUE, "o", "rays"),
           "maps": (VERMILION, "^", "maps"), "hybrid": (PURPLE, "D", "hybrid")}
METRICS = {"false": "wrong pairs, worst frame (%)", "visibility": "visibility error, worst frame",
           "flip": "FLIP, worst frame"}


def frontier(points):
    """Returns the points that no other dominates in cost and error, by cost."""
    best, kept = None, []
    for point in sorted(points):
        if best is None or point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


def draw(result, base):
    percent = 100 if result["metric"] == "false" else 1
    if result["minimise"] == "bytes":
        cost_of, unit = (lambda m: m["bytes"] / 2**20), "shadow data, peak (MiB)"
    else:
        cost_of, unit = (lambda m: m["first_frame_time_ms"]), "time of the first frame (ms)"
    measured = [m for m in result["models"] if "error" in m]
    bound = percent * result["bound"]
    positive = [percent * m["error"] for m in measured if m["error"] > 0] + ([bound] if bound > 0 else [])
    # A logarithmic axis has no zero: it gets a separate line, a third of a decade under the rest.
    has_zero = bound == 0 or any(m["error"] == 0 for m in measured)
    floor = min(positive, default=1.0) / (2.2 if has_zero else 1.0)
    height_of = lambda error: percent * error if error > 0 else floor

    figure, axes = plt.subplots(figsize=(COLUMN, 2.7))
    points = [(cost_of(m), height_of(m["error"])) for m in measured]
    steps = frontier(points)
    axes.step([p[0] for p in steps], [p[1] for p in steps], where="post", color=GREY, linewidth=0.8, zorder=1)
    handles = [Line2D([], [], color=GREY, linewidth=0.8, label="frontier")]
    marks = marks_of(METHODS, (m["method"] for m in measured), lambda name: (BLACK, "X", name))
    for method, (color, marker, name) in marks.items():
        mine = [(m, p) for m, p in zip(measured, points) if m["method"] == method]
        if not mine:
            continue
        for holds in (False, True):
            some = [p for m, p in mine if (m["error"] <= result["bound"]) == holds]
            axes.plot([p[0] for p in some], [p[1] for p in some], linestyle="", marker=marker, markersize=3.4,
                      color=color, markerfacecolor=color if holds else "white", markeredgewidth=0.7,
                      zorder=2.0 if method == "hybrid" else 2.5)  # a hybrid that draws no map equals dag and is drawn below it
        handles.append(Line2D([], [], linestyle="", marker=marker, markersize=3.4, color=color, label=name))
    axes.axhline(height_of(result["bound"]), color="black", linewidth=0.8, linestyle=(0, (4, 2)), zorder=1)
    handles.append(Line2D([], [], color="black", linewidth=0.8, linestyle=(0, (4, 2)), label=f"bound, {plain(bound)}" + (" %" if percent == 100 else "")))
    handles.append(Line2D([], [], linestyle="", marker="o", markersize=3.4, color="#444444", markerfacecolor="white",
                          label="hollow: breaks the bound"))
    chosen = result["chosen"]
    if chosen is not None:
        at = (cost_of(chosen), height_of(chosen["error"]))
        axes.plot(*at, linestyle="", marker="o", markersize=9, markerfacecolor="none", markeredgecolor="black",
                  markeredgewidth=1.0, zorder=3)
        handles.append(Line2D([], [], linestyle="", marker="o", markersize=7, markerfacecolor="none", color="black",
                              label="chosen: " + chosen["label"].replace("^3", "³")))
    axes.set_xscale("log")
    axes.set_yscale("log")
    costs = [p[0] for p in points]
    axes.set_xlim(min(costs) / 1.15, max(costs) * 1.15)
    top = max([p[1] for p in points] + [bound])
    axes.set_ylim(floor / 1.3, top * 1.3)
    for axis, low, high in ((axes.xaxis, *axes.get_xlim()), (axes.yaxis, *axes.get_ylim())):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high / low < 300 else (1,)))
        axis.set_major_formatter(FuncFormatter(plain))
        axis.set_minor_formatter(NullFormatter())
    if has_zero:
        ticks = [t for t in axes.get_yticks() if floor * 1.4 < t <= top * 1.3]
        axes.set_yticks([floor] + ticks, ["0"] + [plain(t) for t in ticks], minor=False)
        axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(unit)
    axes.set_ylabel(METRICS[result["metric"]])
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.45, -0.16), ncol=3, columnspacing=1.0,
                handletextpad=0.5)
    save_figure(figure, base)
