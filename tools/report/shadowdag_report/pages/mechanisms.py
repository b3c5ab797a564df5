# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/mechanisms.json or DIR/ablation.json, with the chart in DIR/charts: the rule, the
verdicts, every mechanism with its scenes.
"""
import os

from markupsafe import Markup

from .page import (Cell, declare, drawn_charts, grouped, key_rows, marked, number, read_results,  # noqa: F401
                   text, wide, words, write_page)

WHAT = "a result of study ablation"
FILES = ("ablation.json", "mechanisms.json")
RATIOS = ("own_ratio", "time_ratio", "error_ratio", "bytes_ratio")
SCENE_RATIOS = ("own_ratio", "time_ratio", "time_spread", "error_ratio", "bytes_ratio")
COUNTS = ("false_shadow_count", "false_light_count", None, "acne_count", "triangle_draw_count", "texel_count", "ray_count")
UNEXPLAINED = ("unexplained_false_shadow_count", "unexplained_false_light_count")
DEFAULTS = {None: "selected by name", True: "on", False: "off"}


def ratios(row, keys):
    return [words(number(row[key], 3) if row.get(key) is not None else "") for key in keys]


def verdict_row(row):
    link = Markup('<a href="#{0}">{0}</a>').format(text(row["name"]))
    return ([Cell(link), words(row["metric"])] + ratios(row, RATIOS)
            + [marked(row["verdict"], not row["agrees"]), words(DEFAULTS[row["is_default"]]), wide(row["reason"])])


def sides(scene, key):
    """Returns a count without and with the mechanism. key: None for the unexplained of both kinds"""
    off, on = scene["off"], scene["on"]
    if "pair_count" not in off:
        return words("")
    keys = UNEXPLAINED if key is None else (key,)
    return Cell(Markup("{} → {}").format(grouped(sum(off[k] for k in keys)), grouped(sum(on[k] for k in keys))))


def section(row):
    rows = [[words(s["scene"])] + ratios(s, SCENE_RATIOS) + [sides(s, key) for key in COUNTS] for s in row["scenes"]]
    headings = ["Scene", f"{text(row['metric'])}, on/off", "time", "spread", "error", "bytes", "false shadow", "false light",
                "unexplained", "acne", "triangles", "texels", "rays"]
    return row | {"headings": headings, "rows": rows}


def run(arguments):
    directory = arguments.directory
    file = next((f for f in FILES if os.path.exists(os.path.join(directory, f))), FILES[-1])
    results, path = read_results(directory, file, WHAT), os.path.join(directory, file)
    charts = drawn_charts(arguments, "mechanisms", path)
    write_page(directory, "mechanisms.html.j2", path, WHAT, lambda: {
        "title": "The gain of each mechanism", "stem": os.path.splitext(file)[0], "results": results, "charts": charts,
        "verdicts": [verdict_row(row) for row in results["mechanisms"]],
        "mechanisms": [section(row) for row in results["mechanisms"]], "provenance": key_rows(results["provenance"])})
