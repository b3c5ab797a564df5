# SPDX-License-Identifier: Apache-2.0
"""Runs of compare as charts want them: merged over frames, in threshold sweeps, with short names."""
import math

import numpy as np

from ..files import Refused, expecting, read_json
from ..style import plain

PAPER_TEXELS = 96
PAPER_PIXELS = 1920 * 1080


def load(paths, mixed):
    """Returns runs, map costs and the experiment of the first file, after checking that all are of one commit."""
    runs, costs, experiments, commits, sequence_count = [], [], [], {}, 0
    for path in paths:
        with expecting(path, "a results file of compare"):
            results = read_json(path)
            commits.setdefault(results["provenance"]["commit"], path)
            runs += results["runs"]
            costs += results.get("map_costs", [])
            sequence_count += len(results.get("sequence_runs", []))
            experiments.append(results["experiment"])
    if len(commits) > 1 and not mixed:
        raise Refused("lines of different commits: "
                      + ", ".join(f"{commit} in {path}" for commit, path in commits.items())
                      + "; measure again with one program, or pass --mixed-commits")
    if not runs:
        raise Refused(f"{', '.join(paths)}: holds no runs to draw; "
                      + ("its frames in sequence are drawn by shadowdag figures" if sequence_count else
                         "measure with shadowdag compare"))
    return runs, costs, experiments[0]


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
