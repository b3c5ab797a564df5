# SPDX-License-Identifier: Apache-2.0
"""Speed against accuracy: error over frame time, with the Pareto front and the paper's threshold."""
import math

import numpy as np

from ..series import (believe_of, is_warm, keeps_beams, label_of, legend_of_names, model_of, pareto, rays_alone, series_name, sweeps,
                      threshold_of, tracers_of)
from ..style import (BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, YELLOW, error_axis, log_axis, place_labels,
                     plain, plt, slug)
from ..texels import PAPER_TEXELS, equivalent_texels
from .runs import bars_sentence, time_bars, tracer_label, tracers_sentence

TRACER_COLORS = (GREY, PURPLE, SKY, GREEN)


def pure_run(members, texels, costs):
    """Returns the run of a sweep that a threshold equals because no map lies on the other side of it: that of maps alone or of rays
    alone, and None where the threshold divides the maps or their requests are not known. costs: of the scene's maps"""
    requests = [cost["texels"] for cost in costs]
    end = 0 if requests and min(requests) >= texels else math.inf if requests and max(requests) < texels else None
    return None if end is None else next((r for r in members if threshold_of(r) == end), None)


def rings_sentence(ringed, experiment):
    """Describes the crosses, and which of the paper's threshold and its equivalent has no run to put one on."""
    equivalent = equivalent_texels(experiment)

    def name(texels, near):
        if near in (0, math.inf):
            return f"the paper's {PAPER_TEXELS} texels, which " + ("draw every map here" if near == 0 else "trace every light here")
        text = (f"the paper's {PAPER_TEXELS} texels" if texels == PAPER_TEXELS else
                f"{equivalent:.0f} texels, the equivalent at {experiment['size']} of the paper's {PAPER_TEXELS}")
        return text + ("" if abs(near - texels) < 0.5 else f" (nearest run: {plain(near)})")

    if not ringed:
        return ""
    sentence = (" Crosses stand at " if len(ringed) > 1 else " The cross stands at ") + " and ".join(name(*r) for r in ringed) + "."
    pure = {near for _, near in ringed} & {0, math.inf}  # the paper's threshold; its equivalent asks for fewer texels
    absent = {PAPER_TEXELS, equivalent} - {texels for texels, _ in ringed} - ({equivalent} if 0 in pure else set())
    return sentence + "".join(f" {texels:.0f} texels have no run of their own." for texels in absent)


