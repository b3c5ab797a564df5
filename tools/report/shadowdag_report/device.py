# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of a GPU in docs/results.md from what tools/gpu_check measured there.

    device docs/results.md tests/bench/results/gpu.json [gpu_profiles.json gpu_sanitizers.json] [--check]

The other files are of runs of profiles or sanitizers, which have no time beside the rest: each table is of the first file that
has it. With --check nothing is written, and the file is refused when it differs from the generated text.
"""
import re

from .files import expecting, read_json, replace_marked

BEGIN, END = "<!-- device:begin -->", "<!-- device:end -->"
LATE = re.compile(r"took more than|no time left")
METHODS = {"dag": "voxel rays, all believed", "exact": "exact rays", "maps": "maps", "hybrid": "hybrid, 96 texels"}
# Stages by what they are for; those not named here are the rest.
GROUPS = {"G-buffer, clusters, pairs": ("g-buffer", "clusters", "light assignment", "pair pruning", "resolution"),
          "pages, culling": ("page masks", "page commit", "page clear", "culling masks", "culling query", "culling tests"),
          "rasterization": ("rasterization",), "shading": ("shading",)}


def milliseconds(value):
    return f"{value:.2f}"


def frames_table(rows):
    """Returns the lines of the table of frames."""
    named = {stage for stages in GROUPS.values() for stage in stages}
    lines = ["| scene | method | frame | slowest | " + " | ".join(GROUPS) + " | other stages | million pairs |",
             "|---|---|" + "---:|" * (len(GROUPS) + 4)]
    for row in rows:
        stages = row["stages_ms"]
        parts = [sum(stages.get(stage, 0.0) for stage in group) for group in GROUPS.values()]
        parts.append(sum(ms for stage, ms in stages.items() if stage not in named))
        lines.append("| {} | {} | {} | {} | {} | {:.1f} |".format(
            row["scene"], METHODS[row["method"]], milliseconds(row["wall_ms"]), milliseconds(row["wall_ms_max"]),
            " | ".join(map(milliseconds, parts)), row["pair_count"] / 1e6))
    return lines


def rays_table(rows):
    """Returns the lines of the table of rays."""
    lines = ["| scene | rays | order | ours | NanoVDB's HDDA | ours / it |", "|---|---:|---|---:|---:|---:|"]
    for row in rows:
        by_order = {}
        for rate in row["rates"]:
            by_order.setdefault(rate["order"], {})[rate["tracer"]] = rate
        for order, rates in by_order.items():
            ours, theirs = rates["traceSegments"], rates.get("NanoVDB HDDA")
            lines.append("| {} | {:.1f} million | {} | {:,.0f} ({:,.0f} to {:,.0f}) | {} | {} |".format(
                row["scene"], row["ray_count"] / 1e6, order, ours["megarays_per_s"], ours["megarays_per_s_min"],
                ours["megarays_per_s_max"], f'{theirs["megarays_per_s"]:,.0f}' if theirs else "too large",
                f'{theirs["ours_over_it"]:.2f}' if theirs else ""))
    return lines


def voxels_table(rows):
    """Returns the lines of the table of builds."""
    scenes = {}
    for row in rows:
        scenes.setdefault(row["scene"], {})[row["backend"]] = row
    lines = ["| scene | voxels per axis | million voxels | CPU, s | CUDA, s |", "|---|---:|---:|---:|---:|"]
    for scene, by in scenes.items():
        lines.append("| {} | {} | {:.1f} | {:.2f} | {:.2f} |".format(
            scene, by["cuda"]["resolution"], by["cuda"]["voxel_count"] / 1e6, by["cpu"]["wall_s"], by["cuda"]["wall_s"]))
    return lines


def kernel_name(name):
    """Returns the short name of a kernel: of one of all passes the pass, of CUB's its algorithm."""
    shared = re.search(r"(?:parallelFor|shareParts)Kernel<[^,]*, (?:\w+::)*(\w+)>", name)
    if shared:
        return shared[1]
    plain = re.search(r"(?:^|[ :])(\w+?)(?:Kernel)?(<[^<>(]*>)?(?:<.*)?\(", name)
    return re.sub(r"\w+::", "", plain[1] + (plain[2] or "")) if plain else name.split("(")[0]


