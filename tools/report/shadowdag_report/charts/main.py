# SPDX-License-Identifier: Apache-2.0
"""Draws error against time as small multiples: one panel per scene and size of picture, every method in each, from
results.json files of `shadowdag compare --experiment scenes/experiments/main.json` and `main_1080p.json`.

    main report-360/results.json report-1080/results.json -o DIR

Writes DIR/main.svg and DIR/main.png, designed for both columns of a paper (17.8 cm). Errors are wrong pairs; a method without any is on the lower edge. Hollow markers are
warm frames, whose maps or beams a frame of the same view left. Bars are intervals of the medians. Scenes that this program builds say so.
"""
import math

from ..collection import Charts
from ..files import Refused, expecting, read_json
from ..series import believe_of, is_warm, keeps_beams, threshold_of, tracers_of
from ..style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, YELLOW, error_axis, log_axis, plural, plt
from ..texels import PAPER_TEXELS
from .runs import bars_sentence, over_frames, time_bars, tracer_label, tracers_sentence

COLUMNS = 4
WIDTH = 6.75  # inches of COLUMNS panels: with the margins two columns of a paper, 17.8 cm
NARROWEST = 0.675  # of that: the legend has five columns
BUILT = {"builtin:atrium": "atrium (built, mirrored)", "builtin:houses": "houses (built)", "builtin:necropolis": "necropolis (built)"}
LOOKS = {  # name: (colour, marker, size)
    "Embree's frame": (BLACK, "o", 4.0), "exact rays": (YELLOW, "p", 4.6), "exact rays by beams": (GREEN, "d", 4.6), "voxel rays": (SKY, "D", 3.4), "maps": (ORANGE, "s", 3.8),
    "hybrid, 96 texels": (VERMILION, "X", 4.2), "hybrid, others": (BLUE, "^", 3.0),
    "hybrid, voxel rays": (PURPLE, "^", 3.0), "hybrid, oracle": (GREEN, "*", 5.4),
    "others": (PURPLE, "v", 3.4), "the front": (GREY, "", 0)}

WARM, WARM_BEAMS = "hollow: a warm frame, maps kept", "hollow: a warm frame, maps and beams kept"

TRACER_LOOKS = ((GREY, "<", 4.0), (PURPLE, ">", 4.0), (SKY, "H", 4.2), (GREEN, "P", 4.2), (ORANGE, "8", 4.0))  # of others, in turn


def looks_of(panels):
    """Returns LOOKS and those of the tracers of others that the panels have."""
    tracers = dict.fromkeys(tracer_label(r) for _, _, runs in panels for r in tracers_of(runs))
    return LOOKS | {name: TRACER_LOOKS[i % len(TRACER_LOOKS)] for i, name in enumerate(tracers)}


def name_of(run):
    """Returns which of LOOKS a run is. The oracle has one name in all panels, also where it is not the fastest row."""
    if run["method"] == "embree":
        return "Embree's frame"
    if run["method"] == "maps":
        return "maps"
    if run["method"] == "tracer":
        return tracer_label(run)
    if run["method"] == "dag" and keeps_beams(run):
        return "exact rays by beams"
    if run["method"] == "dag":
        return {"none": "exact rays", "all": "voxel rays"}.get(believe_of(run), "others")
    if run["method"] == "hybrid":
        threshold = threshold_of(run)
        if threshold is not None and believe_of(run) == "all":
            return "hybrid, voxel rays"
        return ("hybrid, oracle" if threshold is None and run["model"] == "oracle" else "others" if threshold is None else
                "hybrid, 96 texels" if threshold == PAPER_TEXELS else "hybrid, others")
    return "others"


def title_of(scene):
    return BUILT.get(scene, scene.rsplit("/", 1)[-1].removesuffix(".glb").removesuffix(".gltf").removeprefix("builtin:").replace("_", " "))


def load(paths, mixed):
    """Returns [(scene, size, runs)], sizes from small to large, in each the built scenes last, else in the order of the files."""
    panels, commits, order = {}, {}, []
    for path in paths:
        with expecting(path, "a results file of compare"):
            results = read_json(path)
            commits.setdefault(results["provenance"]["commit"], path)
            size = results["experiment"]["size"]
            for run in results["runs"]:
                run["time_ms"] + run["false_shadow_count"], run["parameters"].get("believe"), run["stages_ms"].items()
                if run["scene"] not in order:
                    order.append(run["scene"])
                panels.setdefault((run["scene"], size), []).append(run)
    if len(commits) > 1 and not mixed:
        raise Refused("lines of different commits: " + ", ".join(f"{c} in {p}" for c, p in commits.items())
                      + "; measure again with one program, or pass --mixed-commits")
    if not panels:
        raise Refused(f"{', '.join(paths)}: holds no runs to draw; measure with shadowdag compare")
    pixels = lambda size: math.prod(int(part) for part in size.split("x"))
    return [(scene, size, over_frames(runs)) for (scene, size), runs in
            sorted(panels.items(), key=lambda item: (pixels(item[0][1]), item[0][0] in BUILT, order.index(item[0][0])))]


