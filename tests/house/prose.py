# SPDX-License-Identifier: Apache-2.0
"""What the prose of docs/ states of committed results, computed from these: {document: [texts that it must hold]}. The tables that
are generated are checked elsewhere (claims, device). A new sentence with measured numbers is a line of its section here."""
import json
import re


def wrong(run):
    """Returns the share of wrong pairs, per cent."""
    return 100.0 * (run["false_shadow_count"] + run["false_light_count"]) / run["pair_count"]


def digits(value):
    """Returns a share of pairs as the tables write it: two decimals, and <0.001 or 0 where there is nothing to round."""
    return "0" if value == 0 else "<0.001" if value < 0.0005 else f"{value:.3f}" if value < 0.0045 else f"{value:.2f}"


def by_label(results, name):
    """Returns {scene: {label: run}} of results of compare; the pool is the same in all and left out of labels."""
    scenes = {}
    for run in json.loads((results / name).read_text())["runs"]:
        scenes.setdefault(run["scene"].removeprefix("builtin:").removesuffix(".glb"), {})[re.sub(r" pool \d+M", "", run["label"])] = run
    return scenes


def span(values, form="{:.2f}"):
    return form.format(min(values)) + " to " + form.format(max(values))


def main_scenes(results, size=""):
    """Returns the scenes of the main chart as by_label does. size: "" or "_1080p" """
    return by_label(results, f"main{size}.json") | by_label(results, f"main_placed{size}.json")


def of_main(results):
    scenes, large = main_scenes(results), main_scenes(results, "_1080p")
    over = lambda label, runs=scenes: [run[label]["time_over_embree"] for run in runs.values()]
    exact, kept, mixed, voxel = "dag believe none", "maps warm", "hybrid texels:1536 believe none warm", "dag 4096^3 believe all"
    pairs, misses = (sum(f(run[exact]) for run in scenes.values())
                     for f in (lambda r: r["pair_count"], lambda r: r["false_shadow_count"] + r["false_light_count"]))
    # Kept maps, or kept maps with exact rays under 96 texels, are the fastest row; where they are not.
    slower = [name for name, runs in scenes.items() if min(runs, key=lambda label: runs[label]["time_ms"]) not in
              (kept, "hybrid texels:96 believe none warm", "hybrid texels:96 4096^3 believe all warm")]
    faster = [name for name, runs in scenes.items() if runs[voxel]["time_ms"] < runs[exact]["time_ms"]]
    ratio = max(wrong(runs[mixed]) / wrong(runs[kept]) for runs in scenes.values())
    sponza, atrium = large["crytek_sponza_half"], large["atrium"]
    holds = sum(runs[exact]["time_over_embree_low"] <= 1 <= runs[exact]["time_over_embree_high"] for runs in scenes.values())
    errors = sorted(wrong(runs[kept]) for runs in scenes.values())
    errors = f"{errors[0]:.2f} to {errors[-1]:.1f}"
    return {
        "docs/results.md": [
            f"Exact rays take {span(over(exact))} times as long as Embree's frame and have {misses} wrong pairs of {pairs / 1e6:.1f} million",
            "everywhere but in " + ", ".join(f"`{name}`" for name in slower) + ", where hybrid 1536 is faster",
            f"Their errors are {errors} %",
            f"has at most {ratio:.2f} times the maps' wrong pairs at {span(over(mixed))} times Embree's frame",
            "Voxel rays are faster than exact rays in " + ", ".join(f"`{name}`" for name in faster) + " alone",
            f"make {wrong(scenes['necropolis'][voxel]):.0f} % of their pairs wrong",
            f"they take {sponza['maps']['time_over_embree']:.2f} times as long as Embree's frame, kept ones "
            f"{sponza[kept]['time_over_embree']:.2f}, with {wrong(sponza['maps']):.2f} % of the pairs wrong",
            f"drawing takes {atrium['maps']['time_over_embree']:.2f}, kept maps {atrium[kept]['time_over_embree']:.2f}",
            "Exact rays take {:.2f} and {:.2f} times as long".format(*sorted(over(exact, large)))],
        "docs/limits.md": [
            f"wrong in {errors} % of the pairs",
            f"takes {span(over(exact))} times as long as the same frame by `rtcOccluded16` in eight scenes; the intervals of {holds} hold 1",
            f"Maps take {span(over(kept))} of it where a frame of the same view left them, and {span(over('maps'), '{:.1f}')} times as long",
            f"in `crytek_sponza_half` {sponza['maps']['time_over_embree']:.2f}"]}


def of_believe(results):
    scenes = by_label(results, "compare-believe.json")
    steps = ["dag believe none"] + [f"dag 4096^3 believe {step}" for step in ("0.5", "1", "2", "4", "8")]
    rows, ratios = [], []
    for name, runs in scenes.items():
        plain = runs["dag 4096^3 believe all"]
        ratios.append(runs[steps[0]]["time_ms"] / plain["time_ms"])
        times = " | ".join(f"{runs[label]['time_ms'] / plain['time_ms']:.2f}" for label in steps + ["embree"])
        errors = ", ".join(digits(wrong(run)) for run in [plain] + [runs[label] for label in steps[::-1]] + [runs["embree"]])
        rows.append(f"| {name} | {plain['time_ms']:.0f} | {times} | {errors} |")
    exact = [runs[steps[0]] for runs in scenes.values()]
    over = [runs[steps[0]]["time_ms"] / runs["embree"]["time_ms"] for runs in scenes.values()]
    total = f"{sum(run['pair_count'] for run in exact):,}".replace(",", " ")
    misses = sum(run["false_shadow_count"] + run["false_light_count"] for run in exact)
    return {"docs/results.md": rows + [f"but for {misses} pairs of {total}", f"It takes {span(ratios)} times as long as to believe all",
                                       f"Exact rays take {span(over)} times as long as Embree's frame and the same memory"],
            "docs/limits.md": ["take {:.1f} to {:.2f} times as long as rays through voxels at 4096^3".format(min(ratios), max(ratios))]}


def of_regret(results):
    scenes = {scene["scene"].removeprefix("builtin:"): scene for scene in json.loads((results / "regret.json").read_text())["scenes"]}
    mean = lambda name, key: sum(key(frame) for frame in scenes[name]["frames"]) / len(scenes[name]["frames"])
    row = lambda title, key: f"| {title} | " + " | ".join(f"{mean(name, key):.0f}" for name in ("atrium", "houses", "necropolis")) + " |"
    return {"docs/results.md": [row("`oracle`", lambda f: f["oracle_ms"]), row("rays alone", lambda f: f["times_ms"]["rays"]),
                                row("`cost` (the fit traces every map)", lambda f: f["times_ms"]["cost"]),
                                row("`texels:96`", lambda f: f["times_ms"]["texels:96"])]}


def prose_of(results):
    """Returns {document: texts} from the folder of committed results."""
    texts = {}
    for part in (of_main, of_believe, of_regret):
        for document, stated in part(results).items():
            texts.setdefault(document, []).extend(stated)
    return texts


def check_prose(document, text, stated):
    """Returns the texts that a document lacks or states differently."""
    flat = " ".join(text.split())
    return [f"{document}: does not say '{claim}', as the committed results do" for claim in stated if claim not in flat]
