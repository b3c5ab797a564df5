# SPDX-License-Identifier: Apache-2.0
"""Time and error over the threshold in texels that separates rays from maps."""
import math

from ..intervals import confidence_text, least_confidence
from ..series import model_of, series_name, settings_of, sweeps, threshold_of
from ..style import BLACK, BLUE, COLUMN, GREY, SKY, VERMILION, labels_that_fit, plain, plt, slug
from ..texels import PAPER_TEXELS, equivalent_texels


def threshold_positions(thresholds):
    """Geometric positions of thresholds; 0 is a step left of the least, infinity a step right of the greatest."""
    finite = sorted(t for t in thresholds if 0 < t < math.inf)
    low = math.log2(finite[0]) if finite else 0
    high = math.log2(finite[-1]) if finite else 0
    return lambda t: low - 1 if t == 0 else high + 1 if t == math.inf else math.log2(t)


def threshold_ticks(axes, thresholds, place):
    axes.set_xticks([place(t) for t in thresholds])
    names = ["0\nmaps" if t == 0 else "∞\nrays" if t == math.inf else plain(t) for t in thresholds]
    axes.set_xticklabels(names)
    fits = labels_that_fit(axes)
    axes.set_xticklabels([name if i in fits else "" for i, name in enumerate(names)])
    finite = [t for t in thresholds if 0 < t < math.inf]
    for left, right in ((0, finite[0]), (finite[-1], math.inf)) if finite else ():
        if left in thresholds and right in thresholds:  # the axis is broken between the ends and the rest
            middle = (place(left) + place(right)) / 2
            axes.plot(middle, 0, transform=axes.get_xaxis_transform(), clip_on=False, marker=[(-1, -2), (1, 2)],
                      color="black", markersize=5, linestyle="none", mew=0.8, zorder=9)


def lines_sentence(inside, equivalent, finite):
    """Describes the vertical lines: only those within the sweep are drawn."""
    if PAPER_TEXELS in inside and equivalent in inside and equivalent != PAPER_TEXELS:
        return (f" Lines stand at the paper's {PAPER_TEXELS} texels and at its equivalent for this picture size, "
                f"{equivalent:.0f}.")
    if PAPER_TEXELS in inside:
        return f" The line marks the paper's {PAPER_TEXELS} texels." + (
            "" if equivalent == PAPER_TEXELS else
            f" Its equivalent for this picture size, {equivalent:.0f}, is not between {plain(finite[0])} and "
            f"{plain(finite[-1])}, the least and the largest threshold that divides the maps.")
    if equivalent in inside:
        return (f" The line marks {equivalent:.0f} texels, the equivalent of the paper's {PAPER_TEXELS} for this "
                "picture size.")
    return ""


def over_threshold(charts, scene, runs, experiment):
    for number, (key, members) in enumerate(sweeps(runs).items()):
        thresholds = [threshold_of(r) for r in members]
        if len(thresholds) < 3:
            continue
        place = threshold_positions(thresholds)
        xs = [place(t) for t in thresholds]
        figure, (above, below) = plt.subplots(2, 1, figsize=(COLUMN, 3.1), sharex=True)
        above.fill_between(xs, [r["time_ms_low"] for r in members], [r["time_ms_high"] for r in members], color=BLUE,
                           alpha=0.15, linewidth=0, label=f"{confidence_text(least_confidence(members))} interval")
        above.plot(xs, [r["time_ms"] for r in members], color=BLUE, marker="o", label="median")
        for run in (r for r in runs if r["method"] == "hybrid" and r["model"] == "oracle" and settings_of(r) == dict(key)):
            above.axhline(run["time_ms"], color=VERMILION, linestyle="--", linewidth=0.9, label=model_of(run))
        above.set_ylim(0, max(r["time_ms_high"] for r in members) * 1.12)
        above.set_ylabel("frame time (ms)")
        above.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=3, borderaxespad=0.2)
        below.plot(xs, [r["false_shadow"] for r in members], color=VERMILION, marker="s", label="false shadow")
        below.plot(xs, [r["false_light"] for r in members], color=SKY, marker="^", label="false light")
        below.plot(xs, [100 * r["error"] for r in members], color=BLACK, marker="o", linestyle="--", markersize=2.8,
                   label="mean |error|")
        below.set_ylim(bottom=0)
        below.set_ylabel("share of pairs (%)")
        below.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=3, borderaxespad=0.2)
        equivalent = equivalent_texels(experiment)
        finite = [t for t in thresholds if 0 < t < math.inf]
        inside = [(t, style) for t, style in ((PAPER_TEXELS, "-"), (equivalent, "--"))
                  if finite and finite[0] * 0.99 <= t <= finite[-1] * 1.01]
        for axes in (above, below):
            for texels, style in inside:
                axes.axvline(place(texels), color=GREY, linewidth=0.8, linestyle=style, zorder=1)
            axes.grid(axis="x", visible=False)
        top = above.get_ylim()[1]
        for texels, _ in inside:
            above.annotate(f"{texels:.0f}", (place(texels), top), xytext=(1.5, -1), textcoords="offset points",
                           va="top", fontsize=5.8, color="#5b6570")
        threshold_ticks(below, thresholds, place)
        below.set_xlabel("threshold (texels): maps that require fewer are traced")
        best = min(members, key=lambda r: r["time_ms"])
        name = series_name(key, list(sweeps(runs)))
        charts.save(figure, f"threshold_{slug(scene)}" + (f"_{number}" if number else ""),
                    f"Time and error over the threshold, {scene}" + (f", {name}" if name else ""),
                    f"0 draws every map and ∞ traces every light; the least time of the sweep is {best['time_ms']:.1f} ms "
                    f"at {plain(threshold_of(best)) if threshold_of(best) < math.inf else '∞'} texels."
                    + lines_sentence([t for t, _ in inside], equivalent, finite))
