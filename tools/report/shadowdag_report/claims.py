# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of measured claims into a Markdown file from the result files that are committed as data.

    claims docs/results.md tests/bench/results [--check]

Reads `main.json` and `main_placed.json`, `main_1080p.json` and `main_placed_1080p.json`, every `compare-*.json`
(results.json of `shadowdag compare`), `validate-*.json` (`shadowdag validate --json`), `bench-voxel-*.json` (`shadowdag bench
voxel --json`) and, for what it says of wrong pairs of exact rays, `adjudication*.json` (`shadowdag study adjudication`) of the
folder and replaces the text between the two marker lines of the file; and the table of animations from `animations.json`, between
its own (animations.py). With --check nothing is written, and the file is refused when it differs from the generated text.
"""
import pathlib
import re

from . import animations
from .explained import explained_text, null_rate, null_text, share_text, unexplained_count, wrong_count
from .files import expecting, read_json, replace_marked
from .intervals import ends_text, interval_text, pair_time

BEGIN, END = "<!-- claims:begin -->", "<!-- claims:end -->"


def tracer_name(name):
    """Returns a tracer's name, ours marked as such."""
    ours = {"occluded": "voxel DAG, one by one (ours)"}
    if name.startswith("traceStream "):
        return "voxel DAG, stream, {} (ours)".format(name.removeprefix("traceStream "))
    return ours.get(name, name)


def machine_of(provenance):
    return "{cpu}, {thread_count} threads, {compiler}, commit {commit}".format(**provenance)


def compare_command(experiment, scene):
    """Returns the command that measures a scene by an experiment; it names the scene if the experiment's file names none."""
    named = read_json(experiment)["scenes"] if experiment.exists() else []
    return "shadowdag compare --experiment scenes/experiments/{} {}-o report".format(experiment.name, "" if named else scene + " ")


def compare_table(path, experiment):
    """Returns the lines of one compare result: one row per run. @param experiment the file that was measured"""
    result = read_json(path)
    lines = []
    for scene in dict.fromkeys((run["scene"], run["frame"]) for run in result["runs"]):
        runs = [run for run in result["runs"] if (run["scene"], run["frame"]) == scene]
        pairs = runs[0]["pair_count"]
        lines += ["", "**{}, frame {}: {:,} pairs, {:.1f} % of them dark.** `{}` ({})".format(
            scene[0].removeprefix("builtin:"), scene[1], pairs, 100.0 * runs[0]["occluded_count"] / pairs,
            compare_command(experiment, scene[0]), machine_of(result["provenance"])), "",
            "| run | ms, median (95 % interval) | n | over embree | false shadow | false light | mean error | magnified "
            "| unexplained | explained | null rate | acne | MiB |",
            "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"]
        for run in runs:
            lines.append("| {} | {} | {} | {} | {:.2f} % | {:.2f} % | {:.4f} | {} | {} | {} | {} | {} | {} |".format(
                run["label"], interval_text(run), run["repeat_count"],
                interval_text(run, "time_over_embree", 2) if "time_over_embree" in run else "–",
                100.0 * run["false_shadow_count"] / pairs, 100.0 * run["false_light_count"] / pairs,
                run["mean_abs_visibility_error"], run.get("magnified_count", "–"), unexplained_count(run),
                explained_text(run), null_text(run), run["acne_count"],
                "–" if run["method"] == "embree" and not run.get("exact_bytes") else  # the truth, in older results
                f'{(run["dag_bytes"] + run["map_bytes"] + run.get("exact_bytes", 0)) / 2.0**20:.1f}'))
    return lines


OVERVIEW = (("exact rays", "dag believe none"), ("voxel rays", "dag 4096^3 believe all"), ("maps, cold", "maps"), ("maps, warm", "maps warm"),
            ("hybrid 1536, cold", "hybrid texels:1536 believe none"), ("hybrid 1536, warm", "hybrid texels:1536 believe none warm"))
EXPLAINED_OF = (("voxel rays", "dag 4096^3 believe all"), ("maps", "maps"), ("hybrid 1536", "hybrid texels:1536 believe none"))
WRONG_OF = ("embree", "dag 4096^3 believe all", "maps", "hybrid texels:1536 believe none")


def label_of(run):
    """Returns the label of a run without the size of its pool, which is the same for a whole experiment."""
    return re.sub(r" pool \d+M", "", run["label"])


def percent_text(share):
    return "0" if share == 0 else "<0.001" if share < 1e-5 else "{:.2g}".format(100.0 * share)


def scene_stem(scene):
    return scene.removeprefix("builtin:").removesuffix(".glb")


