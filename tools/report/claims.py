#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of measured claims into README.md from the result files that are committed as data.

usage: claims.py README RESULTS_FOLDER [--check]

Reads every `compare-*.json` (results.json of `shadowdag compare`), `validate-*.json` (`shadowdag validate --json`) and
`bench-voxel-*.json` (`shadowdag bench voxel --json`) of the folder and replaces what stands between the two marker lines of README. With --check nothing is written and the
exit status is 1 when README differs from what would be written.
"""
import json
import pathlib
import sys

BEGIN, END = "<!-- claims:begin -->", "<!-- claims:end -->"


def tracerName(name):
    """Returns a tracer's name, ours marked as such."""
    ours = {"occluded": "voxel DAG, one by one (ours)"}
    if name.startswith("traceStream "):
        return "voxel DAG, stream, {} (ours)".format(name.removeprefix("traceStream "))
    return ours.get(name, name)


def machineOf(provenance):
    return "{cpu}, {thread_count} threads, {compiler}, commit {commit}".format(**provenance)


def compareTable(path, command):
    """Returns the lines of one compare result: a row a run."""
    result = json.loads(path.read_text())
    lines = []
    for scene in dict.fromkeys((run["scene"], run["frame"]) for run in result["runs"]):
        runs = [run for run in result["runs"] if (run["scene"], run["frame"]) == scene]
        pairs = runs[0]["pair_count"]
        lines += ["", "**{}, frame {}: {:,} pairs, {:.1f} % of them dark.** `{}` ({})".format(
            scene[0].removeprefix("builtin:"), scene[1], pairs, 100.0 * runs[0]["occluded_count"] / pairs, command,
            machineOf(result["provenance"])), "",
            "| run | ms, median (min to max) | false shadow | false light | mean error | unexplained | acne | MiB |",
            "|---|---:|---:|---:|---:|---:|---:|---:|"]
        for run in runs:
            unexplained = run["unexplained_false_shadow_count"] + run["unexplained_false_light_count"]
            lines.append("| {} | {:.0f} ({:.0f} to {:.0f}) | {:.2f} % | {:.2f} % | {:.4f} | {} | {} | {:.1f} |".format(
                run["label"], run["time_ms"], run["time_ms_min"], run["time_ms_max"],
                100.0 * run["false_shadow_count"] / pairs, 100.0 * run["false_light_count"] / pairs,
                run["mean_abs_visibility_error"], unexplained, run["acne_count"],
                (run["dag_bytes"] + run["map_bytes"]) / 2.0**20))
    return lines


def frameTable(frame):
    """Returns the lines of a bench's whole frame: how alike the pairs of a cluster are, then a row a method."""
    if not frame:
        return []
    lines = ["", "All {:,} pairs of a frame of {} x {}, one thread, visibility only. Of the pairs {:.1f} % lie in a cluster-light "
             "pair that is wholly lit and {:.1f} % in one wholly dark.".format(
                 frame["pair_count"], frame["width"], frame["height"], 100.0 * frame["true_lit_share"],
                 100.0 * frame["true_dark_share"]), "",
             "| whole frame by | ns a pair | speed, rtcOccluded16 = 1 | answers unlike Embree's |", "|---|---:|---:|---:|"]
    for method in frame["methods"]:
        lines.append("| {} | {:.1f} | {:.2f} | {:.2f} % |".format(
            method["method"], method["ns_per_pair"], method["embree_over_it"], 100.0 * method["disagreement_share"]))
    return lines


