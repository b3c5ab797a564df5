#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the charts of a compare from results.json files, as SVG and PNG, with charts.json: titles and captions.

    charts.py RESULTS.json... -o DIR [--mixed-commits]

Lines of different commits are refused unless --mixed-commits is given. Colours are Okabe and Ito's; markers tell the
series apart without them. Width is a paper's column, 3.3 inches; text in SVG is outlines, so no font is needed.
"""
import argparse
import contextlib
import json
import math
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7")
GREY = "#8a9099"
COLUMN = 3.3  # inches
PAPER_TEXELS = 96
PAPER_PIXELS = 1920 * 1080

plt.rcParams.update({
    "font.family": "DejaVu Sans", "font.size": 7, "axes.labelsize": 7.5, "axes.titlesize": 8,
    "xtick.labelsize": 6.5, "ytick.labelsize": 6.5, "legend.fontsize": 6.2, "axes.linewidth": 0.6,
    "lines.linewidth": 1.0, "lines.markersize": 3.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4, "ytick.minor.width": 0.4, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "grid.color": "#e3e6ea", "grid.linewidth": 0.5, "axes.axisbelow": True,
    "legend.frameon": False, "legend.handlelength": 1.8, "svg.fonttype": "path", "pdf.fonttype": 42,
    "svg.hashsalt": "shadowdag", "figure.constrained_layout.use": True, "savefig.dpi": 300,
})


@contextlib.contextmanager
def written(path):
    """Gives the name of a file beside `path` to write; puts it in the place of `path`, or removes it after any error.
    What the system refuses is raised as OSError that names `path`."""
    part = path + ".part"
    try:
        yield part
        os.replace(part, path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            os.remove(part)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), path) from error
        raise


class Charts:
    """Collects the figures: each is saved as SVG and PNG and listed with its caption."""

    def __init__(self, directory):
        self.directory = directory
        self.entries = []
        os.makedirs(directory, exist_ok=True)

    def save(self, figure, name, title, caption):
        for kind in ("svg", "png"):
            with written(os.path.join(self.directory, f"{name}.{kind}")) as part:
                figure.savefig(part, format=kind, metadata={"Date": None} if kind == "svg" else {})
        plt.close(figure)
        self.entries.append({"file": name, "title": title, "caption": caption})

    def finish(self, more=None):
        """more: further keys of charts.json"""
        with written(os.path.join(self.directory, "charts.json")) as part, open(part, "w") as file:
            json.dump({"charts": self.entries} | (more or {}), file, indent=2)


def fail(message):
    sys.exit(f"charts.py: {message}")


def load(paths, mixed):
    """Returns runs, map costs and the experiment of the first file, after checking that all are of one commit."""
    runs, costs, experiments, commits = [], [], [], {}
    for path in paths:
        try:
            with open(path) as file:
                results = json.load(file)
            commits.setdefault(results["provenance"]["commit"], path)
            runs += results["runs"]
            costs += results.get("map_costs", [])
            experiments.append(results["experiment"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            fail(f"{path}: not a results file of compare: {error!r}")
    if len(commits) > 1 and not mixed:
        fail("refused: lines of different commits: "
             + ", ".join(f"{commit} in {path}" for commit, path in commits.items())
             + "; measure again with one program, or pass --mixed-commits")
    if not runs:
        fail("no runs to draw")
    return runs, costs, experiments[0]


def slug(name):
    return "".join(c if c.isalnum() else "_" for c in name)


def plain(value, _=None):
    """1000 as 1000, 0.05 as 0.05: no powers where plain digits are read faster."""
    if value == 0:
        return "0"
    if value >= 10000:
        return f"{value:,.0f}".replace(",", "\u2009")
    return f"{value:.0f}" if value >= 10 and value == round(value) or value >= 100 else f"{value:.3g}"


def threshold_of(run):
    value = run["parameters"].get("threshold_texels")
    return None if value is None else math.inf if value == "inf" else float(value)


def over_frames(runs):
    """Merges the frames of one scene: mean time, errors over all pairs, spread as mean of minima and maxima."""
    merged = {}
    for run in runs:
        merged.setdefault(run["label"], []).append(run)
    result = []
    for group in merged.values():
        one = dict(group[0])
        one["frame_count"] = len(group)
        for key in ("time_ms", "time_ms_min", "time_ms_max", "dag_bytes", "map_bytes"):
            one[key] = sum(r[key] for r in group) / len(group)
        pairs = sum(r["pair_count"] for r in group) or 1
        one["error"] = sum(r["mean_abs_visibility_error"] * r["pair_count"] for r in group) / pairs
        one["false_shadow"] = 100 * sum(r["false_shadow_count"] for r in group) / pairs
        one["false_light"] = 100 * sum(r["false_light_count"] for r in group) / pairs
        stages = {}
        for r in group:
            for name, value in r["stages_ms"].items():
                stages[name] = stages.get(name, 0) + value / len(group)
        one["stages"] = stages
        histograms = [r["visibility_histogram"] for r in group if r.get("visibility_histogram")]
        one["histogram"] = np.sum(histograms, axis=0) if histograms else None
        result.append(one)
    return result


def sweeps(runs):
    """Returns the threshold sweeps: {series key: runs ascending in threshold}, the pure methods included."""
    hybrids = [r for r in runs if r["method"] == "hybrid" and threshold_of(r) is not None]
    ray_keys, map_keys = ("resolution", "offset", "lod"), ("undersample", "page_size", "bias", "taps")
    pick = lambda run, keys: tuple((k, run["parameters"].get(k)) for k in keys)
    series = {}
    for run in hybrids:
        series.setdefault(pick(run, ray_keys + map_keys), []).append(run)
    for key, members in series.items():
        rays, maps = key[:len(ray_keys)], key[len(ray_keys):]
        members += [r for r in runs if r["method"] == "dag" and pick(r, ray_keys) == rays]
        members += [r for r in runs if r["method"] == "maps" and pick(r, map_keys) == maps]
        members.sort(key=threshold_of)
    return series


def series_name(key, all_keys):
    """Names what distinguishes a series from the others; "" where nothing does."""
    names = {"resolution": "{}³", "offset": "offset {}", "lod": "lod {}", "undersample": "u{}",
             "page_size": "pages {}", "bias": "bias {}", "taps": "{} taps"}
    return ", ".join(names[k].format(v) for i, (k, v) in enumerate(key) if len({other[i] for other in all_keys}) > 1)


def equivalent_texels(experiment):
    width, height = (int(part) for part in experiment["size"].split("x"))
    return PAPER_TEXELS * math.sqrt(width * height / PAPER_PIXELS)


def log_axis(axis, low, high, ticks=(1, 2, 5)):
    """A logarithmic axis with plain numbers at 1, 2, 5 (fewer when it spans many decades)."""
    axis.axes.set_xscale("log") if axis.axis_name == "x" else axis.axes.set_yscale("log")
    decades = math.log10(high / low)
    ticks = (1,) if decades > 3 else (1, 3) if decades > 2 else ticks
    if decades < 1.3:
        ticks = (1, 1.5, 2, 3, 4, 5, 7) if decades > 0.6 else (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9)
    places = [m * 10.0 ** e for e in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1) for m in ticks]
    axis.set_major_locator(FixedLocator([p for p in places if low <= p <= high]))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(plain))
    (axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim)(low, high)


def place_labels(axes, labels, points):
    """Writes labels beside their points so that none covers another or a point, as far as there is room.

    labels: [(x, y, text, style of annotate)]; points: all that is drawn as a mark.
    """
    canvas = axes.figure.canvas
    canvas.draw()  # only now does constrained layout stand
    renderer = canvas.get_renderer()
    marks = axes.transData.transform(points) if points else np.zeros((0, 2))
    scale = axes.figure.dpi / 72
    taken = []
    offsets = [(5, 1, "left"), (-5, 1, "right"), (0, 5, "center"), (0, -9, "center"), (6, 7, "left"), (-6, 7, "right"),
               (6, -9, "left"), (-6, -9, "right"), (0, 13, "center"), (0, -17, "center"), (14, 12, "left"),
               (-14, 12, "right"), (14, -15, "left"), (-14, -15, "right")]
    for x, y, text, look in labels:
        best = None
        for rank, (dx, dy, side) in enumerate(offsets):
            label = axes.annotate(text, (x, y), xytext=(dx, dy), textcoords="offset points", ha=side, zorder=7, **look)
            box = label.get_window_extent(renderer)
            covered = sum(box.overlaps(other) for other in taken)
            near = sum(box.x0 - scale < mx < box.x1 + scale and box.y0 - scale < my < box.y1 + scale for mx, my in marks)
            inside = axes.get_window_extent(renderer)
            outside = box.x0 < inside.x0 or box.x1 > inside.x1 or box.y0 < inside.y0 or box.y1 > inside.y1
            cost = (4 * covered + 2 * outside + near, rank)
            if best is None or cost < best[0]:
                if best is not None:
                    best[1].remove()
                best = (cost, label, box)
            else:
                label.remove()
        taken.append(best[2])


def pareto(points):
    """Returns the points (time, error) that no other beats in both, ascending in time."""
    front, best = [], math.inf
    for time, error in sorted(points):
        if error < best:
            front.append((time, error))
            best = error
    return front


def rings_sentence(ringed, experiment):
    """Says what the rings mark, and which of the paper's threshold and its equivalent has no run to put one on."""
    equivalent = equivalent_texels(experiment)

    def name(texels, near):
        text = (f"the paper's {PAPER_TEXELS} texels" if texels == PAPER_TEXELS else
                f"{equivalent:.0f} texels, the equivalent at {experiment['size']} of the paper's {PAPER_TEXELS}")
        return text + ("" if abs(near - texels) < 0.5 else f" (nearest run: {plain(near)})")

    if not ringed:
        return ""
    sentence = (" Rings mark " if len(ringed) > 1 else " The ring marks ") + " and ".join(name(*r) for r in ringed) + "."
    absent = {PAPER_TEXELS, equivalent} - {texels for texels, _ in ringed}
    return sentence + "".join(f" {texels:.0f} texels have no run of their own." for texels in absent)


