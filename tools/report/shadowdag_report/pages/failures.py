# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/failures.json of `shadowdag study failures`: every failure in two sentences, picture
and truth side by side, every cell with its counts.
"""
import os

from ..explained import explained_share, null_rate
from .page import (bounds_cell, count, decimal, declare, key_rows, percent, read_results, row_of, share_cell, slack_text, wide,
                   words, write_page)

WHAT = "a result of study failures"
REMEDIES = {"not read": "unaffected", "none": "–"}
COLUMNS = (  # heading, cell of a row of the matrix
    ("Method", lambda c: words(c["method"])), ("Remedy", lambda c: words(REMEDIES.get(c["remedy"], c["remedy"]))),
    ("False shadow, %", lambda c: decimal(percent(c, "false_shadow_count"), 2)),
    ("False light, %", lambda c: decimal(percent(c, "false_light_count"), 2)),
    ("Mean error", lambda c: decimal(c["mean_abs_visibility_error"], 5)),
    ("Unexplained", lambda c: count(c["unexplained_count"])), ("Explained, %", lambda c: share_cell(explained_share(c))),
    ("Null rate, %", lambda c: share_cell(null_rate(c))), ("Acne", lambda c: count(c["acne_count"])),
    ("Contact", lambda c: count(c["contact_count"])), ("Magnified", lambda c: count(c["magnified_count"])), ("Missing taps", lambda c: count(c["missing_tap_count"])),
)
MOVING = (("Flicker", lambda c: count(c["flicker_count"])), ("of answers", lambda c: count(c["flicker_answer_count"])))
LAST = (("Maps drawn", lambda c: count(c["drawn_map_count"])), ("traced", lambda c: count(c["traced_map_count"])),
        ("Bounds", bounds_cell))


def pictures(cells, truth):
    """Returns one row of (file, caption) per method: the truth, then without and with the remedy, each with its errors."""
    rows = []
    for method in dict.fromkeys(c["method"] for c in cells if "images" in c):
        row = [("images/" + truth, "The truth (Embree)")]
        for cell in (c for c in cells if c["method"] == method and "images" in c):
            state = {"none": "", "on": ", with the remedy"}.get(cell["remedy"], ", without")
            row += [("images/" + cell["images"]["color"], method + state),
                    ("images/" + cell["images"]["error"],
                     f"its errors: {percent(cell, 'false_shadow_count'):.2f} % false shadow, "
                     f"{percent(cell, 'false_light_count'):.2f} % false light")]
        rows.append(row)
    return rows


def section(results, name):
    """Returns the data of a failure for the page."""
    row = {"listed": "ours", "always": "", "off": "", "on": "", "frames": 1, "step_s": 0} | row_of(results["study"], name)
    cells = [c for c in results["cells"] if c["failure"] == name]
    columns = COLUMNS + (MOVING if row["frames"] > 1 else ()) + LAST
    return row | {
        "name": name, "scene": row["scene"] if row["name"] == name else cells[0]["scene"],
        "headings": [heading for heading, _ in columns], "rows": [[cell(c) for _, cell in columns] for c in cells],
        "pictures": [row for p in results["pictures"] if p["failure"] == name for row in pictures(cells, p["truth"])],
        "remedies": [r for r in results["remedies"] if r["failure"] == name]}


def run(arguments):
    directory = arguments.directory
    results = read_results(directory, "failures.json", WHAT)
    write_page(directory, "failures.html.j2", os.path.join(directory, "failures.json"), WHAT, lambda: {
        "title": "Where shadows fail: maps, voxel rays and both", "results": results,
        "slack": slack_text(results["study"]), "left_out": results.get("left_out", []), "has_bounds": any(c.get("bounds", True) for c in results["cells"]),
        "failures": [section(results, name) for name in dict.fromkeys(c["failure"] for c in results["cells"])],
        "tests": [[words(t["listed"]), wide(t["what"]), wide(t["test"])] for t in results["study"].get("tests", [])],
        "settings": [[words(s["key"]), wide(s["help"])] for s in results.get("settings", [])],
        "provenance": key_rows(results["provenance"])})
