# SPDX-License-Identifier: Apache-2.0
"""What the prose of docs/ states of committed results, computed from these: {document: [texts that it must hold]}. The tables that
are generated are checked elsewhere (claims, device). A new sentence with measured numbers is a line of its section here."""
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools/report"))
from shadowdag_report.animations import ratio_of  # noqa: E402


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


def listed(names):
    names = [f"`{name}`" for name in names]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names) or "none"


def main_scenes(results, size=""):
    """Returns the scenes of the main chart as by_label does. size: "" or "_1080p" """
    return by_label(results, f"main{size}.json") | by_label(results, f"main_placed{size}.json")


def of_main(results):
    scenes, large = main_scenes(results), main_scenes(results, "_1080p")
    over = lambda label, runs=scenes: [run[label]["time_over_embree"] for run in runs.values()]
    exact, kept, mixed, voxel = "dag believe none", "maps warm", "hybrid texels:1536 believe none warm", "dag 4096^3 believe all"
    pairs, misses = (sum(f(run[exact]) for run in scenes.values())
                     for f in (lambda r: r["pair_count"], lambda r: r["false_shadow_count"] + r["false_light_count"]))
    # Where the fastest row does not draw most lights into maps that are kept.
    fastest = {name: min(runs.values(), key=lambda run: run["time_ms"]) for name, runs in scenes.items()}
    slower = [name for name, run in fastest.items()
              if "warm" not in run["label"] or run["traced_light_count"] >= run["mapped_light_count"]]
    faster = [name for name, runs in scenes.items() if runs[voxel]["time_over_embree_high"] < runs[exact]["time_over_embree_low"]]
    ratio = max(wrong(runs[mixed]) / wrong(runs[kept]) for runs in scenes.values())
    sponza = large["crytek_sponza_half"]
    wrong_large = sorted(wrong(runs[kept]) for runs in large.values())
    # The oracle's shares of maps that it draws, at the larger size.
    drawn = {name: runs["hybrid oracle believe none"] for name, runs in large.items()}
    drawn = {name: run["drawn_map_count"] / (run["drawn_map_count"] + run["traced_map_count"]) for name, run in drawn.items()}
    busy = max(run.get("other_cpu_share") or 0.0 for runs in scenes.values() for run in runs.values())
    holds = sum(runs[exact]["time_over_embree_low"] <= 1 <= runs[exact]["time_over_embree_high"] for runs in scenes.values())
    errors = sorted(wrong(runs[kept]) for runs in scenes.values())
    errors = f"{errors[0]:.2f} to {errors[-1]:.1f}"
    return {
        "docs/results.md": [
            f"Exact rays take {span(over(exact))} times as long as Embree's frame and have {misses} wrong pairs of {pairs / 1e6:.1f} million",
            "fastest frames, alone or with rays for few lights beside them, "
            + (f"everywhere but in {listed(slower)}, where rows that trace most lights are faster" if slower else "in all eight scenes"),
            f"Their errors are {errors} %",
            f"has at most {ratio:.2f} times the maps' wrong pairs at {span(over(mixed))} times Embree's frame",
            "Voxel rays are faster than exact rays, beyond the intervals of both, " + ("only in " + listed(faster) if faster else "in no scene"),
            f"make {wrong(scenes['necropolis'][voxel]):.0f} % of their pairs wrong",
            f"Maps that are drawn anew take {span(over('maps', large))} times as long as Embree's frame and are faster than it in "
            + listed(name for name, runs in large.items() if runs["maps"]["time_over_embree_high"] < 1),
            f"Kept maps take {span(over(kept, large))} times as long, with {wrong_large[0]:.2f} to {wrong_large[-1]:.1f} % of the pairs wrong",
            "It draws every map in " + listed(name for name, share in drawn.items() if share == 1) + ", traces every one in "
            + listed(name for name, share in drawn.items() if share == 0) + (", and does both in " + listed(
                name for name, share in drawn.items() if 0 < share < 1) if any(0 < share < 1 for share in drawn.values()) else ""),
            f"Other processes used {100 * busy:.1f} % of the processor at most",
            f"Exact rays take {span(over(exact, large))} times as long there"],
        "docs/limits.md": [
            f"wrong in {errors} % of the pairs",
            f"takes {span(over(exact))} times as long as the same frame by Embree's packets in eight scenes; the intervals of {holds} hold 1",
            f"Maps take {span(over(kept))} of it where a frame of the same view left them, and {span(over('maps'), '{:.1f}')} times as long",
            f"in `crytek_sponza_half` {sponza['maps']['time_over_embree']:.2f}"]}