def wrong(run):
    return run["false_shadow"] + run["false_light"]


def panel(axes, scene, size, runs, floor, top, looks):
    heights = [max(wrong(r), floor) for r in runs]
    time_bars(axes, runs, heights, GREY)
    for run, height in zip(runs, heights):
        colour, marker, points = looks[name_of(run)]
        axes.plot(run["time_ms"], height, linestyle="none", marker=marker, color=colour, markersize=points,
                  markerfacecolor="white" if is_warm(run) else colour, markeredgecolor=colour if is_warm(run) else BLACK,
                  markeredgewidth=0.8 if is_warm(run) else 0.4, clip_on=False, zorder=4 if marker != "^" else 3,
                  label=f"_{name_of(run)}" if is_warm(run) else name_of(run))
    log_axis(axes.xaxis, min(r["time_ms_low"] for r in runs) / 1.3, max(r["time_ms_high"] for r in runs) * 1.3, ticks=(1, 3), near=(1, 2, 3, 5))
    error_axis(axes, floor, top, 5.6 if axes.get_subplotspec().is_first_col() else None)
    axes.set_title(f"{title_of(scene)}, {size.replace('x', ' × ')}", fontsize=6, pad=2.5)
    axes.tick_params(labelsize=5.6)


def draw(paths, directory, mixed=False):
    panels = load(paths, mixed)
    looks = looks_of(panels)
    shares = [wrong(r) for _, _, runs in panels for r in runs if wrong(r) > 0] or [1.0]
    floor, top = min(shares) / 3, max(shares) * 1.8
    rows = -(-len(panels) // COLUMNS)
    columns = -(-len(panels) // rows)
    figure, grid = plt.subplots(rows, columns, figsize=(WIDTH * max(columns / COLUMNS, NARROWEST), 0.55 + 1.35 * rows),
                                sharey=True, squeeze=False)
    for axes, (scene, size, runs) in zip(grid.flat, panels):
        panel(axes, scene, size, runs, floor, top, looks)
    for axes in list(grid.flat)[len(panels):]:
        axes.set_visible(False)
    for row in grid:
        row[0].set_ylabel("wrong pairs (%)", fontsize=6.5)
    for axes in list(grid.flat)[max(0, len(panels) - columns):len(panels)]:
        axes.set_xlabel("frame time (ms)", fontsize=6.5)
    entries = {}
    for axes in grid.flat:
        for handle, label in zip(*axes.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    names = [name for name in looks if name in entries]
    if any(is_warm(r) for _, _, runs in panels for r in runs):
        warm = WARM_BEAMS if any(keeps_beams(r) for _, _, runs in panels for r in runs) else WARM
        names.append(warm)
        entries[warm] = plt.Line2D([], [], linestyle="none", marker="o", markersize=4, markerfacecolor="white", markeredgecolor=GREY)
    figure.legend([entries[n] for n in names], names, loc="lower center",
                  bbox_to_anchor=(0.5, 1.0), ncol=min(5, len(names)), fontsize=6)
    every = [r for _, _, runs in panels for r in runs]
    charts = Charts(directory, bbox_inches="tight")  # the legend is above the panels
    charts.save(figure, "main", "Error against time in real and built scenes",
                f"{plural(len({scene for scene, _, _ in panels}), 'scene')} at {' and '.join(dict.fromkeys(size for _, size, _ in panels))} pixels; "
                "down and left is better. Built scenes are made by this program, the others are not."
                + (" The atrium's halves mirror each other." if any(scene == "builtin:atrium" for scene, _, _ in panels) else "")
                + (" The oracle serves each map by the method that was cheaper when maps were measured one by one; it need not be the fastest row."
                   if any(name_of(r) == "hybrid, oracle" for r in every) else "") + tracers_sentence(every) + bars_sentence(every))
    charts.finish()


def declare(parser):
    parser.add_argument("results", nargs="+", help="results.json files of compare, one per size of picture")
    parser.add_argument("-o", "--output", required=True, help="directory of the chart")
    parser.add_argument("--mixed-commits", action="store_true", help="accept lines of different commits")


def run(arguments):
    draw(arguments.results, arguments.output, arguments.mixed_commits)
