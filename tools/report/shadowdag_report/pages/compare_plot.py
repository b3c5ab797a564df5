# SPDX-License-Identifier: Apache-2.0
"""Speed against accuracy of every frame of a compare, as the interactive charts of its page."""
from ..intervals import interval, interval_text
from ..palette import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, YELLOW
from ..series import (believe_of, is_warm, keeps_beams, label_of, legend_of_names, model_of, pareto, rays_alone, series_name, sweeps,
                      threshold_of, tracers_of)
from .page import cubed, number, percent, text
from .plot import Series, plot, x_axis_of, y_axis_of

SWEEPS = ((BLUE, "circle"), (GREEN, "square"), (PURPLE, "up"), (VERMILION, "down"), (BLACK, "plus"), (ORANGE, "cross"))
MODELS = ("star", "plus", "cross", "pentagon", "square")


def families(runs):
    """Returns the runs as Series of their indices; every run is in one."""
    found, taken = [], set()

    def add(name, color, shape, members, dash="", line=(), is_hollow=False):
        own = [r["index"] for r in members if r["index"] not in taken]
        if own:
            taken.update(own)
            found.append(Series(name, color, shape, own, [r["index"] for r in line], dash, is_hollow))

    add("variants", PURPLE, "star", [r for r in runs if r["parameters"].get("variant")])
    add("Embree's frame", BLACK, "circle", [r for r in runs if r["method"] == "embree"])
    for start in (False, True):
        of_start = [r for r in runs if is_warm(r) == start]
        warm = ", warm" if start else ""
        add("exact rays" + warm, YELLOW, "pentagon", rays_alone(of_start, "none"), is_hollow=start)
        add("exact rays by beams" + warm, GREEN, "pentagon", [r for r in of_start if r["method"] == "dag" and keeps_beams(r)], is_hollow=start)
        between = [r for r in rays_alone(of_start, None) if isinstance(believe_of(r), (int, float))]
        between.sort(key=believe_of)
        add("rays that believe some voxels" + warm, BLUE, "diamond", between, "1 3", between, start)
        voxels = sorted(rays_alone(of_start, "all"), key=lambda r: r["parameters"].get("resolution", 0))
        is_sweep = len({r["parameters"].get("lod") for r in voxels}) == 1
        add("rays through voxels" + warm, SKY, "diamond", voxels, "4 3", voxels if is_sweep else (), start)
        maps = [r for r in of_start if r["method"] == "maps"]
        maps.sort(key=lambda r: r["parameters"].get("undersample", 1))
        add("maps alone" + warm, ORANGE, "square", maps, "4 3", maps, start)
    series = sweeps([r for r in runs if not r["parameters"].get("variant")])
    for i, (key, members) in enumerate(series.items()):
        name = series_name(key, list(series))
        add("hybrid, thresholds" + (f" ({name})" if name else ""), *SWEEPS[i % len(SWEEPS)], members, line=members,
            is_hollow=dict(key).get("start") == "warm")
    models = dict.fromkeys((model_of(r), is_warm(r)) for r in runs if r["method"] == "hybrid" and threshold_of(r) is None)
    shapes = {model: MODELS[i % len(MODELS)] for i, model in enumerate(dict.fromkeys(model for model, _ in models))}
    for model, start in models:
        add(f"hybrid, {model if len(model) < 32 else model[:30] + '…'}" + (", warm" if start else ""), VERMILION, shapes[model],
            [r for r in runs if r["method"] == "hybrid" and (model_of(r), is_warm(r)) == (model, start)], is_hollow=start)
    add("tracers of others (pairs alone)", GREY, "cross", tracers_of(runs))
    add("others", GREY, "circle", runs)
    return found


def recommended(results):
    """Returns the (scene, label) of the runs that the verdict recommends."""
    return {(of["scene"], of.get("use")) for of in results.get("verdict", {}).get("scenes", ())}


def row_id(index):
    return f"run-{index}"


def frame_plot(results, number_of, scene, frame, runs):
    """Returns the chart of one frame. runs: with their index in the results and their error"""
    by_index = {r["index"]: r for r in runs}
    use = recommended(results)
    ringed = [r["index"] for r in runs if (r["scene"], r["label"]) in use]
    front = [r["index"] for r in pareto(runs)]
    caption = "Down and left is better. Bars are the intervals of the medians."
    if len(front) > 1:
        caption += " The grey band is the front: what no other run beats in both by more than the spread of the times."
    if ringed:
        caption += " The ring is the run that the verdict recommends."
    if any(map(is_warm, runs)):
        caption += " Hollow points are warm frames, whose maps or beams a frame of the same view left."
    caption += legend_of_names(runs)

    def words(index):
        run = by_index[index]
        wrong = percent(run, "false_shadow_count") + percent(run, "false_light_count")
        return (f"{cubed(text(label_of(run)))}: {interval_text(run, decimals=1)} ms, "
                f"{number(wrong, 3)} % of the pairs wrong")

    ends = [end for r in runs for end in interval(r)[:2]]
    return plot(f"plot-{number_of}", f"{scene}, frame {frame}", caption, families(runs),
                (x_axis_of("frame time (ms)", [r["time_ms"] for r in runs] + [e for e in ends if e > 0]),
                 y_axis_of("mean absolute visibility error (%)", [100 * r["error"] for r in runs])),
                lambda i: (by_index[i]["time_ms"], 100 * by_index[i]["error"]), row_id, words,
                span=lambda i: interval(by_index[i])[:2], ringed=ringed, front=front)


def compare_plots(results):
    """Returns a chart for every frame that has runs with pairs."""
    frames = {}
    for index, run in enumerate(results["runs"]):
        if run["pair_count"] and run["time_ms"] > 0:
            frames.setdefault((text(run["scene"]), run["frame"]), []).append(
                {"time_ms_min": run["time_ms"], "time_ms_max": run["time_ms"], "parameters": {}} | run
                | {"index": index, "error": run["mean_abs_visibility_error"]})
    return [frame_plot(results, i, *key, runs) for i, (key, runs) in enumerate(frames.items())]