def speed_accuracy(charts, scene, runs, experiment):
    methods = [r for r in runs if r["method"] != "embree"]
    if not methods:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 3.0))
    positive = [r["error"] for r in methods if r["error"] > 0]
    floor = (min(positive) if positive else 1e-4) / 4
    height = lambda run: 100 * max(run["error"], floor)
    series = sweeps(runs)
    styles = [(BLUE, "o"), (GREEN, "s"), (PURPLE, "^"), (VERMILION, "v"), (BLACK, "P"), (ORANGE, "X")]
    front = pareto([(r["time_ms"], height(r)) for r in methods])
    if len(front) > 1:
        xs, ys = zip(*front)
        axes.step(xs, ys, where="post", color=GREY, linewidth=3.2, alpha=0.35, solid_capstyle="butt", zorder=1,
                  label="Pareto front")
    times, errors = [r["time_ms"] for r in methods], [height(r) for r in methods]
    names = []  # labels of points: placed when all points stand
    for i, (key, members) in enumerate(series.items()):
        color, marker = styles[i % len(styles)]
        name = series_name(key, list(series))
        axes.plot([r["time_ms"] for r in members], [height(r) for r in members], color=color, marker=marker,
                  markersize=3, linewidth=0.8, zorder=3, label="hybrid, thresholds" + (f" ({name})" if name else ""))
    resolutions = [r for r in runs if r["method"] == "dag"]
    resolutions = [r for r in resolutions if r["parameters"].get("lod") == resolutions[0]["parameters"].get("lod")]
    resolutions.sort(key=lambda r: r["parameters"]["resolution"])
    if resolutions:
        axes.plot([r["time_ms"] for r in resolutions], [height(r) for r in resolutions], color=SKY, marker="D",
                  markersize=4.6, linewidth=0.8, linestyle="--", zorder=4, markeredgecolor="black",
                  markeredgewidth=0.4, label="rays alone (DAG)")
        for run in resolutions if len(resolutions) > 1 else []:
            names.append((run["time_ms"], height(run), f"{run['parameters']['resolution']}³",
                          {"fontsize": 5.6, "color": "#2b6f96"}))
    exact = sorted((r for r in runs if r["method"] == "dag-exact"), key=lambda r: r["parameters"]["resolution"])
    if exact:
        axes.plot([r["time_ms"] for r in exact], [height(r) for r in exact], color=YELLOW, marker="p", markersize=5.6,
                  linewidth=0.8, linestyle=":", zorder=4, markeredgecolor="black", markeredgewidth=0.5,
                  clip_on=False, label="DAG exact (error 0)" if not any(r["error"] for r in exact) else "DAG exact")
    maps = sorted((r for r in runs if r["method"] == "maps"), key=lambda r: r["parameters"]["undersample"])
    if maps:
        axes.plot([r["time_ms"] for r in maps], [height(r) for r in maps], color=ORANGE, marker="s", markersize=4.6,
                  linewidth=0.8, linestyle="--", zorder=4, markeredgecolor="black", markeredgewidth=0.4,
                  label="maps alone")
        for run in maps if len({r["parameters"]["undersample"] for r in maps}) > 1 else []:
            names.append((run["time_ms"], height(run), f"u{run['parameters']['undersample']:g}",
                          {"fontsize": 5.6, "color": "#8a5f00"}))
    others = [r for r in runs if r["method"] == "hybrid" and threshold_of(r) is None]
    for i, run in enumerate(others):
        axes.plot(run["time_ms"], height(run), linestyle="none", marker="*PXdh"[i % 5], color=VERMILION,
                  markersize=7 if i == 0 else 5, markeredgecolor="black", markeredgewidth=0.4, zorder=5,
                  label=f"hybrid, {run['model'] if len(run['model']) < 22 else run['model'][:20] + '…'}")
    equivalent = equivalent_texels(experiment)
    marked, ringed, labels = [], [], []
    if series:
        members = next(iter(series.values()))
        for texels, text in ((PAPER_TEXELS, "96 (paper)"), (equivalent, f"{equivalent:.0f} (96 at 1080p)")):
            nearest = min((r for r in members if 0 < threshold_of(r) < math.inf),
                          key=lambda r: abs(math.log(threshold_of(r) / texels)), default=None)
            if nearest is None or abs(math.log2(threshold_of(nearest) / texels)) > 0.25 or nearest in marked:
                continue
            marked.append(nearest)
            ringed.append((texels, threshold_of(nearest)))
            axes.plot(nearest["time_ms"], height(nearest), marker="o", markersize=8, markerfacecolor="none",
                      markeredgecolor="black", markeredgewidth=0.8, linestyle="none", zorder=6)
            labels.append((nearest["time_ms"], height(nearest), text))
        names = [(x, y, text, {"fontsize": 6}) for x, y, text in sorted(labels)] + names
    truth = next((r for r in runs if r["method"] == "embree"), None)
    if truth:
        times = times + [truth["time_ms"]]
        axes.axvline(truth["time_ms"], color=BLACK, linestyle=":", linewidth=0.9, label="Embree's rays alone (error 0)")
    log_axis(axes.xaxis, min(times) / 1.35, max(times) * 1.35)
    hasZero = any(r["error"] == 0 for r in methods)
    log_axis(axes.yaxis, min(errors) if hasZero else min(errors) / 1.6, max(errors) * 1.6)
    if hasZero:  # zero has no place on a logarithmic axis: its points stand on the frame
        axes.annotate("0", (0, 0), xycoords="axes fraction", xytext=(-4, 0), textcoords="offset points", ha="right",
                      va="center", fontsize=6.5)
    axes.set_xlabel("frame time (ms)")
    axes.set_ylabel("mean absolute visibility error (%)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=2, columnspacing=1.2, borderaxespad=0.3)
    place_labels(axes, names, [(r["time_ms"], height(r)) for r in methods])
    best = min(methods, key=lambda r: r["time_ms"])
    exact = min(methods, key=lambda r: r["error"])
    charts.save(figure, f"speed_accuracy_{slug(scene)}", f"Speed against accuracy, {scene}",
                f"Down and left is better; the fastest is {best['label']} ({best['time_ms']:.1f} ms at "
                f"{100 * best['error']:.2f} % error), the most exact {exact['label']} ({exact['time_ms']:.1f} ms at "
                f"{100 * exact['error']:.2f} %)."
                + rings_sentence(ringed, experiment))


def threshold_positions(thresholds):
    """Geometric places for thresholds; 0 stands a step left of the least, infinity a step right of the greatest."""
    finite = sorted(t for t in thresholds if 0 < t < math.inf)
    low = math.log2(finite[0]) if finite else 0
    high = math.log2(finite[-1]) if finite else 0
    return lambda t: low - 1 if t == 0 else high + 1 if t == math.inf else math.log2(t)


def threshold_ticks(axes, thresholds, place):
    axes.set_xticks([place(t) for t in thresholds])
    axes.set_xticklabels(["0\nmaps" if t == 0 else "∞\nrays" if t == math.inf else plain(t) for t in thresholds])
    finite = [t for t in thresholds if 0 < t < math.inf]
    for left, right in ((0, finite[0]), (finite[-1], math.inf)) if finite else ():
        if left in thresholds and right in thresholds:  # the axis is broken between the ends and the rest
            middle = (place(left) + place(right)) / 2
            axes.plot(middle, 0, transform=axes.get_xaxis_transform(), clip_on=False, marker=[(-1, -2), (1, 2)],
                      color="black", markersize=5, linestyle="none", mew=0.8, zorder=9)


def lines_sentence(inside, equivalent):
    """Says where the upright lines stand: only those that the sweep reaches are drawn."""
    if PAPER_TEXELS in inside and equivalent in inside and equivalent != PAPER_TEXELS:
        return (f" Lines stand at the paper's {PAPER_TEXELS} texels and at its equivalent for this picture size, "
                f"{equivalent:.0f}.")
    if PAPER_TEXELS in inside:
        return f" The line stands at the paper's {PAPER_TEXELS} texels." + (
            "" if equivalent == PAPER_TEXELS else
            f" Its equivalent for this picture size, {equivalent:.0f}, is outside the sweep.")
    if equivalent in inside:
        return (f" The line stands at {equivalent:.0f} texels, the equivalent of the paper's {PAPER_TEXELS} for this "
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
        above.fill_between(xs, [r["time_ms_min"] for r in members], [r["time_ms_max"] for r in members], color=BLUE,
                           alpha=0.15, linewidth=0, label="min to max")
        above.plot(xs, [r["time_ms"] for r in members], color=BLUE, marker="o", label="median")
        for run in (r for r in runs if r["method"] == "hybrid" and r["model"] == "oracle"):
            above.axhline(run["time_ms"], color=VERMILION, linestyle="--", linewidth=0.9, label="oracle")
        above.set_ylim(0, max(r["time_ms_max"] for r in members) * 1.12)
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
                    + lines_sentence([t for t, _ in inside], equivalent))


def power_fit(xs, ys):
    """Least squares of log y = a + b log x; returns (a, b)."""
    slope, offset = np.polyfit(np.log(xs), np.log(ys), 1)
    return offset, slope


def crossing(xs, rays, maps):
    """Returns where the fits cross, and its 95 % interval by 1000 seeded bootstraps over the maps; None without one."""
    def solve(indices):
        if len(set(xs[indices])) < 2:
            return math.nan
        (a, b), (c, d) = power_fit(xs[indices], rays[indices]), power_fit(xs[indices], maps[indices])
        return math.exp((c - a) / (b - d)) if abs(b - d) > 1e-9 and abs((c - a) / (b - d)) < 50 else math.nan
    everything = np.arange(len(xs))
    value = solve(everything)
    generator = np.random.default_rng(1)
    tries = np.array([solve(generator.choice(everything, len(xs))) for _ in range(1000)])
    good = tries[np.isfinite(tries)]
    if not math.isfinite(value) or len(good) < 950:
        return None
    least, greatest = float(np.percentile(good, 2.5)), float(np.percentile(good, 97.5))
    return (value, least, greatest) if greatest <= 100 * least else None  # two decades pin nothing down


def per_map(charts, scene, costs, key, axis_name, file_name, title, experiment):
    usable = [c for c in costs if c["rays_ms"] > 0 and c["map_ms"] > 0 and c[key] > 0]
    if len(usable) < 5 or len({c[key] for c in usable}) < 3:
        return
    xs = np.array([c[key] for c in usable], float)
    rays = np.array([c["rays_ms"] for c in usable])
    maps = np.array([c["map_ms"] for c in usable])
    figure, axes = plt.subplots(figsize=(COLUMN, 2.5))
    axes.scatter(xs, rays, s=9, marker="o", facecolors="none", edgecolors=BLUE, linewidths=0.7, label="by rays")
    axes.scatter(xs, maps, s=9, marker="s", color=ORANGE, linewidths=0, alpha=0.8, label="by map")
    low, high = xs.min() / 1.3, xs.max() * 1.3
    line = np.geomspace(low, high, 50)
    slopes = []
    for ys, color, style in ((rays, BLUE, "-"), (maps, "#a06c00", "--")):
        offset, slope = power_fit(xs, ys)
        slopes.append(slope)
        axes.plot(line, np.exp(offset + slope * np.log(line)), color=color, linestyle=style, linewidth=1.1,
                  label=f"fit, power {slope:.2f}")
    found = crossing(xs, rays, maps)
    unit = " texels" if key == "texels" else " samples"
    if found and low <= found[0] <= high:
        axes.axvline(found[0], color=BLACK, linewidth=0.8, linestyle=":")
        axes.axvspan(max(found[1], low), min(found[2], high), color=GREY, alpha=0.18, linewidth=0)
        left = found[0] > math.sqrt(low * high)
        axes.annotate(f"{found[0]:,.0f}", (found[0], 1), xycoords=("data", "axes fraction"),
                      xytext=(-2 if left else 2, -2), textcoords="offset points", va="top",
                      ha="right" if left else "left", fontsize=6)
    if found:
        inside = "" if low <= found[0] <= high else ", outside what was measured"
        where = (f"the fitted lines cross at {found[0]:,.0f}{unit} (95 % interval {found[1]:,.0f} to "
                 f"{found[2]:,.0f}){inside}")
    else:
        where = "the fitted lines have no crossing that the data pin down"
    both = np.concatenate((rays, maps))
    log_axis(axes.xaxis, low, high)
    log_axis(axes.yaxis, both.min() / 1.5, both.max() * 1.5)
    axes.set_xlabel(axis_name)
    axes.set_ylabel("time of a map (ms)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=2, borderaxespad=0.3)
    cheaper = int(np.sum(rays < maps))
    charts.save(figure, f"{file_name}_{slug(scene)}", f"{title}, {scene}",
                f"Each of {len(usable)} maps served alone by both methods: rays are cheaper for {cheaper}, and {where}. "
                f"Time grows with power {slopes[0]:.2f} by rays and {slopes[1]:.2f} by map (least squares of logarithms).")


def bar_runs(runs):
    """The configurations worth a bar: the first sweep, other models, and the pure methods, in that order."""
    series = sweeps(runs)
    members = list(next(iter(series.values()))) if series else [r for r in runs if r["method"] in ("maps", "dag")]
    if not series:  # of several levels of detail the first: a bar's label names none
        members = [r for r in members if r["method"] != "dag" or
                   r["parameters"].get("lod", 0) == next(m for m in members if m["method"] == "dag")["parameters"].get("lod", 0)]
    members += [r for r in runs if r["method"] == "hybrid" and threshold_of(r) is None]
    return members


def bar_label(run):
    threshold = threshold_of(run)
    if threshold == 0:
        return "maps"
    if threshold == math.inf:
        return "rays"
    if threshold is None:
        return run["model"] if len(run["model"]) < 10 else run["model"][:8] + "…"
    return plain(threshold)


def bytes_chart(charts, scene, runs):
    members = bar_runs(runs)
    if not members:
        return
    mebi = 1024.0 * 1024.0
    figure, axes = plt.subplots(figsize=(COLUMN, 2.1))
    xs = np.arange(len(members))
    dag = np.array([r["dag_bytes"] / mebi for r in members])
    pages = np.array([r["map_bytes"] / mebi for r in members])
    axes.bar(xs, dag, 0.7, color=SKY, label="DAG", edgecolor="black", linewidth=0.4)
    axes.bar(xs, pages, 0.7, bottom=dag, color=ORANGE, label="pages and tables", edgecolor="black", linewidth=0.4,
             hatch="////")
    for x, total in zip(xs, dag + pages):
        axes.annotate(plain(total), (x, total), xytext=(0, 1.5), textcoords="offset points", ha="center", fontsize=5.6)
    axes.set_xticks(xs)
    axes.set_xticklabels([bar_label(r) for r in members])
    axes.set_ylim(0, max(1e-6, (dag + pages).max()) * 1.15)
    axes.grid(axis="x", visible=False)
    axes.set_xlabel("threshold (texels) or model")
    axes.set_ylabel("memory (MiB)")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=2, borderaxespad=0.2)
    charts.save(figure, f"bytes_{slug(scene)}", f"Bytes of DAG and pages, {scene}",
                f"What a frame holds to answer shadows: the DAG as it is traced ({plain(dag.max())} MiB) and the pages in "
                f"use with their tables (up to {plain(pages.max())} MiB). "
                "The DAG is paid once for the static scene, pages follow the view.")


def stages_chart(charts, scene, runs):
    members = bar_runs(runs)
    names = []
    for run in members:
        names += [n for n in run["stages"] if n not in names]
    if not names:
        return
    colors = [BLUE, ORANGE, GREEN, PURPLE, YELLOW, VERMILION, "#d5d9de", GREY, SKY, "#3d444d"]
    figure, axes = plt.subplots(figsize=(COLUMN, 0.9 + 0.17 * len(members) + 0.1 * math.ceil(len(names) / 3)))
    ys = np.arange(len(members))[::-1]
    left = np.zeros(len(members))
    for i, name in enumerate(names):
        widths = np.array([r["stages"].get(name, 0) for r in members])
        axes.barh(ys, widths, 0.72, left=left, color=colors[i % len(colors)], label=name, edgecolor="black",
                  linewidth=0.35, hatch=("", "////", "....")[i // len(colors) % 3])
        left += widths
    axes.set_yticks(ys)
    axes.set_yticklabels([bar_label(r) for r in members])
    axes.set_xlim(0, left.max() * 1.04)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("threshold (texels) or model")
    axes.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncol=3, borderaxespad=0.3, columnspacing=1.0,
                handlelength=1.2)
    largest = max(names, key=lambda n: sum(r["stages"].get(n, 0) for r in members))
    share = sum(r["stages"].get(largest, 0) for r in members) / max(1e-9, left.sum())
    charts.save(figure, f"stages_{slug(scene)}", f"Where the time goes, {scene}",
                f"Medians of every stage, added up; “{largest}” takes {100 * share:.0f} % over all bars. "
                "From top to bottom more and more lights go from maps to rays.")


def resolution_chart(charts, scene, runs):
    members = {}
    for run in runs:
        if run["method"] == "dag":
            parameters = run["parameters"]
            members.setdefault((parameters.get("offset"), parameters.get("lod")), []).append(run)
    members = sorted(max(members.values(), key=len), key=lambda r: r["parameters"]["resolution"]) if members else []
    if len(members) < 2:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 2.4))
    xs = [r["parameters"]["resolution"] for r in members]
    total = [r["false_shadow"] + r["false_light"] for r in members]
    if not any(total):
        plt.close(figure)
        return
    positive = [r[key] for r in members for key in ("false_shadow", "false_light") if r[key] > 0]
    has_zero = len(positive) < 2 * len(members)
    floor = min(positive + [total[0] * xs[0] / xs[-1]]) / (2.5 if has_zero else 1.4)
    shown = list(positive)
    for key, color, marker, name in (("false_shadow", VERMILION, "s", "false shadow"),
                                     ("false_light", SKY, "^", "false light")):
        ys = [r[key] if r[key] > 0 else floor for r in members]
        axes.plot(xs, ys, color=color, marker=marker, label=name, clip_on=False)
    axes.plot(xs, total, color=BLACK, marker="o", label="wrong pairs")
    reference = [total[0] * xs[0] / x for x in xs]
    axes.plot(xs, reference, color=GREY, linestyle="--", linewidth=0.9, label="halving")
    shown += [t for t in total if t > 0] + reference
    if has_zero:  # zero has no place on a logarithmic axis: its points stand on the frame
        axes.annotate("0", (0, 0), xycoords="axes fraction", xytext=(-4, 0), textcoords="offset points", ha="right",
                      va="center", fontsize=6.5)
    axes.set_xscale("log", base=2)
    axes.set_xticks(xs)
    axes.set_xticklabels([str(x) for x in xs])
    axes.xaxis.set_minor_locator(NullLocator())
    log_axis(axes.yaxis, floor, max(shown) * 1.4)
    if has_zero:  # no number beside the zero
        axes.yaxis.set_major_locator(FixedLocator([t for t in axes.get_yticks() if t > 1.2 * floor]))
    axes.set_xlabel("voxels an axis")
    axes.set_ylabel("share of pairs (%)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=4, borderaxespad=0.3, columnspacing=1.0)
    positive = [(x, t) for x, t in zip(xs, total) if t > 0]
    rate = -power_fit(*map(np.array, zip(*positive)))[1] if len(positive) > 1 else math.nan
    charts.save(figure, f"resolution_{slug(scene)}", f"Error over the DAG's resolution, {scene}",
                f"All lights traced: wrong pairs fall from {total[0]:.2f} % at {xs[0]}³ to {total[-1]:.2f} % at {xs[-1]}³, "
                f"by a factor of {2 ** rate:.2f} a doubling (least squares of logarithms). "
                "The dashed line halves with each doubling, as an error proportional to the voxel would.")


def lod_of(run):
    """Returns (rule, footprint scale or level, coverage) of a run's level of detail."""
    value = run["parameters"].get("lod", 0)
    parts = str(value).split(":")
    if parts[0] == "footprint":
        return "footprint", float(parts[1]) if len(parts) > 1 else 1.0, None
    if parts[0] == "coverage":
        return "coverage", float(parts[2]) if len(parts) > 2 else 1.0, float(parts[1])
    return "fixed", float(value), None


def lod_chart(charts, scene, runs):
    """Error against time of method dag where an experiment sweeps the level of detail."""
    rays = [r for r in runs if r["method"] == "dag"]
    if len({str(r["parameters"].get("lod", 0)) for r in rays}) < 2:
        return
    first = next((r for r in rays if lod_of(r)[:2] == ("fixed", 0.0)), rays[0])
    same = ("resolution", "offset")  # one series of each kind: those of the first resolution and offset
    rays = [r for r in rays if all(r["parameters"].get(k) == first["parameters"].get(k) for k in same)]
    wrong = lambda run: run["false_shadow"] + run["false_light"]
    groups = {}
    for run in rays:
        rule, size, share = lod_of(run)
        if rule == "coverage":  # shares at scale 1 are one series, scales at a share another
            if size == 1.0:
                groups.setdefault(("coverage", "share"), []).append((share, run))
            else:
                groups.setdefault(("coverage", share), []).append((size, run))
        else:
            groups.setdefault((rule, None), []).append((size, run))
    for key, members in groups.items():
        if key[0] == "coverage" and key[1] != "share":
            members += [(1.0, r) for r in rays if lod_of(r) == ("coverage", 1.0, key[1])]
        members.sort(key=lambda m: m[0])
    figure, (over_time, sides) = plt.subplots(1, 2, figsize=(2 * COLUMN, 2.6), gridspec_kw={"width_ratios": [1.15, 1]})
    styles = {("fixed", None): (BLACK, "o", "-", "fixed level"),
              ("footprint", None): (BLUE, "s", "--", "footprint × scale")}
    spare = [(VERMILION, "^", "-."), (PURPLE, "D", ":"), (GREEN, "v", "-.")]
    ordered = sorted(groups, key=lambda k: (["fixed", "footprint", "coverage"].index(k[0]), str(k[1]) != "share"))
    for i, key in enumerate(k for k in ordered if k[0] == "coverage"):
        name = "coverage ≥ share" if key[1] == "share" else f"coverage ≥ {key[1]:g}, footprint × scale"
        styles[key] = spare[i % len(spare)] + (name,)
    for key in ordered:
        color, marker, line, name = styles[key]
        xs, ys = [m[1]["time_ms"] for m in groups[key]], [wrong(m[1]) for m in groups[key]]
        over_time.plot(xs, ys, color=color, marker=marker, linestyle=line, linewidth=0.9, label=name,
                       markeredgecolor="white", markeredgewidth=0.4, markersize=4.6)
        sides.plot([m[1]["false_shadow"] for m in groups[key]], [m[1]["false_light"] for m in groups[key]],
                   color=color, marker=marker, linestyle=line, linewidth=0.9, markeredgecolor="white",
                   markeredgewidth=0.4, markersize=4.6)
        for size, run in groups[key]:
            text = f"{size:g}" if key[0] == "fixed" else f"×{size:g}" if key[1] != "share" else f"{100 * size:g} %"
            if key[1] not in (None, "share") and size == 1.0:
                continue  # stands in the series of shares
            if key[1] != "share":  # shares differ by too little in time to be told apart there
                over_time.annotate(text, (run["time_ms"], wrong(run)), xytext=(5, 3) if key[1] is None else (5, -7),
                                   textcoords="offset points", fontsize=5.8, color=color)
            below = key[0] == "fixed"
            sides.annotate(text, (run["false_shadow"], run["false_light"]), xytext=(4, -7) if below else (-5, 3),
                           textcoords="offset points", ha="left" if below else "right", fontsize=5.8, color=color)
    spread = [abs(r["time_ms_max"] - r["time_ms_min"]) / r["time_ms"] for r in rays]
    truth = next((r for r in runs if r["method"] == "embree"), None)
    over_time.set_xlabel("frame time (ms)")
    over_time.set_ylabel("wrong pairs (%)")
    over_time.margins(0.12)
    over_time.set_ylim(bottom=0)
    sides.set_xlabel("false shadow (% of pairs)")
    sides.set_ylabel("false light (% of pairs)")
    sides.margins(0.12)
    sides.set_xlim(left=0)
    sides.set_ylim(bottom=0)
    over_time.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=2, columnspacing=1.2, borderaxespad=0.2)
    fastest = min(rays, key=lambda r: r["time_ms"])
    best = min((r for r in rays if lod_of(r)[0] != "fixed"), key=wrong, default=first)
    sentence = (f" Embree needs {truth['time_ms']:.0f} ms for the same frame." if truth else "")
    charts.save(figure, f"lod_{slug(scene)}", f"Level of detail: error against time, {scene}",
                f"All lights traced at {first['parameters']['resolution']}³; down and left is better. Level 0 takes "
                f"{first['time_ms']:.0f} ms with {wrong(first):.2f} % of the pairs wrong; the fastest, lod "
                f"{fastest['parameters'].get('lod', 0)}, {fastest['time_ms']:.0f} ms with {wrong(fastest):.2f} %; of those that "
                f"follow the footprint the most exact, {best['parameters'].get('lod', 0)}, {best['time_ms']:.0f} ms with "
                f"{wrong(best):.2f} %. Marks name the level, the footprint's scale or the share of a cell's columns that "
                f"stops a ray; times of one run spread by {100 * max(spread):.0f} % at most. Rays of level 0 go in streams, "
                "those of all others one by one." + sentence)