def of_tracers(results):
    """Tracers of others, from the ray sets of the main chart's scenes."""
    pairs, wrong, ratios = 0, {}, []
    for path in sorted(results.glob("tracers-*.json")):
        runs = json.loads(path.read_text())["runs"]
        pairs += runs[0]["proven_count"]
        for run in runs:
            wrong[run["label"]] = wrong.get(run["label"], 0) + run["proven_wrong_count"]
        times = {run["label"]: run["time_ms"] for run in runs}
        ratios += [times["Bullet"] / times["Embree, robust"]] if "Bullet" in times else []
    stated = [f"{wrong['Embree, robust']} answers of *Embree, robust* are proven wrong, of {pairs / 1e6:.1f} million"]
    if "Bullet" in wrong:
        stated += [f"{wrong['Bullet']} of *Bullet*", f"takes {span(ratios, '{:.0f}')} times as long"]
    return {"docs/results.md": stated}


def of_adjudication(results):
    """What the adjudicator finds of the method embree."""
    def cells(name):
        return {cell["scene"]: cell for cell in json.loads((results / name).read_text())["cells"] if cell["tracer"] == "embree method"}
    three, four, real = cells("adjudication.json"), cells("embree4-adjudication.json"), cells("adjudication_real.json")
    far = three["fail-far-origin"]
    missed = " and ".join(f"`{scene}` ({three[scene]['false_light_count']})" for scene in ("fail-coplanar", "fail-sconce")
                          if four[scene]["wrong_count"] == 0)
    return {"docs/adjudicator.md": [
        f"passes contacts ({spaced(far['false_light_count'])} false lights)",
        f"does not always clear the sample's own surface ({spaced(far['false_shadow_count'])} false shadows)",
        f"Embree 3 also misses hits at edges in {missed}, where Embree 4 misses none",
        f"In the real scenes it has {sum(cell['wrong_count'] for cell in real.values())} wrong pairs"]}


def of_streams(results):
    """Streams through the DAG against Embree, where the processor has AVX-512."""
    rates = []
    for path in sorted(results.glob("bench-voxel-*.json")):
        rates.append({row["tracer"]: row["megarays_per_s"] for row in json.loads(path.read_text())["rates"] if row["order"] == "cluster"})
    rates = [of for of in rates if "traceStream AVX-512" in of]
    over = lambda name: [of["traceStream AVX-512"] / of[name] for of in rates]
    text = lambda name, form: form.format(over(name)[0]) if len(rates) == 1 else span(over(name), form)
    return {"docs/limits.md": [f"streams through the DAG are {text('rtcOccluded1', '{:.1f}')} times as fast as Embree's single rays "
                               f"and {text('rtcOccluded16', '{:.2f}')} times as fast as its packets of 16"]}


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
    over = [run["time_over_embree"] for run in exact]
    total = f"{sum(run['pair_count'] for run in exact):,}".replace(",", " ")
    misses = sum(run["false_shadow_count"] + run["false_light_count"] for run in exact)
    limited = {name: runs["dag 4096^3 believe 8"].get("magnified_count", 0) for name, runs in scenes.items()}
    (first, count), *others = [(name, count) for name, count in limited.items() if count]
    magnified = f"Of `believe 8`, which allows 8 pixels, {count} pairs of `{first}`, " + " and ".join(f"{n} of `{name}`" for name, n in others)
    segments = {m["method"]: m["ns_per_pair"] for m in json.loads((results / "bench-voxel-atrium-4096.json").read_text())["frame"]["methods"]}
    finished = f"it takes {segments['rtcOccluded16']:.1f} ns a pair where exact rays in streams take {segments['exact streams']:.1f}"
    return {"docs/results.md": rows + [magnified, finished, f"but for {misses} pairs of {total}", f"It takes {span(ratios)} times as long as to believe all",
                                       f"Exact rays take {span(over)} times as long as Embree's frame and the same memory"],
            "docs/limits.md": ["take {:.1f} to {:.2f} times as long as rays through voxels at 4096^3".format(min(ratios), max(ratios))]}