def adjudicated_counts_text(asked, ambiguous, proven_wrong):
    """Returns a sentence about pairs that exact rays answer unlike the truth, "" for none."""
    if not asked:
        return ""
    return (f" The [adjudicator](adjudicator.md) was asked about {asked:,} of these pairs: {ambiguous:,} are ambiguous, "
            f"{proven_wrong:,} are wrong beyond doubt.")


def adjudicated_text(runs, folder):
    """Returns what the adjudicator says of the pairs that exact rays answer unlike the truth, "" where it was not asked.

    runs: of exact rays; in files older than this count their frames are those of the study of adjudications if their pairs are
    as many
    """
    if runs and all("adjudicated_count" in run for run in runs):
        return adjudicated_counts_text(*(sum(run[key] for run in runs)
                                         for key in ("adjudicated_count", "ambiguous_count", "proven_wrong_count")))
    disputes = {(v["scene"], v["disputed"]["frame_pair_count"]): v["disputed"] for path in sorted(folder.glob("adjudication*.json"))
                for v in read_json(path)["verdicts"]}
    wrong = [(run, disputes.get((scene_stem(run["scene"]), run["pair_count"]))) for run in runs if wrong_count(run)]
    asked = [disputed for run, disputed in wrong if disputed and disputed["count"] == wrong_count(run)]
    if not asked:
        return ""
    return (" The [adjudicator](adjudicator.md#results) was asked about {} of these pairs: {} are ambiguous; in {} the truth is right, in {} "
            "exact rays are.".format(*(sum(d[key] for d in asked) for key in (
                "count", "ambiguous_count", "truth_right_count", "exact_right_count"))))


def overview_table(paths):
    """Returns the lines of the results of a main chart, all of one size: one row per scene, times over Embree's frame of the same rounds."""
    results = [read_json(path) for path in paths]
    if not results:
        return []
    exact = [run for result in results for run in result["runs"] if run["label"] == "dag believe none"]
    lines = ["", "**{} scenes at {}, every method over Embree's frame in the same rounds** ({}): {}. *Warm*: the frame after one of "
             "the same view, whose maps are kept. *Explained*: the share of wrong pairs that the method's resolution explains; in brackets the "
             "null rate, the share of right pairs near outlines that would be explained as well (of a hybrid: of the pairs that the methods of its wrong pairs serve); *no power*: it is over half, or not below the "
             "explained share. Exact rays have {} wrong pairs of {:,}.{}".format(
                 len({run["scene"] for run in exact}), results[0]["experiment"]["size"].replace("x", " x "),
                 machine_of(results[0]["provenance"]),
                 " and, of scenes without lights, ".join(f"`compare --experiment scenes/experiments/{path.stem}.json`" for path in paths),
                 sum(map(wrong_count, exact)), sum(run["pair_count"] for run in exact),
                 adjudicated_text(exact, paths[0].parent)), "",
             "| scene | Embree's frame, ms | " + " | ".join(name for name, _ in OVERVIEW) + " | wrong pairs, %: Embree, voxel rays, maps, hybrid 1536 | "
             + " | ".join(f"explained (null rate): {name}" for name, _ in EXPLAINED_OF) + " |",
             "|---|" + "---:|" * (len(OVERVIEW) + 2 + len(EXPLAINED_OF))]
    for result in results:
        for scene in dict.fromkeys(run["scene"] for run in result["runs"]):
            runs = {label_of(run): run for run in result["runs"] if run["scene"] == scene}
            wrong = (percent_text(wrong_count(runs[label]) / runs[label]["pair_count"])
                     for label in WRONG_OF)
            lines.append("| {} | {} | {} | {} | {} |".format(
                scene_stem(scene), interval_text(runs["embree"]),
                " | ".join(interval_text(runs[label], "time_over_embree", 2) for _, label in OVERVIEW), ", ".join(wrong),
                " | ".join(f"{explained_text(runs[label])} ({share_text(null_rate(runs[label]))})"
                           for _, label in EXPLAINED_OF)))
    return lines


