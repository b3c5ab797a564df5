# SPDX-License-Identifier: Apache-2.0
"""Runs of compare in the form of charts: merged over frames, in threshold sweeps, with short names."""
import math
import textwrap

import numpy as np

from ..files import Refused, expecting, read_json
from ..intervals import half_widths, interval, least_confidence, confidence_text
from ..scales import plain
from ..series import believe_of, model_of, settings_of, sweeps, threshold_of, tracers_of


def load(paths, mixed):
    """Returns runs, map costs and the experiment of the first file, after checking that all are of one commit, and of the same pairs
    where they are of the same frame of a scene."""
    runs, costs, experiments, commits, pairs, sequence_count = [], [], [], {}, {}, 0
    for path in paths:
        with expecting(path, "a results file of compare"):
            results = read_json(path)
            commits.setdefault(results["provenance"]["commit"], path)
            runs += results["runs"]
            costs += results.get("map_costs", [])
            sequence_count += len(results.get("sequence_runs", []))
            experiments.append(results["experiment"])
            for run in results["runs"]:
                first = pairs.setdefault((run["scene"], run["frame"]), (run["pair_count"], path, experiments[-1]["size"]))
                if run["pair_count"] != first[0]:
                    raise Refused(f"{first[1]} has {first[0]} pairs in frame {run['frame']} of {run['scene']} at {first[2]}, {path} has "
                                  f"{run['pair_count']} at {experiments[-1]['size']}: not one frame; measure both at one --size, with one "
                                  "--camera and the same lights")
    if len(commits) > 1 and not mixed:
        raise Refused("lines of different commits: "
                      + ", ".join(f"{commit} in {path}" for commit, path in commits.items())
                      + "; measure again with one program, or pass --mixed-commits")
    if not runs:
        raise Refused(f"{', '.join(paths)}: holds no runs to draw; "
                      + ("its frames in sequence are drawn by shadowdag figures" if sequence_count else
                         "measure with shadowdag compare"))
    seen = {run["scene"] for run in runs if run["pair_count"]}
    if not seen:
        raise Refused(f"{', '.join(paths)}: no run has a pair of a visible point and a light, so there is nothing to "
                      "draw; measure with another --camera, --frames or --lights")
    return [run for run in runs if run["scene"] in seen], costs, experiments[0]


def over_frames(runs):
    """Merges the frames of one scene: mean time, errors over all pairs, spread as mean of minima and maxima."""
    merged = {}
    for run in runs:
        merged.setdefault((run["method"], run["label"]), []).append(run)  # a tracer may have a method's name
    result = []
    for group in merged.values():
        one = dict(group[0])
        one["frame_count"] = len(group)
        for key in ("time_ms", "time_ms_min", "time_ms_max", "dag_bytes", "map_bytes"):
            one[key] = sum(r[key] for r in group) / len(group)
        # The mean of the frames' intervals holds the mean of their medians more often than one of them.
        ends = [interval(r) for r in group]
        one["time_ms_low"], one["time_ms_high"] = (sum(e[i] for e in ends) / len(ends) for i in (0, 1))
        one["time_ms_confidence"] = min(e[2] for e in ends)
        rounds = [r.get("round_times_ms", []) for r in group]
        one["round_times_ms"] = [sum(times) / len(group) for times in zip(*rounds)] if len({len(r) for r in rounds}) == 1 else []
        one["exact_bytes"] = sum(r.get("exact_bytes", 0) for r in group) / len(group)
        for key in ("ray_count", "exact_ray_count"):
            one[key] = sum(r.get(key, 0) for r in group)
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


def time_bars(axes, runs, heights, color="black", zorder=2):
    """Draws the intervals of the times of runs as horizontal error bars."""
    ends = [half_widths(r) for r in runs]
    axes.errorbar([r["time_ms"] for r in runs], heights, xerr=[[e[0] for e in ends], [e[1] for e in ends]], fmt="none",
                  ecolor=color, elinewidth=0.6, capsize=1.4, capthick=0.5, zorder=zorder)


def bars_sentence(runs):
    """Describes the error bars: what the intervals of the medians hold, and of how many repeats."""
    counts = sorted({r.get("repeat_count", 1) for r in runs})
    repeats = str(counts[0]) if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"
    return f" Bars are {confidence_text(least_confidence(runs))} intervals of medians of {repeats} repeats."


def tracer_label(run):
    """Returns the tracer's name for a legend, in lines that leave room for the axes."""
    return textwrap.fill(f"{run['label']} (pairs)", 26)


def tracers_sentence(runs):
    """Says what the times of such tracers are of, "" without any."""
    return " Times of tracers of pairs alone lack the rest of a frame." if tracers_of(runs) else ""


def rays_name(run):
    return {"all": "voxel rays", "none": "exact rays"}.get(believe_of(run), f"rays {believe_of(run)} px")


def bar_runs(runs):
    """The configurations worth a bar: the first sweep with the models of its settings, or the pure methods and all models."""
    series = sweeps(runs)
    settings = dict(next(iter(series))) if series else None
    members = list(next(iter(series.values()))) if series else [r for r in runs if r["method"] in ("maps", "dag")]
    if not series:  # of several levels of detail the first, because a bar's label contains none
        lods = [r["parameters"]["lod"] for r in members if "lod" in r["parameters"]]
        members = [r for r in members if r["parameters"].get("lod", lods[:1]) in (lods[:1], *lods[:1])]
    members += [r for r in runs if r["method"] == "hybrid" and threshold_of(r) is None and settings in (None, settings_of(r))]
    return members


def bar_label(run):
    threshold = threshold_of(run)
    if threshold == 0:
        return "maps"
    if threshold == math.inf:
        return rays_name(run)
    if threshold is None:
        model = model_of(run)
        return model if len(model) < 10 or "shown_as" in run else model[:8] + "…"
    return plain(threshold)