def beam_scenes(results, size=""):
    """Returns the scenes that were measured with beams as by_label does. size: "" or "_1080p" """
    return by_label(results, f"compare-beams{size}.json") | by_label(results, f"compare-beams_placed{size}.json")


def of_beams(results):
    exact, cold, warm, maps = "dag believe none", "dag believe none beams 512M", "dag believe none beams 512M warm", "maps warm"
    misses = lambda run: run["false_shadow_count"] + run["false_light_count"]
    stated = []
    for size in ("", "_1080p"):
        scenes = beam_scenes(results, size)
        for name, runs in scenes.items():
            ratios = " | ".join("{time_over_embree:.2f} ({time_over_embree_low:.2f} to {time_over_embree_high:.2f})".format(**runs[label])
                                for label in (exact, cold, warm, maps))
            counts = ", ".join(str(misses(runs[label])) for label in ("embree", warm, maps))
            mebibytes = (runs[warm]["exact_bytes"] - runs[exact]["exact_bytes"]) / 2**20
            stated.append(f"| {name} | {runs['embree']['time_ms']:.0f} | {ratios} | {counts} | {mebibytes:.0f} |")
        over = lambda label: span([runs[label]["time_over_embree"] for runs in scenes.values()])
        reached = sum(runs[warm]["time_over_embree"] <= 0.63 for runs in scenes.values())
        stated += [f"exact rays by beams take {over(warm)} of Embree's frame" + (" at 1920 x 1080" if size else " at 640 x 360"),
                   f"where without them they take {over(exact)}", f"{reached} of {len(scenes)} scenes reach it"]
        assert all(misses(runs[warm]) == misses(runs[exact]) for runs in scenes.values()), "beams change answers"
    return {"docs/results.md": stated}


def of_regret(results):
    scenes = {scene["scene"].removeprefix("builtin:"): scene for scene in json.loads((results / "regret.json").read_text())["scenes"]}
    mean = lambda name, key: sum(key(frame) for frame in scenes[name]["frames"]) / len(scenes[name]["frames"])
    row = lambda title, key: f"| {title} | " + " | ".join(f"{mean(name, key):.0f}" for name in ("atrium", "houses", "necropolis")) + " |"
    return {"docs/results.md": [row("`oracle`", lambda f: f["oracle_ms"]), row("rays alone", lambda f: f["times_ms"]["rays"]),
                                row("`cost` (the fit traces every map)", lambda f: f["times_ms"]["cost"]),
                                row("`texels:96`", lambda f: f["times_ms"]["texels:96"])]}


def sequences(results, name):
    """Returns {label: {frame: row}} of results of compare --sequence."""
    rows = {}
    for row in json.loads((results / name).read_text())["sequence_runs"]:
        rows.setdefault(row["label"], {})[row["frame"]] = row
    return rows


def spaced(count):
    return f"{count:,}".replace(",", " ")