def frame_table(frame, repeat_count):
    """Returns the lines of a bench's whole frame: how similar the pairs of a cluster are, then one row per method.

    repeat_count: of the bench
    """
    if not frame:
        return []
    lines = ["", "All {:,} pairs of a frame of {} x {}, one thread, visibility only. Of the pairs {:.1f} % lie in a cluster-light "
             "pair that is wholly lit and {:.1f} % in one wholly dark. {}".format(
                 frame["pair_count"], frame["width"], frame["height"], 100.0 * frame["true_lit_share"],
                 100.0 * frame["true_dark_share"],
                 "" if "exact_wrong_count" not in frame else  # older results have no exact streams
                 "Embree and `streams` trace the segments of voxel rays, which begin an offset above the surface; exact streams begin "
                 "on it and differ from the truth in {:,} pairs.".format(frame["exact_wrong_count"])).rstrip(), "",
             "| whole frame by | ns a pair, median (95 % interval) | n | speed, rtcOccluded16 = 1 | answers unlike Embree's |",
             "|---|---:|---:|---:|---:|"]
    for method in frame["methods"]:
        timed = pair_time(method, repeat_count)
        speed = interval_text(method, "embree_over_it", 2) if "embree_over_it_low" in method else f'{method["embree_over_it"]:.2f}'
        lines.append("| {} | {} | {} | {} | {:.2f} % |".format(
            method["method"], interval_text(timed, "ns_per_pair", 1), timed["repeat_count"], speed, 100.0 * method["disagreement_share"]))
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
    lines = ["", "**{} at {}³: {:,} voxels in {:.1f} CPU-s ({}, n = {}), {:.2f} MiB as traced words, {:.3f} bit a "
             "voxel.** `shadowdag bench voxel {} --resolution {}{} --nanovdb-limit 4096{}` ({})".format(
                 result["scene"].removeprefix("builtin:"), result["resolution"], build["voxel_count"],
                 build["cpu_s"], ends_text(build, "cpu_s", 1), build["repeat_count"], build["traced_bytes"] / 2.0**20,
                 build["traced_bits_per_voxel"], result["scene"], result["resolution"], lights, sizes,
                 machine_of(result["provenance"])), "",
             "{:,} rays of a frame, cluster order, one thread; ours is dark where Embree is lit for {:.2f} % of them and "
             "never lit where Embree is dark.".format(rays, 100.0 * checks["false_shadow_count"] / rays)
             if checks["false_light_count"] == 0 else
             "{:,} rays of a frame, cluster order, one thread; false shadow {:.2f} %, false light {} rays.".format(
                 rays, 100.0 * checks["false_shadow_count"] / rays, checks["false_light_count"]), "",
             "| tracer | M rays a second and core, median (95 % interval) | n | ours over it |", "|---|---:|---:|---:|"]
    for rate in result["rates"]:
        if rate["order"] == "cluster" and rate["tracer"] != "traceSegments":
            repeated = {"repeat_count": result["repeat_count"]} | rate
            lines.append("| {} | {} | {} | {:.2f} |".format(
                tracer_name(rate["tracer"]), interval_text(repeated, "megarays_per_s", 2), repeated["repeat_count"],
                rate["ours_over_it"]))
    lines += frame_table(result.get("frame"), result["repeat_count"])
    return lines


def validate_table(paths):
    """Returns the lines of all validate results, validate-SCENE-METHOD.json: one row per scene and method."""
    lines = ["", "**Held against Embree, pair by pair**, 640 x 360, by `shadowdag validate SCENE`; rays with `--resolution 4096`.", "",
             "| scene | method | pairs | false shadow | false light | magnified | unexplained (settled) | explained | null rate "
             "| acne | contact |",
             "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"]
    for path in paths:
        result = read_json(path)
        pairs = result["pair_count"]
        scene, _, method = path.stem.removeprefix("validate-").partition("-")
        lines.append("| {} | {} | {:,} | {:.2f} % | {:.2f} % | {} | {} ({}) | {} | {} | {} | {} |".format(
            scene, method.replace("dag-", "dag believe "), pairs,
            100.0 * result["false_shadow_count"] / pairs, 100.0 * result["false_light_count"] / pairs, result.get("magnified_count", "–"),
            unexplained_count(result), result["settled_false_shadow_count"] + result.get("settled_false_light_count", 0),
            explained_text(result), null_text(result), result["acne_count"], result["contact_count"]))
    return lines


def parts_table(folder):
    """Returns the lines of bench-shading-SCENE and bench-raster-SCENE: what frames do beside their rays, one row per scene."""
    paths = sorted(folder.glob("bench-shading-*.json"))
    if not paths:
        return []
    first = read_json(paths[0])
    lines = ["", "**What frames do beside their rays**, {} x {}, ns of one thread (median, 95 % interval, n = {}), verified first; the "
             "G-buffer in ms on {} threads. `shadowdag bench shading SCENE --size {}x{}` and `bench raster SCENE` ({})".format(
                 first["width"], first["height"], first["repeat_count"], first["thread_count"], first["width"], first["height"],
                 machine_of(first["provenance"])), "",
             "| scene | marking and colour, a pair | lookup of 1 tap, a pair | 4 taps | 9 taps | G-buffer, ms | rasterization, a triangle | a texel |",
             "|---|" + "---:|" * 7]
    for path in paths:
        shading, scene = read_json(path), path.stem.removeprefix("bench-shading-")
        each = ["{ns_each:.1f} ({ns_each_low:.1f} to {ns_each_high:.1f})".format(**row) for row in shading["rows"]]
        raster = folder / f"bench-raster-{scene}.json"
        fit = read_json(raster)["fit"] if raster.exists() else {}
        lines.append("| {} | {} | {:.1f} | {} | {} |".format(
            scene, " | ".join(each), shading["frame"]["stages_ms"]["g-buffer"],
            *("–" if fit.get(key) is None else f"{fit[key]:.1f}" for key in ("ns_per_triangle", "ns_per_texel"))))
    return lines


