# SPDX-License-Identifier: Apache-2.0
"""The lights of the runs that have pictures, for the table beside the viewer: DIR/lights.csv, with the measured cost of
each light's maps, and where the lights are in the picture (truth_images of the results).
"""
import csv
import os

from ..files import expecting
from ..series import is_warm

COLUMNS = (  # key in lights.csv, heading, type
    ("light", "Light", int), ("route", "Computed by", str), ("texels", "Texels wanted", float),
    ("face_texels", "given", int), ("pages", "Pages", int), ("pair_count", "Pairs", int),
    ("false_shadow_count", "False shadow", int),
    ("false_light_count", "False light", int), ("mean_abs_visibility_error", "Mean error", float),
)
COSTS = (("rays_ms", "Rays alone, ms"), ("map_ms", "Map alone, ms"))
MOST_ROWS = 20000  # in a page: a megabyte


def costs_of(results):
    """Returns {(scene, frame, is warm): {light: (by rays, by maps)}}, in ms, the sums over a light's maps."""
    sums = {}
    for cost in results.get("map_costs", ()):
        lights = sums.setdefault((cost["scene"], cost["frame"], cost.get("start") == "warm"), {})
        before = lights.get(cost["light"], (0.0, 0.0))
        lights[cost["light"]] = (before[0] + cost["rays_ms"], before[1] + cost["map_ms"])
    return sums


def read_rows(path):
    """Returns the rows of lights.csv by (scene, frame, label); none where there is no file."""
    rows = {}
    if os.path.exists(path):
        with expecting(path, "the lights of compare"), open(path, encoding="utf-8", errors="replace", newline="") as file:
            for row in csv.DictReader(file):
                rows.setdefault((row["scene"], int(row["frame"]), row["label"]), []).append(
                    [kind(float(row[key])) if kind is int else kind(row[key]) for key, _, kind in COLUMNS])
    return rows


def places(truth, size):
    """Returns the picture's size and {light: (x, y)} in pixels."""
    width, height = (int(part) for part in size.split("x"))
    return {"width": width, "height": height,
            "lights": {str(at["light"]): [at["x"], at["y"]] for at in truth["lights"]}}


def lights_data(directory, results, row_id):
    """Returns what viewer.js reads, and the number of runs whose lights are left out of a page that they would make too
    large."""
    of_runs, costs = read_rows(os.path.join(directory, "lights.csv")), costs_of(results)
    rows, count, left_out = {}, 0, 0
    for index, run in enumerate(results["runs"]):
        lights = of_runs.get((run["scene"], run["frame"], run["label"]), []) if "images" in run else []
        if count + len(lights) > MOST_ROWS:
            left_out += 1
        elif lights:
            count += len(lights)
            of_maps = costs.get((run["scene"], run["frame"], is_warm(run)), {})
            rows[row_id(index)] = [row + list(of_maps.get(row[0], (None, None))) for row in lights]
    return {"columns": [key for key, _, _ in COLUMNS] + [key for key, _ in COSTS],
            "headings": [heading for _, heading, _ in COLUMNS] + [heading for _, heading in COSTS], "rows": rows,
            "places": {str(i): places(truth, results["experiment"]["size"])
                       for i, truth in enumerate(results["truth_images"]) if "lights" in truth}}, left_out