def of_paper(results):
    names = ("atrium", "houses", "necropolis")
    scenes = {name: sequences(results, f"figures_{name}.json") for name in names}

    def over_frames(runs, first, key, second, other):
        return [runs[first][frame][key] / row[other] for frame, row in runs[second].items() if frame in runs[first] and row[other]]

    def peak(runs, label, key, begin=0):
        return max(row[key] for frame, row in runs[label].items() if frame >= begin)

    def row(title, paper, text):
        return f"| {title} | {paper} | " + " | ".join(text(scenes[name]) for name in names) + " |"

    def ratios(values):
        return f"{min(values):.{0 if min(values) >= 10 else 1}f} to {max(values):.{0 if max(values) >= 10 else 1}f}"

    def change(values):
        low, high = (100 * (end - 1) for end in (min(values), max(values)))
        return (f"{-high:.0f} to {-low:.0f} % fewer" if high < 0 else f"{low:.0f} to {high:.0f} % more" if low > 0 else
                f"{low:.0f} to {high:+.0f} %")

    def less(label):
        triangles = "triangle_draw_count"
        first = lambda runs: min(runs["PMCD-EB"])
        return lambda runs: "{:.0f} % less".format(
            100 * (1 - peak(runs, label, triangles, first(runs) + 1) / peak(runs, "PMCD-EB", triangles, first(runs) + 1)))

    def lowest_peak(runs):
        peaks = {count: peak(runs, label, "texel_count") / 1e6
                 for count, label in ((16, "PMCD-EB-16SM"), (4, "PMCD-EB"), (1, "PMCD-EB-1SM"))}
        ordered = sorted(peaks, key=peaks.get)
        form = lambda value: f"{value:.{0 if value >= 10 else 1}f}"
        return f"{ordered[0]} ({form(peaks[ordered[0]])} M; " + ", ".join(f"{n}: {form(peaks[n])}" for n in ordered[1:]) + ")"

    timed = json.loads((results / "figure_10.json").read_text())["sequence_times"]

    def slowest(name):
        times = {row["label"]: row for row in timed if row["scene"] == f"builtin:{name}"}
        return " / ".join("{time_ms_p99:.0f} ({time_ms_p99_low:.0f} to {time_ms_p99_high:.0f})".format(**times[label])
                          for label in ("PMCD-EB", "Hybrid", "RT"))

    def once(key):  # one map a light against four, over the atrium's frames
        sums = [sum(key(row) for row in scenes["atrium"][label].values()) for label in ("PMCD-EB", "PMCD-EB-1SM")]
        return f"{sums[0] / sums[1]:.1f} times as many"

    frames = {}
    for run in json.loads((results / "figure_10.json").read_text())["sequence_runs"]:
        frames.setdefault((run["scene"], run["frame"]), {})[run["label"]] = run["time_ms"]
    rays_first = sum(min((ms, label) for label, ms in times.items() if label != "embree")[1] == "RT" for times in frames.values())
    held = {(row["time_ms_p99_confidence"], row["value_count"]) for row in timed}
    repeats = {run["repeat_count"] for run in json.loads((results / "figure_10.json").read_text())["sequence_runs"]}
    assert len(held) == 1 and repeats == {2}, "times of the figures are of unlike counts"
    (confidence, count), = held
    worst = f"| slowest frames (99th percentile with its {100 * confidence:.0f} % interval), PMCD-EB / Hybrid / rays alone, ms | the hybrid is not better | "
    return {"docs/results.md": [
        row("triangles: projection maps compared with spheres and six faces", "at least 6 times fewer", lambda runs:
            ratios(over_frames(runs, "PMC", "triangle_sphere_count", "PMC", "triangle_draw_count")) + " times"),
        row("triangles: explicit bounds", "8 to 35 % fewer", lambda runs:
            change(over_frames(runs, "PMCD-EB", "triangle_draw_count", "PMCD", "triangle_draw_count"))),
        row("texels: explicit bounds", "8 to 35 % fewer", lambda runs:
            change(over_frames(runs, "PMCD-EB", "texel_count", "PMCD", "texel_count"))),
        row("peak of triangles with static optimization, after frame 0", "about 40 % less", less("PMCD-EB-SO")),
        row("the same, with retained pages", "", less("PMCD-EB-SOR")).replace("|  |", "| |"),
        row("maps per light with the lowest peak of texels", "4", lowest_peak),
        row("texels per lighting computation, 4 maps per light", "about proportional", lambda runs:
            ratios(over_frames(runs, "PMCD-EB", "texel_count", "PMCD-EB", "lighting_computation_count"))),
        worst + " | ".join(slowest(name) for name in names) + " |",
        f"the 99th percentiles of the {count} times stand in the table with the intervals that hold them with {100 * confidence:.0f} %"
        + (": for 95 % these values are too few" if confidence < 0.95 else ""),
        f"fastest of the four in {rays_first} of {len(frames)} frames",
        f"four maps per light draw {once(lambda row: row['triangle_draw_count'])} triangles as one map and have "
        + once(lambda row: row['false_shadow_count'] + row['false_light_count']) + " wrong pairs"]}