def benchTable(path):
    """Returns the lines of one bench: the build, then a row a tracer."""
    result = json.loads(path.read_text())
    build, checks, rays = result["voxelize"], result["checks"], result["ray_count"]
    lights = " --lights {}".format(result["lights"]) if result["lights"] else ""
    frame = result.get("frame", {})
    sizes = " --size {}x{}".format(result["width"], result["height"]) if frame else ""
    if frame and frame["width"] != result["width"]:
        sizes += " --frame-size {}x{}".format(frame["width"], frame["height"])
    lines = ["", "**{} at {}³: {:,} voxels in {:.1f} CPU-s ({:.1f} to {:.1f}), {:.2f} MiB as traced words, {:.3f} bit a "
             "voxel.** `shadowdag bench voxel {} --resolution {}{} --nanovdb-limit 4096{}` ({})".format(
                 result["scene"].removeprefix("builtin:"), result["resolution"], build["voxel_count"], build["cpu_s"],
                 build["cpu_s_min"], build["cpu_s_max"], build["traced_bytes"] / 2.0**20,
                 build["traced_bits_per_voxel"], result["scene"], result["resolution"], lights, sizes,
                 machineOf(result["provenance"])), "",
             "{:,} rays of a frame, cluster order, one thread; ours is dark where Embree is lit for {:.2f} % of them and "
             "never lit where Embree is dark.".format(rays, 100.0 * checks["false_shadow_count"] / rays)
             if checks["false_light_count"] == 0 else
             "{:,} rays of a frame, cluster order, one thread; false shadow {:.2f} %, false light {} rays.".format(
                 rays, 100.0 * checks["false_shadow_count"] / rays, checks["false_light_count"]), "",
             "| tracer | M rays a second and core, median (min to max) | ours over it |", "|---|---:|---:|"]
    for rate in result["rates"]:
        if rate["order"] == "cluster" and rate["tracer"] != "traceSegments":
            lines.append("| {} | {:.2f} ({:.2f} to {:.2f}) | {:.2f} |".format(
                tracerName(rate["tracer"]), rate["megarays_per_s"],
                rate["megarays_per_s_min"], rate["megarays_per_s_max"], rate["ours_over_it"]))
    lines += frameTable(result.get("frame"))
    return lines


def validateTable(paths):
    """Returns the lines of all validate results: a row a scene and method."""
    lines = ["", "**Held against Embree, pair by pair**, 640 x 360, by `shadowdag validate SCENE --method METHOD`.", "",
             "| scene | method | pairs | false shadow | false light | unexplained (settled) | acne | contact |",
             "|---|---|---:|---:|---:|---:|---:|---:|"]
    for path in paths:
        result = json.loads(path.read_text())
        pairs = result["pair_count"]
        lines.append("| {} | {} | {:,} | {:.2f} % | {:.2f} % | {} ({}) | {} | {} |".format(
            path.stem.removeprefix("validate-").removesuffix("-" + result["method"]), result["method"], pairs,
            100.0 * result["false_shadow_count"] / pairs, 100.0 * result["false_light_count"] / pairs,
            result["unexplained_false_shadow_count"] + result["unexplained_false_light_count"],
            result["settled_false_shadow_count"] + result.get("settled_false_light_count", 0), result["acne_count"], result["contact_count"]))
    return lines


def claims(folder):
    """Returns everything between the markers."""
    lines = []
    for path in sorted(folder.glob("compare-*.json")):
        experiment = path.stem.removeprefix("compare-")
        command = "shadowdag compare --experiment scenes/experiments/{}.json -o report".format(experiment)
        lines += compareTable(path, command)
    validations = sorted(folder.glob("validate-*.json"))
    if validations:
        lines += validateTable(validations)
    for path in sorted(folder.glob("bench-voxel-*.json")):
        lines += benchTable(path)
    return "\n".join(lines) + "\n"


def main(arguments):
    names = [a for a in arguments if a != "--check"]
    if len(names) != 2:
        print(__doc__, file=sys.stderr)
        return 1
    readme, folder = pathlib.Path(names[0]), pathlib.Path(names[1])
    text = readme.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        print(f"{readme}: needs exactly one line '{BEGIN}' and one '{END}'", file=sys.stderr)
        return 1
    head, rest = text.split(BEGIN)
    updated = head + BEGIN + "\n" + claims(folder) + "\n" + END + rest.split(END)[1]
    if "--check" in arguments:
        if updated != text:
            print(f"{readme}: its tables are not those of {folder}; run tools/report/claims.py {readme} {folder}", file=sys.stderr)
            return 1
        return 0
    readme.write_text(updated)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
