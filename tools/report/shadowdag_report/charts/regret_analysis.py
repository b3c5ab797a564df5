# SPDX-License-Identifier: Apache-2.0
"""The loss of routing relative to model oracle, frame by frame: the content of regret.json."""
import statistics

from ..files import Refused, expecting, read_json
from ..intervals import interval, median_interval, paired_ratios
from ..series import is_warm

NOT_SERVING = {"batch boxes", "batch hierarchy", "scene update", "g-buffer", "clusters", "light assignment",
               "pair pruning", "resolution", "routing"}  # stages whose work no route changes


def name_of(run):
    """Returns the model of a run, or None for one that is not used."""
    if run["method"] == "dag":
        return "texels:inf"
    if run["method"] == "maps":
        return "texels:0"
    return run["model"] if run["method"] == "hybrid" else None


def serving_ms(run):
    """Returns the time of the stages that routing decides about."""
    return sum(float(ms) for stage, ms in run["stages_ms"].items() if stage not in NOT_SERVING)


def load(paths):
    """Returns {scene: {frame: {model: run}}} the oracle's sums {(scene, frame): ms} and
    the provenance of the first file; all are of its commit."""
    scenes, sums, provenances = {}, {}, []
    for path in paths:
        with expecting(path, "results of a compare"):
            results = read_json(path)
            provenances.append(results["provenance"])
            for run in results["runs"]:
                name = name_of(run)
                if name is None or is_warm(run):
                    continue
                frames = scenes.setdefault(run["scene"], {}).setdefault(run["frame"], {})
                if name in frames:
                    raise Refused(f"{path}: {run['scene']} frame {run['frame']} by {name} for the second time; give results "
                         "of one configuration a model")
                frames[name] = run
                float(run["time_ms"]), float(run["time_ms_min"]), float(run["time_ms_max"])
                serving_ms(run)
            for cost in results.get("map_costs", []):
                if cost.get("start") == "warm":
                    continue
                key = (cost["scene"], cost["frame"])
                sums[key] = sums.get(key, 0) + min(cost["rays_ms"], cost["map_ms"])
    commits = {provenance["commit"] for provenance in provenances}
    if len(commits) > 1:
        raise Refused(f"results of different commits: {', '.join(sorted(commits))}; measure them with one")
    for scene, frames in scenes.items():
        for frame, runs in frames.items():
            for needed in ("texels:inf", "texels:0", "oracle", "cost"):
                if needed not in runs:
                    raise Refused(f"{scene} frame {frame}: no run by {needed}; compare with methods dag, maps, hybrid "
                         "and models oracle and cost")
    if not scenes:
        raise Refused("no runs to draw")
    return scenes, sums, provenances[0]


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
    """Returns half the interval of a run's median, as a share."""
    low, high, _ = interval(run)
    return 0.5 * (high - low) / run["time_ms"]


def regret_of(run, base):
    """Returns the ratio of two times less 1: the median over the rounds, or the ratio of the medians."""
    ratios = paired_ratios(run, base)
    return (statistics.median(ratios) if ratios else run["time_ms"] / base["time_ms"]) - 1


def ratio_interval(run, base):
    """Returns what the ratio of two times less 1 is at least and at most: by order statistics of the rounds, with 95 % unless they
    are fewer than six, or by the intervals of both times."""
    ratios = paired_ratios(run, base)
    if not ratios:
        (low, high, _), (base_low, base_high, _) = interval(run), interval(base)
        return low / base_high - 1, high / base_low - 1
    low, high = median_interval(ratios)
    return low - 1, high - 1


def analyse(scene, frames, sums):
    """Returns the content of regret.json for a scene."""
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
            # The predicted sum: the stages that routing decides about.
            "oracle_serving_ms": serving_ms(runs["oracle"]),
            "better_single": "rays" if single is runs["texels:inf"] else "maps",
            "times_ms": {n: runs[m]["time_ms"] for n, m in models.items() if m in runs},
            "regret": {n: regret_of(runs[m], runs["oracle"]) for n, m in models.items() if m in runs},
            "regret_intervals": {n: ratio_interval(runs[m], runs["oracle"]) for n, m in models.items() if m in runs},
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
            # If the oracle gains no more than the noise, there is nothing to gain.
            "realised": (single_ms - total("cost")) / gain if gain > noise_ms else None},
        "slower_frames": [r["frame"] for r in rows if r["is_slower"]],
        "worst_frame": {
            "frame": worst["frame"], "cost_ms": worst["times_ms"]["cost"],
            "traced_map_count": worst["cost_traced_map_count"],
            "drawn_map_count": worst["cost_drawn_map_count"],
            "ray_share": worst["cost_ray_count"] / max(1, worst["pair_count"]),
            "oracle_ms": worst["oracle_ms"], "better_single": worst["better_single"]}}
