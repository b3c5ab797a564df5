# SPDX-License-Identifier: Apache-2.0
"""Draws the charts of a compare from results.json files, as SVG and PNG, with charts.json: titles and captions.

Lines of different commits are refused unless --mixed-commits is given.
"""
from ..collection import Charts
from .bars import bytes_chart, stages_chart, variants_chart
from .believe import believe_chart
from .lod import lod_chart
from .per_map import per_map
from .resolution import histogram_chart, resolution_chart
from .runs import load, over_frames
from .speed_accuracy import speed_accuracy
from .threshold import over_threshold


def steps_of(all_runs, all_costs, experiment):
    """Returns the charts of runs as (function, argument...), which come behind the directory of charts; a function draws nothing for
    which there are no data."""
    scenes = list(dict.fromkeys(run["scene"] for run in all_runs))
    merged = {scene: over_frames([r for r in all_runs if r["scene"] == scene]) for scene in scenes}
    steps = []  # of every scene, one after the other for each chart
    for scene in scenes:  # runs with names have a separate chart
        named = [r for r in merged[scene] if r["parameters"].get("variant")]
        merged[scene] = [r for r in merged[scene] if not r["parameters"].get("variant")]
        steps.append((variants_chart, scene, named))
    costs_of = {scene: [c for c in all_costs if c["scene"] == scene and c.get("start") != "warm"] for scene in scenes}  # of maps drawn anew
    steps += [(speed_accuracy, scene, merged[scene], experiment, costs_of[scene]) for scene in scenes]
    for scene in scenes:
        runs, costs = merged[scene], costs_of[scene]
        steps += [(over_threshold, scene, runs, experiment),
                  (per_map, scene, costs, "texels", "required face resolution (texels)", "per_map_texels",
                   "Time of a map by both methods over its resolution"),
                  (per_map, scene, costs, "samples", "samples served", "per_map_samples",
                   "Time of a map by both methods over its samples")]
        steps += [(chart, scene, runs) for chart in (bytes_chart, stages_chart, resolution_chart, lod_chart, believe_chart)]
        steps.append((histogram_chart, scene, runs, experiment))
    return steps


def draw(paths, directory, mixed=False):
    """Draws all charts for which the files have data."""
    steps = steps_of(*load(paths, mixed))
    charts = Charts(directory)
    charts.expect(len(steps))
    for chart, *arguments in steps:
        chart(charts, *arguments)
        charts.step()
    charts.finish()


def declare(parser):
    parser.add_argument("results", nargs="+", help="results.json files of compare")
    parser.add_argument("-o", "--output", required=True, help="directory of the charts")
    parser.add_argument("--mixed-commits", action="store_true", help="accept lines of different commits")


def run(arguments):
    draw(arguments.results, arguments.output, arguments.mixed_commits)