def of_flicker(results):
    sums = lambda runs, label, key: sum(row[key] for row in runs[label].values())
    runs, held = sequences(results, "slow_camera.json"), sequences(results, "held_routes.json")
    maps, hybrid, followed = "PMCD-EB", "Hybrid:texels:32", "flicker_answer_count"
    held_of = lambda label: sums(runs, label, "flicker_held_count")
    of_maps = [label for label in runs if label not in ("embree", "RT")]
    switches = {sums(held, label, "flicker_method_switch_count") for label in held if label != "embree"}
    return {"docs/results.md": [
        f"{sums(runs, maps, followed) / 1e6:.1f} million answers per variant are followed from frame to frame",
        "at most {} of {:.1f} million answers of a variant".format(
            max(map(held_of, of_maps)), min(sums(runs, label, "flicker_held_answer_count") for label in of_maps) / 1e6),
        f"of rays through voxels {sums(runs, 'RT', 'flicker_count')}, of Embree's packets {held_of('embree')}",
        "When a resolution changes, {} of {} answers change".format(
            sums(runs, maps, "flicker_resolution_switch_count"),
            spaced(sums(runs, maps, "flicker_resolution_switch_answer_count"))),
        "When the method changes, {} of {} do (hybrid at 32 texels)".format(
            sums(runs, hybrid, "flicker_method_switch_count"), spaced(sums(runs, hybrid, "flicker_method_switch_answer_count"))),
        "A margin for routes changes nothing in this sequence" if len(switches) == 1 else "A margin for routes changes"]}


def of_animations(results):
    """Times over the animations of animations.json: what the sentences of docs/results.md state. The table is generated (claims)."""
    data = json.loads((results / "animations.json").read_text())
    embree, exact = "embree", "dag believe none"
    times = {}
    for row in data["sequence_times"]:
        times.setdefault(row["scene"].removeprefix("builtin:"), {})[row["label"]] = row
    over = lambda rows, label: rows[label]["time_ms_mean"] / rows[embree]["time_ms_mean"]
    confidence = {row["time_ms_p99_confidence"] for rows in times.values() for row in rows.values()}
    counts = {row["value_count"] for rows in times.values() for row in rows.values()}
    apart = [name for name, rows in times.items() if rows[exact]["time_ms_p99_high"] < rows[embree]["time_ms_p99_low"]]
    stated = [f"99th percentiles with the intervals of {100 * min(confidence):.0f} % that {min(counts)} values give"
              + (": too few for 95 %" if min(confidence) < 0.95 else ""),
              f"the intervals of both are apart in {listed(apart)}"]
    judged = lambda label, key: sum(row.get(key, 0) for row in data["sequence_runs"] if row["label"] == label)
    stated.append(f"finds ambiguous {spaced(judged(exact, 'ambiguous_count'))} of the {spaced(judged(exact, 'adjudicated_count'))} wrong pairs "
                  f"of exact rays; of those of Embree's frames {spaced(judged(embree, 'proven_wrong_count'))} are proven wrong")
    ratios = {name: ratio_of(rows[exact], data["sequence_runs"]) for name, rows in times.items()}
    stated.append("the interval of exact rays is below 1 in {} of {} scenes".format(
        sum(ratio["time_over_embree_high"] < 1 for ratio in ratios.values()), len(ratios)))
    return {"docs/results.md": stated + [
        f"Over the animations the mean frame of exact rays takes {span([over(rows, exact) for rows in times.values()])} of Embree's",
        f"{sum(over(rows, exact) <= 0.71 for rows in times.values())} of {len(times)} reach it"]}


