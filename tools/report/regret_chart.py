#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws what routing loses, frame by frame, against model oracle: by model cost, by texels:96, by the best single
threshold and by either method alone, out of results.json of `shadowdag compare` with models oracle and cost. Writes
regret.svg, regret.png and regret.json, and prints the sums.

    regret_chart.py report/results.json [more.json ...] -o docs

The single threshold of a frame is the one that is fastest on all other frames of its scene. Model cost is held out
where its calibration saw none of the frames: that is for the caller to see to. Time is that of whole frames.
"""
import argparse
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from charts import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, VERMILION, plt  # its style as well

LINES = {  # name: (colour, marker, dashes)
    "rays": (BLUE, "v", (4, 2)), "maps": (ORANGE, "^", (4, 2)), "texels:96": (GREY, "s", (1, 1)),
    "best threshold": (GREEN, "D", (3, 1, 1, 1)), "cost": (VERMILION, "o", ())}
NOT_SERVING = {"batch boxes", "batch hierarchy", "scene update", "g-buffer", "clusters", "light assignment",
               "pair pruning", "resolution", "routing"}  # stages whose work no route changes


def fail(message):
    sys.exit(f"regret_chart.py: {message}")


def name_of(run):
    """Returns by what a run is routed, or None for one that takes no part."""
    if run["method"] == "dag":
        return "texels:inf"
    if run["method"] == "maps":
        return "texels:0"
    return run["model"] if run["method"] == "hybrid" else None


def serving_ms(run):
    """Returns the time of the stages that routing decides about."""
    return sum(float(ms) for stage, ms in run["stages_ms"].items() if stage not in NOT_SERVING)


def load(paths):
    """Returns {scene: {frame: {model: run}}} the oracle's sums {(scene, frame): ms} and the one commit that all are of."""
    scenes, sums, commits = {}, {}, set()
    for path in paths:
        try:
            with open(path) as file:
                results = json.load(file)
            commits.add(results["provenance"]["commit"])
            for run in results["runs"]:
                name = name_of(run)
                if name is None:
                    continue
                frames = scenes.setdefault(run["scene"], {}).setdefault(run["frame"], {})
                if name in frames:
                    fail(f"{path}: {run['scene']} frame {run['frame']} by {name} for the second time; give results "
                         "of one configuration a model")
                frames[name] = run
                float(run["time_ms"]), float(run["time_ms_min"]), float(run["time_ms_max"])
                serving_ms(run)
            for cost in results.get("map_costs", []):
                key = (cost["scene"], cost["frame"])
                sums[key] = sums.get(key, 0) + min(cost["rays_ms"], cost["map_ms"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            fail(f"{path}: not results of a compare: {error!r}")
    if len(commits) > 1:
        fail(f"results of different commits: {', '.join(sorted(commits))}; measure them with one")
    for scene, frames in scenes.items():
        for frame, runs in frames.items():
            for needed in ("texels:inf", "texels:0", "oracle", "cost"):
                if needed not in runs:
                    fail(f"{scene} frame {frame}: no run by {needed}; compare with methods dag, maps, hybrid "
                         "and models oracle and cost")
    if not scenes:
        fail("no runs to draw")
    return scenes, sums, commits.pop()


def thresholds(frames):
    """Returns the thresholds that every frame has, as models."""
    common = set.intersection(*(set(runs) for runs in frames.values()))
    return sorted((m for m in common if m.startswith("texels:")), key=lambda m: float(m[7:]))


def best_threshold(frames, training):
    """Returns the threshold whose time, over that of the oracle, is least over the training frames."""
    def loss(model):
        return sum(frames[f][model]["time_ms"] / frames[f]["oracle"]["time_ms"] for f in training)
    return min(thresholds(frames), key=loss)


def noise(run):
    """Returns half the spread of a run's times, as a share."""
    return 0.5 * (run["time_ms_max"] - run["time_ms_min"]) / run["time_ms"]


def analyse(scene, frames, sums):
    """Returns what regret.json holds of a scene."""
    numbers = sorted(frames)
    threshold = best_threshold(frames, numbers)
    rows = []
    for number in numbers:
        others = [other for other in numbers if other != number] or numbers
        models = {"rays": "texels:inf", "maps": "texels:0", "texels:96": "texels:96",
                  "best threshold": best_threshold(frames, others), "cost": "cost"}
        runs = frames[number]
        oracle = runs["oracle"]["time_ms"]
        single = min(runs["texels:inf"], runs["texels:0"], key=lambda r: r["time_ms"])
        cost = runs["cost"]
        allowed = 1.05 + noise(cost) + noise(single)
        rows.append({
            "frame": number, "best_threshold": models["best threshold"], "oracle_ms": oracle,
            "oracle_cost_sum_ms": sums.get((scene, number)),
            # What the sum promises: the stages that routing decides about.
            "oracle_serving_ms": serving_ms(runs["oracle"]),
            "better_single": "rays" if single is runs["texels:inf"] else "maps",
            "times_ms": {n: runs[m]["time_ms"] for n, m in models.items() if m in runs},
            "regret": {n: runs[m]["time_ms"] / oracle - 1 for n, m in models.items() if m in runs},
            "cost_over_better_single": cost["time_ms"] / single["time_ms"],
            "allowed": allowed, "is_slower": cost["time_ms"] > allowed * single["time_ms"],
            "cost_traced_map_count": cost.get("traced_map_count", cost["traced_light_count"]),
            "cost_drawn_map_count": cost.get("drawn_map_count", cost["mapped_light_count"]),
            "cost_ray_count": cost["ray_count"], "pair_count": cost["pair_count"]})

    def total(key):
        return sum(r["times_ms"][key] for r in rows)
    # The better single method of the whole animation, and of every frame.
    single_ms = min(total("rays"), total("maps"))
    frame_ms = sum(min(r["times_ms"]["rays"], r["times_ms"]["maps"]) for r in rows)
    oracle_ms = sum(r["oracle_ms"] for r in rows)
    promised = [r for r in rows if r["oracle_cost_sum_ms"]]
    noise_ms = sum(noise(frames[r["frame"]]["oracle"]) * r["oracle_ms"] for r in rows)
    gain = single_ms - oracle_ms
    worst = max(rows, key=lambda r: r["times_ms"]["cost"])
    return {
        "scene": scene, "best_threshold": threshold, "frames": rows,
        "sums": {
            "frame_count": len(rows), "oracle_ms": oracle_ms, "oracle_noise_ms": noise_ms,
            "better_single_ms": single_ms, "better_single_of_every_frame_ms": frame_ms,
            "cost_ms": total("cost"), "best_threshold_ms": total("best threshold"),
            "texels_96_ms": total("texels:96") if all("texels:96" in r["times_ms"] for r in rows) else None,
            "oracle_serving_over_cost_sum": sum(r["oracle_serving_ms"] for r in promised)
            / sum(r["oracle_cost_sum_ms"] for r in promised) if promised else None,
            "oracle_gain_ms": gain, "cost_gain_ms": single_ms - total("cost"),
            # Where the oracle gains no more than the noise there is nothing to realise.
            "realised": (single_ms - total("cost")) / gain if gain > noise_ms else None},
        "slower_frames": [r["frame"] for r in rows if r["is_slower"]],
        "worst_frame": {
            "frame": worst["frame"], "cost_ms": worst["times_ms"]["cost"],
            "traced_map_count": worst["cost_traced_map_count"],
            "drawn_map_count": worst["cost_drawn_map_count"],
            "ray_share": worst["cost_ray_count"] / max(1, worst["pair_count"]),
            "oracle_ms": worst["oracle_ms"], "better_single": worst["better_single"]}}


def describe(scene):
    held, worst = scene["sums"], scene["worst_frame"]
    realised = held["realised"]
    ninety_six = held["texels_96_ms"]
    print(f"{scene['scene']}: {held['frame_count']} frames, ms a frame: "
          + ", ".join(f"{n} {held[k] / held['frame_count']:.1f}" for n, k in (
              ("oracle", "oracle_ms"), ("cost", "cost_ms"), (scene["best_threshold"] + " (best)", "best_threshold_ms"),
              ("better single method", "better_single_ms")))
          + (f", texels:96 {ninety_six / held['frame_count']:.1f}" if ninety_six is not None else "")
          + "; of the oracle's gain cost realises "
          + (f"{100 * realised:.0f} %" if realised is not None else "nothing to speak of: the oracle gains "
             f"{held['oracle_gain_ms'] / held['frame_count']:.1f} ms a frame, noise {held['oracle_noise_ms'] / held['frame_count']:.1f}")
          + (f"; the oracle's maps take {held['oracle_serving_over_cost_sum']:.2f} of what their costs add up to"
             if held["oracle_serving_over_cost_sum"] else "")
          + f"; slower than the better method by over 5 % + noise: {scene['slower_frames'] or 'no frame'}"
          + f"; worst frame {worst['frame']}: {worst['cost_ms']:.1f} ms, {worst['traced_map_count']} maps traced, "
          f"{worst['drawn_map_count']} drawn, {100 * worst['ray_share']:.0f} % of the pairs by rays")


def panel(axes, scene, is_first):
    rows = scene["frames"]
    xs = [r["frame"] for r in rows]
    axes.axhline(0, color=BLACK, linewidth=0.8, label="oracle" if is_first else None)
    for name, (colour, marker, dashes) in LINES.items():
        members = [r for r in rows if name in r["regret"]]
        line, = axes.plot([r["frame"] for r in members], [100 * r["regret"][name] for r in members], marker=marker,
                          color=colour, markersize=3, linewidth=1, markeredgewidth=0.6, markerfacecolor="white",
                          label=name if is_first else None)
        if dashes:
            line.set_dashes(dashes)
    axes.set_yscale("symlog", linthresh=20)
    axes.set_yticks([-10, 0, 10, 20, 50, 100, 200])
    axes.yaxis.set_major_formatter(lambda y, _: f"{y:.0f}")
    worst = scene["worst_frame"]["frame"]
    axes.axvline(worst, color=GREY, linewidth=0.5, zorder=0)
    axes.set_title(f"{scene['scene'].removeprefix('builtin:')}; best threshold {scene['best_threshold'][7:]}, "
                   f"worst frame {worst}", fontsize=7.5, loc="left")
    axes.set_ylabel("over oracle (%)")
    if len(xs) == 1:
        axes.set_xticks(xs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", nargs="+")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    loaded, sums, commit = load(arguments.results)
    scenes = [analyse(scene, frames, sums) for scene, frames in sorted(loaded.items())]
    figure, all_axes = plt.subplots(len(scenes), 1, figsize=(COLUMN, 1.7 * len(scenes) + 0.6), squeeze=False)
    for i, scene in enumerate(scenes):
        describe(scene)
        panel(all_axes[i][0], scene, i == 0)
    all_axes[-1][0].set_xlabel("frame")
    all_axes[0][0].legend(loc="lower center", bbox_to_anchor=(0.45, 1.12), ncol=3, columnspacing=1.0,
                          handletextpad=0.4)
    os.makedirs(arguments.output, exist_ok=True)
    for kind in ("svg", "png"):
        path = os.path.join(arguments.output, f"regret.{kind}")
        figure.savefig(path + ".part", format=kind, metadata={"Date": None} if kind == "svg" else {},
                       bbox_inches="tight")
        os.replace(path + ".part", path)
    path = os.path.join(arguments.output, "regret.json")
    with open(path + ".part", "w") as file:
        json.dump({"commit": commit, "scenes": scenes}, file, indent=2)
        file.write("\n")
    os.replace(path + ".part", path)


if __name__ == "__main__":
    main()