def histogram_chart(charts, scene, runs, experiment):
    equivalent = equivalent_texels(experiment)
    hybrids = [r for r in runs if r["method"] == "hybrid" and threshold_of(r)]
    chosen = [r for r in runs if r["method"] == "maps"][:1]
    if hybrids:
        chosen.append(min(hybrids, key=lambda r: abs(math.log(threshold_of(r) / equivalent))))
    chosen += [r for r in runs if r["method"] == "dag"][:1]
    chosen = [r for r in chosen if r["histogram"] is not None]
    if not chosen:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 2.1))
    edges = np.linspace(0, 256, 33)
    shares = []
    for run, color, style in zip(chosen, (ORANGE, GREEN, BLUE), ("-", "--", ":")):
        counts = run["histogram"].reshape(32, 8).sum(axis=1)
        share = 100 * counts / max(1, counts.sum())
        shares += [s for s in share if s > 0]
        axes.stairs(np.where(share > 0, share, np.nan), edges / 256, color=color, linestyle=style, linewidth=1.1,
                    baseline=None, label=run["method"] if run["method"] != "hybrid" else f"hybrid {bar_label(run)}")
    log_axis(axes.yaxis, max(min(shares) / 1.5, 1e-5), 130, ticks=(1,))
    axes.set_xlim(0, 1)
    axes.axvline(0.5, color=GREY, linewidth=0.8, linestyle="--", zorder=1)
    axes.set_xlabel("visibility (dark under 0.5)")
    axes.set_ylabel("share of pairs (%)")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=3, borderaxespad=0.2)
    fractional = [r for r in chosen if r["method"] == "maps"] or chosen
    counts = fractional[0]["histogram"]
    part = 100 * counts[1:-1].sum() / max(1, counts.sum())
    charts.save(figure, f"visibility_{slug(scene)}", f"Histogram of visibility, {scene}",
                f"Rays answer lit or dark; filtered maps answer in between for {part:.1f} % of the pairs ({fractional[0]['label']}). "
                "Bins are 1/32 wide and the axis is logarithmic.")