def of_stability(results):
    data = json.loads((results / "stability.json").read_text())
    flickers = lambda group, case: next(sum(row[f"{kind}_flicker_count"] for kind in ("resolution_switch", "method_switch"))
                                        for row in data["time"] if (row["group"], row["case"], row["method"]) == (group, case, "hybrid"))
    pair = lambda group: "{} to {}".format(*(flickers(group, case)
                                             for case in ("every frame for itself", "resolutions and routes held")))
    fitted = lambda scene, method, case: next(row for row in data["rates"] if (row["group"], row["method"], row["case"]) ==
                                              (f"resolution-{scene}", method, case))
    rate = lambda scene, method, case="wrong_share": fitted(scene, method, case)["slope"]
    local = lambda scene: [fitted(scene, "maps", "mean_error")[key] for key in ("least_local", "greatest_local")]
    voxels = "dag believe all"
    assert all(rate(scene, voxels) == rate(scene, voxels, "mean_error") for scene in ("atrium", "necropolis")), "rays have unlike rates"
    exact = [row for row in data["perturbation"] if row["method"] == "dag believe none" and not row["kind"].startswith("unperturbed")]
    wrong_cases = sum(row["false_shadow_count"] + row["false_light_count"] > 0 for row in exact)
    zero = [check for check in data["checks"] if check["low"] <= 0]
    none = sum(check["high"] == 0 for check in zero)
    return {"docs/results.md": [
        f"(posts: {pair('time-posts')}) and a fifth (plates: {pair('time-plates')})",
        f"(rates {span([rate(scene, method) for scene in ('cubes', 'posts') for method in ('maps', voxels)])})",
        f"Of maps it falls at rate {rate('atrium', 'maps'):.2f} in the atrium and {rate('necropolis', 'maps'):.2f} in the necropolis; "
        f"of voxel rays at {rate('atrium', voxels):.2f} and {rate('necropolis', voxels):.2f}",
        f"which falls at {rate('atrium', 'maps', 'mean_error'):.2f} and {rate('necropolis', 'maps', 'mean_error'):.2f} with maps",
        f"`dag believe none` has {'no' if wrong_cases == 0 else 'a'} wrong pair in any of {len(exact)} perturbed cases",
        f"Of the {len(data['checks'])} checks {len(zero)} have the lower limit 0: {none} of them allow nothing else"],
        # The reasons of bands state what was measured when they were recorded.
        "scenes/studies/stability.json": [f"the local rate rises from {low:.2f} to {high:.2f}"
                                          for low, high in map(local, ("atrium", "necropolis"))]}


def of_real(results):
    cells = json.loads((results / "real_scenes.json").read_text())["cells"]
    by = lambda method: [cell for cell in cells if cell["method"] == method]
    exact, voxels = by("dag believe none"), by("dag believe all")
    own = sum(cell["lights"] == "own" for cell in exact)
    wrong_pairs = sum(cell["false_shadow_count"] + cell["false_light_count"] for cell in exact)
    beyond = lambda method: [cell for cell in by(method) if cell["false_shadow_share"] > 0.01 or cell["false_light_share"] > 0.01 or
                             cell["magnified_share"] > 0.002]
    powerless = lambda method: sum(cell.get("outline_null_rate", 0) > 0.5 for cell in by(method))
    magnified = max(voxels, key=lambda cell: cell["magnified_share"])
    named = lambda method, name: sum(cell["named_counts"].get(name, 0) for cell in by(method))
    excess = [cell for cell in cells if cell["explaining_has_power"] is False and cell["wrong_share"] > 0.01]
    within = [cell for cell in excess if cell not in beyond(cell["method"])]
    of, = {(cell["scene"], f"{100 * cell['wrong_share']:.1f} %") for cell in within}
    by_what = " and by the ".join(cell["method"] for cell in within)
    unnamed = {cell["scene"]: cell["unnamed_count"] for cell in cells if cell["unnamed_count"]}
    return {"docs/results.md": [
        f"four frames of {len(exact)} scenes that nobody here made: {own} with lights of their own, {len(exact) - own} under 16 lights",
        f"Rays that believe no voxel have {wrong_pairs} wrong pairs among {sum(cell['pair_count'] for cell in exact) / 1e6:.1f} million",
        *(f"is within it in all scenes but one (`{cell['scene']}`" for cell in beyond("hybrid")),
        f"Rays that believe all voxels exceed it in {len(beyond('dag believe all'))}",
        f"up to {100 * magnified['magnified_share']:.1f} % of the pairs are magnified (`{magnified['scene']}`)",
        f"in {powerless('maps')} of {len(exact)} scenes by maps, {powerless('dag believe all')} by voxels and {powerless('hybrid')} by the hybrid",
        f"{len(excess)} cells without power exceed that; all but `{of[0]}` by {by_what} ({of[1]}) exceed the tolerance, too",
        f"(`light-in-plane`): {named('maps', 'light-in-plane')} pairs",
        f"(`surface-behind`): {named('dag believe all', 'surface-behind')} pairs",
        f"(`surface-edge-on`): {named('dag believe all', 'surface-edge-on')} pairs",
        f"It names no reason for {sum(unnamed.values())} pairs with voxels"] + [f"`{scene}`" for scene in unnamed]}