def speed_accuracy(charts, scene, runs, experiment, costs=()):
    """Draws the chart. costs: of the scene's maps, which tell whether the paper's threshold divides them"""
    figure, axes = plt.subplots(figsize=(COLUMN, 3.3))
    positive = [r["error"] for r in runs if r["error"] > 0]
    floor = (min(positive) if positive else 1e-4) / 4
    height = lambda run: 100 * max(run["error"], floor)
    series = sweeps(runs)
    styles = [(BLUE, "o"), (GREEN, "s"), (PURPLE, "^"), (VERMILION, "v"), (BLACK, "P"), (ORANGE, "X")]
    front = pareto(runs)
    if len(front) > 1:
        axes.step([r["time_ms"] for r in front], [height(r) for r in front], where="post", color=GREY, linewidth=3.2,
                  alpha=0.35, solid_capstyle="butt", zorder=1, label="Pareto front")
    times, errors = [r["time_ms"] for r in runs], [height(r) for r in runs]
    names = []  # labels of points: placed after all points
    for i, (key, members) in enumerate(series.items()):
        color, marker = styles[i % len(styles)]
        name = series_name(key, list(series))
        axes.plot([r["time_ms"] for r in members], [height(r) for r in members], color=color, marker=marker,
                  markersize=3, linewidth=0.8, zorder=3, label=f"hybrid ({name})" if name else "hybrid, thresholds",
                  **({"markerfacecolor": "white"} if dict(key).get("start") == "warm" else {}))
    for is_of_warm in (False, True):  # whose markers are hollow
        of_start = [r for r in runs if is_warm(r) == is_of_warm]
        end, face = (", warm", {"markerfacecolor": "white"}) if is_of_warm else ("", {})

        def draw(members, color, marker, size, style, label, **look):
            axes.plot([r["time_ms"] for r in members], [height(r) for r in members], color=color, marker=marker, markersize=size,
                      linewidth=0.8, linestyle=style, zorder=4, markeredgecolor=color if is_of_warm else "black", markeredgewidth=0.6 if
                      is_of_warm else 0.4, label=label + end, **face, **look)
        resolutions = rays_alone(of_start, "all")
        resolutions = [r for r in resolutions if r["parameters"].get("lod") == resolutions[0]["parameters"].get("lod")]
        resolutions.sort(key=lambda r: r["parameters"]["resolution"])
        if resolutions:
            draw(resolutions, SKY, "D", 4.6, "--", "rays through voxels")
            for run in resolutions if len(resolutions) > 1 else []:
                names.append((run["time_ms"], height(run), f"{run['parameters']['resolution']}³",
                              {"fontsize": 5.6, "color": "#2b6f96"}))
        between = sorted(rays_alone(of_start, None), key=believe_of)
        if between:
            draw(between, BLUE, "d", 4.2, ":", "rays that believe some voxels")
            names += [(r["time_ms"], height(r), f"{believe_of(r):g} px", {"fontsize": 5.6, "color": "#1d4f73"}) for r in between]
        exact = rays_alone(of_start, "none")
        if exact:
            draw(exact, YELLOW, "p", 5.6, ":", "exact rays (error 0)" if not any(r["error"] for r in exact) else "exact rays", clip_on=False)
        beams = [r for r in of_start if r["method"] == "dag" and keeps_beams(r)]
        if beams:
            draw(beams, GREEN, "d", 5.0, "none", "exact rays by beams", clip_on=False)
        maps = sorted((r for r in of_start if r["method"] == "maps"), key=lambda r: r["parameters"]["undersample"])
        if maps:
            draw(maps, ORANGE, "s", 4.6, "--", "maps alone")
            for run in maps if len({r["parameters"]["undersample"] for r in maps}) > 1 else []:
                names.append((run["time_ms"], height(run), f"u{run['parameters']['undersample']:g}",
                              {"fontsize": 5.6, "color": "#8a5f00"}))
        models = [r for r in of_start if r["method"] == "hybrid" and threshold_of(r) is None]
        for i, run in enumerate(models):
            draw([run], VERMILION, "*PXdh"[i % 5], 7 if i == 0 else 5, "none",
                 f"hybrid, {model_of(run) if len(model_of(run)) < 22 else model_of(run)[:20] + '…'}")
    equivalent = equivalent_texels(experiment)
    marked, ringed = [], []
    if series:  # the paper's setting has marks of its own, which the legend names
        members = next(iter(series.values()))
        for texels, marker in ((PAPER_TEXELS, "x"), (equivalent, "+")):
            nearest = min((r for r in members if 0 < threshold_of(r) < math.inf),
                          key=lambda r: abs(math.log(threshold_of(r) / texels)), default=None)
            if nearest is None or abs(math.log2(threshold_of(nearest) / texels)) > 0.25:
                nearest = pure_run(members, texels, costs) if texels == PAPER_TEXELS else None
            if nearest is None or nearest in marked:
                continue
            marked.append(nearest)
            ringed.append((texels, threshold_of(nearest)))
            name = "the paper's 96 texels" if texels == PAPER_TEXELS else f"{equivalent:.0f} texels: 96 at 1080p"
            name += {0: "\n(every map drawn)", math.inf: "\n(every light traced)"}.get(threshold_of(nearest), "")
            axes.plot(nearest["time_ms"], height(nearest), marker=marker, markersize=6 if marker == "x" else 8, color="black",
                      markeredgewidth=1.1, linestyle="none", zorder=8, label=name)
    embree = next((r for r in runs if r["method"] == "embree"), None)
    if embree:
        axes.plot(embree["time_ms"], height(embree), linestyle="none", marker="o", color=BLACK, markersize=5, zorder=4,
                  clip_on=False, label="Embree's frame")
    for i, run in enumerate(tracers_of(runs)):
        axes.plot(run["time_ms"], height(run), linestyle="none", marker="<>HP8*"[i % 6], color=TRACER_COLORS[i % len(TRACER_COLORS)],
                  markersize=5, markeredgecolor="black", markeredgewidth=0.4, zorder=5, clip_on=False, label=tracer_label(run))
    time_bars(axes, runs, [height(r) for r in runs])
    log_axis(axes.xaxis, min(min(times) / 1.35, *(r["time_ms_low"] for r in runs)), max(max(times) * 1.35, *(r["time_ms_high"] for r in runs)))
    hasZero = any(r["error"] == 0 for r in runs)
    error_axis(axes, min(errors) if hasZero else min(errors) / 1.6, max(errors) * 1.6, 6.5, hasZero)
    axes.set_xlabel("frame time (ms)")
    axes.set_ylabel("mean absolute visibility error (%)")
    isLong = len(axes.get_legend_handles_labels()[0]) > 10
    axes.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncol=2, columnspacing=0.8 if isLong else 1.2, borderaxespad=0.3,
                handlelength=1.4 if isLong else None, fontsize=5.6 if isLong else None)
    place_labels(axes, names, [(x, height(r)) for r in runs for x in np.geomspace(r["time_ms_low"], r["time_ms_high"], 5)])
    frames = [r for r in runs if r["method"] != "tracer"] or runs  # a tracer answers pairs and makes no frame
    best = min(frames, key=lambda r: r["time_ms"])
    exact = min(frames, key=lambda r: (r["error"], r["time_ms"]))
    charts.save(figure, f"speed_accuracy_{slug(scene)}", f"Speed against accuracy, {scene}",
                f"Down and left is better; the fastest is {label_of(best)} ({plain(best['time_ms'])} ms at "
                f"{100 * best['error']:.2f} % error), the most exact {label_of(exact)} ({plain(exact['time_ms'])} ms at "
                f"{100 * exact['error']:.2f} %). Differences within the spread of the times make no front."
                + (" Hollow points are warm frames, whose maps or beams a frame of the same view left." if any(map(is_warm, runs)) else "")
                + legend_of_names(runs) + tracers_sentence(runs) + rings_sentence(ringed, experiment) + bars_sentence(runs))