def variants_chart(charts, scene, runs):
    """Time by stage and error of variants by name, one bar each."""
    if not runs:
        return
    names = []
    for run in runs:
        names += [n for n in run["stages"] if n not in names]
    colors = [BLUE, ORANGE, GREEN, PURPLE, YELLOW, VERMILION, "#d5d9de", GREY, SKY, "#3d444d"]
    figure, (times, errors) = plt.subplots(1, 2, figsize=(COLUMN * 1.25, 0.9 + 0.17 * len(runs) + 0.1 * math.ceil(len(names) / 4)),
                                           sharey=True, gridspec_kw={"width_ratios": [2.2, 1]})
    ys, left = np.arange(len(runs))[::-1], np.zeros(len(runs))
    for i, name in enumerate(names):
        widths = np.array([r["stages"].get(name, 0) for r in runs])
        times.barh(ys, widths, 0.72, left=left, color=colors[i % len(colors)], label=name, edgecolor="black",
                   linewidth=0.35, hatch=("", "////", "....")[i // len(colors) % 3])
        left += widths
    errors.barh(ys, [r["false_shadow"] for r in runs], 0.72, color=VERMILION, edgecolor="black", linewidth=0.35,
                label="false shadow")
    errors.barh(ys, [r["false_light"] for r in runs], 0.72, left=[r["false_shadow"] for r in runs], color=SKY,
                edgecolor="black", linewidth=0.35, hatch="////", label="false light")
    times.set_yticks(ys)
    times.set_yticklabels([r["label"] for r in runs])
    for axes, label, columns in ((times, "time (ms)", 3), (errors, "pairs (%)", 1)):
        axes.grid(axis="y", visible=False)
        axes.set_xlim(left=0)
        axes.set_xlabel(label)
        axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncol=columns, borderaxespad=0.3, columnspacing=0.9,
                    handlelength=1.0, fontsize=5.4)
    fastest = min(runs, key=lambda r: r["time_ms"])
    charts.save(figure, f"variants_{slug(scene)}", f"Variants, {scene}",
                f"Medians of every stage and the wrong pairs of every variant; the fastest is {fastest['label']} "
                f"({fastest['time_ms']:.1f} ms). Frames stand for themselves: static optimization has nothing to keep.")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", help="results.json files of compare")
    parser.add_argument("-o", "--output", required=True, help="directory of the charts")
    parser.add_argument("--mixed-commits", action="store_true", help="accept lines of different commits")
    arguments = parser.parse_args()
    all_runs, all_costs, experiment = load(arguments.results, arguments.mixed_commits)
    charts = Charts(arguments.output)
    scenes = list(dict.fromkeys(run["scene"] for run in all_runs))
    merged = {scene: over_frames([r for r in all_runs if r["scene"] == scene]) for scene in scenes}
    for scene in scenes:  # what has a name of its own has a chart of its own
        variants_chart(charts, scene, [r for r in merged[scene] if r["parameters"].get("variant")])
        merged[scene] = [r for r in merged[scene] if not r["parameters"].get("variant")]
    for scene in scenes:
        speed_accuracy(charts, scene, merged[scene], experiment)
    for scene in scenes:
        runs, costs = merged[scene], [c for c in all_costs if c["scene"] == scene]
        over_threshold(charts, scene, runs, experiment)
        per_map(charts, scene, costs, "texels", "required face resolution (texels)", "per_map_texels",
                "Time of a map by both methods over its resolution", experiment)
        per_map(charts, scene, costs, "samples", "samples served", "per_map_samples",
                "Time of a map by both methods over its samples", experiment)
        bytes_chart(charts, scene, runs)
        stages_chart(charts, scene, runs)
        resolution_chart(charts, scene, runs)
        lod_chart(charts, scene, runs)
        histogram_chart(charts, scene, runs, experiment)
    charts.finish()


if __name__ == "__main__":
    main()
