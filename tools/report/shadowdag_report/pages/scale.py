# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/scale.json of `shadowdag study scale`, with the charts in DIR/charts: where methods become
faster than Embree as triangles grow, and every cell.
"""
import os

from .page import (MEBI, Cell, count, cubed, declare, decimal, drawn_charts, key_rows, marked, number, percent,  # noqa: F401
                   read_results, row_of, words, wide, write_page)
from ..intervals import interval_text

WHAT = "a result of study scale"
CROSSOVERS = ("Row", "Method", "Against Embree", "ns a pair there", "Embree there", "Intervals apart")
CELLS = ("Triangles", "Method", "build (s)", "MiB", "frame (ms)", "n", "ns a pair", "false shadow (%)", "false light (%)")


def label(method):
    """Returns a method with the cube of its resolution."""
    return cubed(method + "^3") if method.startswith("voxels ") else method


def crossover_row(of):
    if "ns_per_pair" not in of:
        return [words(of["row"]), words(label(of["method"])), wide(of["text"]), words(""), words(""), words("")]
    return [words(of["row"]), words(label(of["method"])), wide(of["text"]), decimal(of["ns_per_pair"], 1),
            decimal(of["embree_ns_per_pair"], 1), words("yes" if of["are_apart"] else "no")]


def cell_row(cell):
    return [count(cell["triangle_count"]), words(label(cell["method"])), decimal(cell["build_s"], 2), decimal(cell["bytes"] / MEBI, 1),
            Cell(interval_text(cell, "time_ms"), cell["time_ms"]), count(cell["repeat_count"]),
            Cell(interval_text(cell, "ns_per_pair", 1), cell["ns_per_pair"]), decimal(percent(cell, "false_shadow_count"), 4),
            decimal(percent(cell, "false_light_count"), 4)]


def sections(results, charts):
    """Returns what the page says of each row."""
    made = []
    for name in dict.fromkeys(cell["row"] for cell in results["cells"]):
        cells = [cell for cell in results["cells"] if cell["row"] == name]
        steps = [step for step in results["steps"] if step["row"] == name]
        made.append({"name": name, "what": row_of(results["study"], name)["what"], "scene": cells[0]["scene"], "growth": cells[0]["growth"],
                     "light_count": steps[0]["light_count"], "pair_counts": [step["pair_count"] for step in steps],
                     "charts": [chart for chart in charts if chart["row"] == name], "cells": [cell_row(cell) for cell in cells]})
    return made


def run(arguments):
    directory = arguments.directory
    results, path = read_results(directory, "scale.json", WHAT), os.path.join(directory, "scale.json")
    charts = drawn_charts(arguments, "scale", path)
    write_page(directory, "scale.html.j2", path, WHAT, lambda: {
        "title": "More triangles, the same voxels", "results": results, "rows": sections(results, charts),
        "crossover_headings": CROSSOVERS, "crossovers": [crossover_row(of) for of in results["crossovers"]], "headings": CELLS,
        "skipped": [f"{of['row']} at {of['asked_triangle_count']} triangles: {of['reason']}" for of in results["skipped"]],
        "provenance": key_rows(results["provenance"])})