def of_gpu(results):
    scenes = main_scenes(results, "_gpu")
    kept, cold, exact, voxel = "maps warm", "maps", "dag believe none", "dag 4096^3 believe all"
    ms = lambda label: {name: runs[label]["time_ms"] for name, runs in scenes.items()}
    whole = lambda value: f"{value:.0f}" if value >= 5 else f"{value:.1f}"
    times = {label: ms(label) for label in (kept, cold, exact, voxel)}
    drawn = [runs["hybrid texels:96 believe none"] for runs in scenes.values()]
    traced = [name for name, runs in scenes.items() if runs["hybrid texels:1536 believe none"]["drawn_map_count"] == 0]
    before, now = ({(row["scene"], row["method"]): row["stages_ms"] for row in json.loads((results / name).read_text())["frames"]}
                   ["necropolis", "maps"] for name in ("gpu_before.json", "gpu.json"))
    return {"docs/results.md": [
        f"the update of the scene took {before['scene update']:.2f} ms and the commit of pages {before['page commit']:.2f} ms",
        f"after it {now['scene update']:.2f} and {now['page commit']:.2f} ms",
        f"went from {before['batch boxes']:.2f} to {now['batch boxes']:.2f} ms",
        f"Kept maps are the fastest frames everywhere: {span(times[kept].values(), '{:.1f}')} ms, "
        f"{span([times[kept][name] / times[voxel][name] for name in scenes])} of the time of voxel rays",
        f"with {min(wrong(runs[kept]) for runs in scenes.values()):.2f} to {max(wrong(runs[kept]) for runs in scenes.values()):.1f} % of the pairs wrong where "
        f"voxel rays have {min(wrong(runs[voxel]) for runs in scenes.values()):.1f} to {max(wrong(runs[voxel]) for runs in scenes.values()):.0f} %",
        f"Maps that are drawn anew take {whole(min(times[cold].values()))} to {whole(max(times[cold].values()))} ms",
        f"Exact rays take {span([times[exact][name] / times[voxel][name] for name in scenes], '{:.1f}')} times as long as voxel rays there",
        f"draw {100 * min(run['drawn_map_count'] / (run['drawn_map_count'] + run['traced_map_count']) for run in drawn):.0f} to 100 % of the maps",
        f"1536 texels trace every light in {listed(sorted(traced))}"] + [
        f"`{name}` ({whole(times[cold][name])} against {whole(times[exact][name])}" for name in scenes]}


def of_provenance(results):
    """Which files are of scenes that have changed since, of which device the chart of a GPU is, and what the page commits of one are."""
    old = {"b77c069f4094", "151d14fbff59"}  # commits before lights hung in lanterns: the last of files that are not measured anew
    load = lambda path: json.loads(path.read_text())
    committed = {row["frame"]: row for row in load(results / "figure_11_sparse.json")["sequence_runs"] if row["label"] == "PMCD-EB-SO-1SM"}
    pages = [sum(row[f"pages_{kind}_count"] for row in committed.values()) for kind in ("committed", "freed")]
    commits = span([row["stages_ms"]["page commit"] for row in committed.values()], "{:.1f}")
    provenances = {path.stem: data["provenance"] for path in sorted(results.glob("*.json"))
                   if isinstance(data := load(path), dict) and isinstance(data.get("provenance"), dict)}
    stale = [name for name, provenance in provenances.items() if provenance.get("commit") in old]
    device, = {provenances[name]["device"].removeprefix("NVIDIA ") for name in ("main_gpu", "main_placed_gpu")}
    return {"docs/results.md": ([f"{listed(stale)} are older than 24 November 2026"] if stale else []) + [
        f"On an {device} at 1920 x 1080", f"{pages[0]} pages are committed and {pages[1]} freed, which takes {commits} ms per frame"]}


