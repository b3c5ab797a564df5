# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of measured claims into a Markdown file from the result files that are committed as data.

    claims docs/results.md tests/bench/results [--check]

Reads every `compare-*.json` (results.json of `shadowdag compare`), `validate-*.json` (`shadowdag validate --json`) and
`bench-voxel-*.json` (`shadowdag bench voxel --json`) of the folder and replaces the text between the two marker lines
of the file. With --check nothing is written, and the file is refused when it differs from the generated text.
"""
import pathlib

from .files import Refused, expecting, read_json, write_text

BEGIN, END = "<!-- claims:begin -->", "<!-- claims:end -->"


def tracer_name(name):
    """Returns a tracer's name, ours marked as such."""
    ours = {"occluded": "voxel DAG, one by one (ours)"}
    if name.startswith("traceStream "):
        return "voxel DAG, stream, {} (ours)".format(name.removeprefix("traceStream "))
    return ours.get(name, name)


def machine_of(provenance):
    return "{cpu}, {thread_count} threads, {compiler}, commit {commit}".format(**provenance)


def compare_table(path, command):
    """Returns the lines of one compare result: one row per run."""
    result = read_json(path)
    lines = []
    for scene in dict.fromkeys((run["scene"], run["frame"]) for run in result["runs"]):
        runs = [run for run in result["runs"] if (run["scene"], run["frame"]) == scene]
        pairs = runs[0]["pair_count"]
        lines += ["", "**{}, frame {}: {:,} pairs, {:.1f} % of them dark.** `{}` ({})".format(
            scene[0].removeprefix("builtin:"), scene[1], pairs, 100.0 * runs[0]["occluded_count"] / pairs, command,
            machine_of(result["provenance"])), "",
            "| run | ms, median (min to max) | false shadow | false light | mean error | magnified | unexplained | acne | MiB |",
            "|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
        for run in runs:
            unexplained = run["unexplained_false_shadow_count"] + run["unexplained_false_light_count"]
            lines.append("| {} | {:.0f} ({:.0f} to {:.0f}) | {:.2f} % | {:.2f} % | {:.4f} | {} | {} | {} | {} |".format(
                run["label"], run["time_ms"], run["time_ms_min"], run["time_ms_max"],
                100.0 * run["false_shadow_count"] / pairs, 100.0 * run["false_light_count"] / pairs,
                run["mean_abs_visibility_error"], run.get("magnified_count", "–"), unexplained, run["acne_count"],
                "–" if run["method"] == "embree" and not run.get("exact_bytes") else  # the truth, in older results
                f'{(run["dag_bytes"] + run["map_bytes"] + run.get("exact_bytes", 0)) / 2.0**20:.1f}'))
    return lines


def frame_table(frame):
    """Returns the lines of a bench's whole frame: how similar the pairs of a cluster are, then one row per method."""
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


def bench_table(path):
    """Returns the lines of one bench: the build, then one row per tracer."""
    result = read_json(path)
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
                 machine_of(result["provenance"])), "",
             "{:,} rays of a frame, cluster order, one thread; ours is dark where Embree is lit for {:.2f} % of them and "
             "never lit where Embree is dark.".format(rays, 100.0 * checks["false_shadow_count"] / rays)
             if checks["false_light_count"] == 0 else
             "{:,} rays of a frame, cluster order, one thread; false shadow {:.2f} %, false light {} rays.".format(
                 rays, 100.0 * checks["false_shadow_count"] / rays, checks["false_light_count"]), "",
             "| tracer | M rays a second and core, median (min to max) | ours over it |", "|---|---:|---:|"]
    for rate in result["rates"]:
        if rate["order"] == "cluster" and rate["tracer"] != "traceSegments":
            lines.append("| {} | {:.2f} ({:.2f} to {:.2f}) | {:.2f} |".format(
                tracer_name(rate["tracer"]), rate["megarays_per_s"],
                rate["megarays_per_s_min"], rate["megarays_per_s_max"], rate["ours_over_it"]))
    lines += frame_table(result.get("frame"))
    return lines


def validate_table(paths):
    """Returns the lines of all validate results, validate-SCENE-METHOD.json: one row per scene and method."""
    lines = ["", "**Held against Embree, pair by pair**, 640 x 360, by `shadowdag validate SCENE`; rays with `--resolution 4096`.", "",
             "| scene | method | pairs | false shadow | false light | magnified | unexplained (settled) | acne | contact |",
             "|---|---|---:|---:|---:|---:|---:|---:|---:|"]
    for path in paths:
        result = read_json(path)
        pairs = result["pair_count"]
        scene, _, method = path.stem.removeprefix("validate-").partition("-")
        lines.append("| {} | {} | {:,} | {:.2f} % | {:.2f} % | {} | {} ({}) | {} | {} |".format(
            scene, method.replace("dag-", "dag believe "), pairs,
            100.0 * result["false_shadow_count"] / pairs, 100.0 * result["false_light_count"] / pairs, result.get("magnified_count", "–"),
            result["unexplained_false_shadow_count"] + result["unexplained_false_light_count"],
            result["settled_false_shadow_count"] + result.get("settled_false_light_count", 0), result["acne_count"], result["contact_count"]))
    return lines


def claims(folder):
    """Returns everything between the markers."""
    lines = []
    for path in sorted(folder.glob("compare-*.json")):
        experiment = path.stem.removeprefix("compare-")
        command = "shadowdag compare --experiment scenes/experiments/{}.json -o report".format(experiment)
        lines += compare_table(path, command)
    validations = sorted(folder.glob("validate-*.json"))
    if validations:
        lines += validate_table(validations)
    for path in sorted(folder.glob("bench-voxel-*.json")):
        lines += bench_table(path)
    return "\n".join(lines) + "\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("folder", type=pathlib.Path, help="the folder of the result files")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    document, folder = arguments.document, arguments.folder
    with expecting(document, "a text file"):
        text = pathlib.Path(document).read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise Refused(f"{document}: needs exactly one line '{BEGIN}' and one '{END}'")
    head, rest = text.split(BEGIN)
    with expecting(folder, "a folder of results that the tables are made of"):
        updated = head + BEGIN + "\n" + claims(folder) + "\n" + END + rest.split(END)[1]
    if arguments.check and updated != text:
        raise Refused(f"{document}: its tables are not those of {folder}; write them with the command claims")
    if not arguments.check:
        write_text(document, updated)
