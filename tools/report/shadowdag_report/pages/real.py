# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/real.json of `shadowdag study real`: real scenes with their bounds."""
import os

from ..explained import explained_share, null_rate
from .page import (bounds_cell, count, decimal, declare, key_rows, number, percent, read_results, share_cell, slack_text,
                   words, write_page)

WHAT = "a result of study real"


def is_powerless(cell):
    """Returns whether explaining says nothing of a cell; results before that test do not say so."""
    return cell.get("explaining_has_power") is False


COLUMNS = (  # heading, cell of a row
    ("Method", lambda c: words(c["method"])), ("False shadow, %", lambda c: decimal(percent(c, "false_shadow_count"), 3)),
    ("False light, %", lambda c: decimal(percent(c, "false_light_count"), 3)),
    ("Mean error", lambda c: decimal(c["mean_abs_visibility_error"], 5)),
    ("Magnified", lambda c: count(c["magnified_count"])), ("Explained, %", lambda c: words("no power") if is_powerless(c) else share_cell(explained_share(c))),
    ("Null rate, %", lambda c: share_cell(null_rate(c))), ("of all pairs", lambda c: share_cell(c["null_rate"])),
    ("Unexplained", lambda c: count(c["unexplained_count"])), ("of these named", lambda c: count(c.get("named_count", 0))),
    ("without a name", lambda c: count(c["unnamed_count"])),
    ("Acne", lambda c: count(c["acne_count"])), ("Contact", lambda c: count(c["contact_count"])),
    ("Missing taps", lambda c: count(c["missing_tap_count"])), ("Flicker", lambda c: count(c["flicker_count"])),
    ("of answers", lambda c: count(c["flicker_answer_count"])), ("Maps drawn", lambda c: count(c["drawn_map_count"])),
    ("traced", lambda c: count(c["traced_map_count"])), ("Bounds", bounds_cell),
)


def section(results, scene):
    """Returns the data of a scene for the page."""
    cells = [c for c in results["cells"] if c["scene"] == scene]
    first = cells[0]
    known = [row for row in results["study"]["rows"] if row["name"] == scene]
    pictures = [[("images/" + p["truth"], "The truth (Embree)")]
                + [("images/" + c["image"], "errors of " + c["method"]) for c in cells if "image" in c]
                for p in results["pictures"] if p["scene"] == scene]
    return {"name": scene, "first": first, "pictures": pictures,
            "what": [row["what"] for row in known if first["known"] != "another file"],
            "dark": percent(first, "occluded_count"), "shows_edge": 0 < first["occluded_count"] < first["pair_count"],
            "untrusted": [c for c in cells if "untrusted" in c],
            "named": [errors for row in known for errors in row.get("unexplained", [])],
            "rows": [[cell(c) for _, cell in COLUMNS] for c in cells]}


def null_limit(study):
    """Returns the null rates above which explaining has no power, as text: one, or one for each group of methods."""
    limits = dict.fromkeys(number(100 * tolerance.get("null_rate", 1), 1) for tolerance in study.get("tolerances", []))
    return " or ".join(f"{limit} %" for limit in limits) + (", by method," if len(limits) > 1 else "")


def run(arguments):
    directory = arguments.directory
    results = read_results(directory, "real.json", WHAT)
    write_page(directory, "real.html.j2", os.path.join(directory, "real.json"), WHAT, lambda: {
        "title": "Shadows in real scenes: maps, voxel rays and both", "results": results,
        "powerless": sum(map(is_powerless, results["cells"])), "null_limit": null_limit(results["study"]),
        "slack": slack_text(results["study"]),
        "scenes": [section(results, scene) for scene in dict.fromkeys(c["scene"] for c in results["cells"])],
        "headings": [heading for heading, _ in COLUMNS], "provenance": key_rows(results["provenance"])})