def of_scale(results):
    """Where rays through voxels become faster than Embree's packets, and both at the largest number of triangles."""
    found = {crossover["method"]: crossover for crossover in json.loads((results / "scale.json").read_text())["crossovers"]
             if crossover["row"] == "atrium-tessellated"}
    kinds = [found[f"voxels {side}"]["kind"] for side in (1024, 2048, 4096, 8192)]
    exact = found["exact rays"]
    most = exact["largest_triangle_count"] / 1e6
    if kinds != ["everywhere", "from", "never", "never"] or not exact["are_apart"]:
        return {"docs/results.md": [f"crossovers are now {kinds}: rewrite 'More triangles, the same voxels'"]}
    return {"docs/results.md": [
        f"at 1024^3 everywhere, at 2048^3 from {found['voxels 2048']['triangle_count'] / 1e6:.2f} million triangles on, at 4096^3 and "
        f"8192^3 nowhere up to {most:.1f} million",
        f"Exact rays take {exact['ns_per_pair']:.0f} ns a pair at {most:.1f} million triangles and Embree's packets "
        f"{exact['embree_ns_per_pair']:.0f}"]}


def of_mechanisms(results):
    rows = {row["name"]: row for row in json.loads((results / "mechanisms.json").read_text())["mechanisms"]}
    own, time, error = (lambda name, key=key: rows[name][key] for key in ("own_ratio", "time_ratio", "error_ratio"))
    drop = lambda name: f"{100 * (1 - own(name)):.0f} %"
    of_scenes = lambda name, key: span([scene[key] for scene in rows[name]["scenes"] if not scene["is_failure"]])
    return {"docs/results.md": [
        f"four maps per light take {of_scenes('four-maps', 'own_ratio')} of the memory, the paper's 96 texels "
        f"{of_scenes('hybrid-over-rays', 'time_ratio')} times the time of rays alone",
        f"takes {time('static-optimization'):.2f} of the time. Keeping resolutions takes another {time('held-resolutions'):.2f}",
        f"Pages of 64, 32 and 16 texels take {own('small-pages'):.2f}, {own('smaller-pages'):.2f} and {own('smallest-pages'):.2f} of the memory",
        f"the last step takes {time('smallest-pages'):.2f} of the time",
        f"Pages for what samples look up take {own('lookup-pages'):.2f} of the texels of pages for all that boxes of clusters cover, and "
        f"{time('lookup-pages'):.2f} of the time",
        f"saves {drop('facing-pruning')} of texels and memory for {100 * (error('facing-pruning') - 1):.0f} % more error",
        f"take {own('four-maps'):.2f} of the memory for {error('four-maps'):.1f} times the error",
        f"undersampling by two takes {own('half-resolution'):.2f} of it for {error('half-resolution'):.2f} times the error",
        f"simplified triangles are {own('polygon-lod'):.2f} of the triangles for {error('polygon-lod'):.1f} times the error",
        f"Four taps have {drop('four-taps')} fewer wrong pairs than one tap",
        f"a FLIP that is {100 * (error('nine-taps') - 1):.0f} % higher",
        f"Rays alone take {time('all-rays'):.2f} of the time of maps alone and {rows['all-rays']['bytes_ratio']:.2f} of their memory, "
        f"with {error('all-rays'):.2f} times the error ({of_scenes('all-rays', 'error_ratio')})",
        f"The paper's 96 texels take {time('hybrid-over-rays'):.1f} times the time of these rays"]}


def prose_of(results):
    """Returns {document: texts} from the folder of committed results."""
    texts = {}
    for part in (of_main, of_tracers, of_streams, of_adjudication, of_believe, of_beams, of_animations, of_regret, of_paper, of_flicker, of_stability, of_real, of_gpu, of_provenance, of_scale, of_mechanisms):
        for document, stated in part(results).items():
            texts.setdefault(document, []).extend(stated)
    return texts


def check_prose(document, text, stated):
    """Returns the texts that a document lacks or states differently."""
    flat = " ".join(text.split())
    return [f"{document}: does not say '{claim}', as the committed results do" for claim in stated if claim not in flat]