def kernels_table(profiles, most=8):
    """Returns the lines of the table of the kernels that take most of a warm frame."""
    lines = ["| scene | method | kernel | launches | µs | memory, % | occupancy, % | active lanes |",
             "|---|---|---|" + "---:|" * 5]
    for profile in profiles:
        kernels = profile["kernels"]
        for row in kernels[:most]:
            lines.append("| {} | {} | `{}` | {} | {:.0f} | {:.0f} | {:.0f} | {:.1f} |".format(
                profile["scene"], METHODS[profile["method"]], kernel_name(row["kernel"]), row["launches"], row["us"],
                row["memory_percent"], row["occupancy_percent"], row["active_lanes"]))
        rest = kernels[most:]
        if rest:
            lines.append("| {} | {} | {} others | {} | {:.0f} | | | |".format(
                profile["scene"], METHODS[profile["method"]], len(rest), sum(row["launches"] for row in rest),
                sum(row["us"] for row in rest)))
    return lines


def sanitizers_table(steps):
    """Returns the lines of the table of sanitizers, one row for each test program."""
    tools = ("memcheck", "racecheck", "initcheck", "synccheck")
    cells = {}
    for step in steps:
        tool, _, program = step["step"].partition(" ")
        if tool in tools:
            found = re.search(r"ERROR SUMMARY: (\d+)", step["note"])
            cells.setdefault(program, {})[tool] = (
                f'none, {step["note"].split()[0]} passed' if step["ok"] else
                "no time" if LATE.search(step["note"]) else f"{int(found[1]):,}" if found else "failed")
    return ["| findings in | " + " | ".join(tools) + " |", "|---|" + "---|" * len(tools),
            *(f"| `{program}` | " + " | ".join(row.get(tool, "") for tool in tools) + " |" for program, row in cells.items())]


def text_of(results, *others):
    """Returns everything between the markers. others: the results of more runs, for the tables that `results` does not have"""
    def source(has):
        return next((run for run in (results, *others) if has(run)), None)

    def origin(run):
        return "" if run is results else f' ({run["device"]["nvidia_smi"].split(",")[0]}, commit {run["commit"]})'

    is_check = re.compile(r"\w+check ").match
    traced, profiled = source(lambda run: run.get("rays")), source(lambda run: run.get("profiles"))
    checked = source(lambda run: any(is_check(step["step"]) for step in run["steps"]))
    steps = [step for step in results["steps"] if checked is results or not is_check(step["step"])]
    passed = [step["step"] for step in steps if step["ok"]]
    late = [step["step"] for step in steps if not step["ok"] and LATE.search(step["note"])]
    failed = [step["step"] for step in steps if not step["ok"] and step["step"] not in late]
    size, frames = results["frames"][0]["size"], results["frames"][0]["frame_count"]
    lines = ["", f'{results["device"]["nvidia_smi"]}; commit {results["commit"]}. {len(passed)} of {len(steps)} '
             "steps of `tools/gpu_check` passed" + (f"; {len(late)} had no time: {', '.join(late)}" if late else "") +
             (f'; failed: {", ".join(failed)}.' if failed else "."), "",
             f"Median of {frames} consecutive frames at {size} in the second lap, in ms: the frame by the wall clock, and groups of "
             "its stages by the device's. Maps of what stands still are kept.", "", *frames_table(results["frames"]), ""]
    if traced:
        lines += [f'Million rays a second of the whole device at {traced["rays"][0]["resolution"]}^3{origin(traced)}. '
                  "Ours are the bits of the CPU; of NanoVDB's at most 0.5 % may differ:", "", *rays_table(traced["rays"]), ""]
    lines += ["Voxelizing, the same bytes on both:", "", *voxels_table(results["voxelize"]), ""]
    if checked:
        lines += [f"Sanitizers of CUDA over tests of parity{origin(checked)}:", "", *sanitizers_table(checked["steps"]), ""]
    if profiled:
        lines += ["Kernels of one warm frame, measured one by one by ncu, which empties the caches before each: their throughput of "
                  "device memory, the warps that an SM has of those that fit, and the lanes of 32 that work. The frame is the second of "
                  "two, in which less moves than in the median frame above" + origin(profiled) + ":", "",
                  *kernels_table(profiled["profiles"]), ""]
    return "\n".join(lines) + "\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("results", nargs="+", help="the results of tools/gpu_check, then those of other runs for the tables that the first has not")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    results = [read_json(path) for path in arguments.results]
    with expecting(arguments.results[0], "the results of tools/gpu_check"):
        text = text_of(*results)
    replace_marked(arguments.document, (BEGIN, END), text, arguments.check,
                   f"the tables of {arguments.results[0]}; write them with the command device")