def module_table(path):
    """Returns the lines of tests/bench/module.py: opening assets, and frames through the Python module."""
    result = read_json(path)
    opened, frames = result["assets"], result["frames"]
    ranged = lambda row, key, digits: f"{row[key]:.{digits}f} ({row[key + '_min']:.{digits}f} to {row[key + '_max']:.{digits}f})"
    rows = {}
    for frame in frames:
        rows.setdefault((frame["scene"], frame["size"]), []).append(ranged(frame, "call_over_renderer", 3))
    methods = list(dict.fromkeys(frame["method"] for frame in frames))
    return ["", "**Opening an asset**, 4096³, packed fast, each time in a new process, the file in the system's cache: ms until all of it is "
            "read and verified, and until the first rays are traced; median, least and greatest of {}. `python3 tests/bench/module.py` "
            "({})".format(opened[0]["repeat_count"], machine_of(result["provenance"])), "",
            "| scene | file, MiB | read | first rays | both |", "|---|---:|---:|---:|---:|",
            *("| {} | {:.1f} | {} | {} | {} |".format(row["scene"].removeprefix("builtin:"), row["asset_bytes"] / 2.0**20,
                                                     *(ranged(row, key, 1) for key in ("read_ms", "first_rays_ms", "open_ms"))) for row in opened),
            "", "**A frame through the Python module**, of the same run: wall clock of the call over that of the renderer inside it; median, "
            "least and greatest of {}.".format(frames[0]["repeat_count"]), "",
            "| scene | size | " + " | ".join(methods) + " |", "|---|---|" + "---:|" * len(methods),
            *("| {} | {} | {} |".format(scene.removeprefix("builtin:"), size, " | ".join(cells)) for (scene, size), cells in rows.items())]


def provenance_table(folder):
    """Returns which files are of which commit, processor and device, by these."""
    files = {}
    for path in sorted(folder.glob("*.json")):
        result = read_json(path)
        provenance = result.get("provenance") if isinstance(result, dict) else None
        of = provenance if isinstance(provenance, dict) else result if isinstance(result, dict) else {}
        device = of.get("device")
        device = ", ".join(map(str, device.values())) if isinstance(device, dict) else device
        key = (of.get("commit") or "not recorded", "; ".join(text for text in (of.get("cpu"), device) if text) or "not recorded")
        files.setdefault(key, []).append(path.stem)
    return ["", "**Where each result file is from.**", "", "| commit | processor; device | files |", "|---|---|---|",
            *("| {} | {} | {} |".format(*key, ", ".join(names)) for key, names in sorted(files.items(), key=lambda row: row[1]))]


def claims(folder):
    """Returns everything between the markers."""
    lines = []
    for size in ("", "_1080p"):
        lines += overview_table([path for path in (folder / f"main{size}.json", folder / f"main_placed{size}.json") if path.exists()])
    for path in sorted(folder.glob("compare-*.json")):
        experiment = folder.resolve().parents[2] / "scenes/experiments" / path.name.removeprefix("compare-")
        lines += compare_table(path, experiment)
    validations = sorted(folder.glob("validate-*.json"))
    if validations:
        lines += validate_table(validations)
    for path in sorted(folder.glob("bench-voxel-*.json")):
        lines += bench_table(path)
    lines += parts_table(folder)
    if (folder / "module.json").exists():
        lines += module_table(folder / "module.json")
    lines += provenance_table(folder)
    return "\n".join(lines) + "\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("folder", type=pathlib.Path, help="the folder of the result files")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    document, folder = arguments.document, arguments.folder
    with expecting(folder, "a folder of results that the tables are made of"):
        parts = {(BEGIN, END): claims(folder)}
        if (folder / "animations.json").exists():
            parts[animations.BEGIN, animations.END] = animations.table(read_json(folder / "animations.json"))
    for markers, text in parts.items():
        replace_marked(document, markers, text, arguments.check, f"the tables of {folder}; write them with the command claims")
