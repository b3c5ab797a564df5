# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/stability.json of `shadowdag study stability`, with the charts in DIR/charts: every
band with its reason, and every check.
"""
import math
import os

from .page import (Cell, declare, drawn_charts, key_rows, marked, number, read_results, row_of, text,  # noqa: F401
                   wide, words, write_page)

WHAT = "a result of study stability"
PARTS = {  # name: (title, what is measured)
    "time": ("In time", "Points of surfaces are followed from frame to frame. A result flickers when it changes and "
             "Embree's does not. Held results have the same method and resolution in both frames."),
    "perturbation": ("Under perturbation", "The same frame, its scene moved by a thousandth of a voxel or texel, far away, scaled or turned, "
                     "each compared with Embree's results for the same scene."),
    "numeric": ("Numerically", "Lines in all 26 directions and texels across the edges of a cube, compared with integers without "
                "rounding. The slab test may accept lines up to twice its margin outside of a voxel, a millionth of the "
                "grid, and must never lose one that touches it."),
    "resolution": ("Over resolution", "The rate is the slope of log error over log voxel or texel. The expected rate is 1 if "
                   "outlines are resolved: an outline is wrong by up to a voxel or texel, so the wrong area is its length "
                   "times that."),
}


def short(value):
    return words(f"{value:.3g}")


def room(check):
    """Returns how far a value is from the nearer end of its band, as a share of the band's width."""
    low, high, value = check["low"], check["high"], check["value"]
    width = max(high - low, 1e-300)
    return min((high - value) / width, (value - low) / width if low > 0 else math.inf)


def check_rows(checks):
    """Returns one line per band and method: how near the values are to an end of the band."""
    lines = {}
    for check in checks:
        lines.setdefault((text(check["band"]), text(check["method"])), []).append(check)
    rows = []
    for (band, method), members in sorted(lines.items()):
        worst, broken = min(members, key=room), sum(not c["holds"] for c in members)
        rows.append([words(band), words(method), words(len(members)), marked(broken, broken),
                     words(f"{worst['group']}, {worst['case']}"), short(worst["value"]),
                     words(f"{worst['low']:.3g} to {worst['high']:.3g}")])
    return rows


def rate_rows(rates):
    return [[words(r["group"]), words(r["method"]), words(r["case"]), words(number(r["slope"], 2)),
             words(number(r["standard_error"], 2)),
             words(f"{r['least_local']:.2f} to {r['greatest_local']:.2f}")] for r in rates]


def all_rows(rows):
    """Returns (headings, cells) of every row, without nested values."""
    keys = dict.fromkeys(key for row in rows for key, value in row.items() if not isinstance(value, (list, dict)))
    return list(keys), [[short(row[key]) if isinstance(row.get(key), float) else words(row.get(key, "")) for key in keys]
                        for row in rows]


def group_of(study, name):
    """Returns the data of a group for the page; its name contains a user's scene."""
    row = row_of(study, name)
    return {"name": name, "what": row["what"], "scene": row.get("scene", "") if row["name"] == name else ""}


def section(results, charts, part):
    title, lead = PARTS[part]
    rows = results[part]
    return {"name": part, "title": title, "lead": lead, "rows": all_rows(rows), "row_count": len(rows),
            "groups": [group_of(results["study"], name) for name in dict.fromkeys(row["group"] for row in rows)],
            "charts": [c for c in charts if c["part"] == part],
            "checks": check_rows([c for c in results["checks"] if c["part"] == part]),
            "rates": rate_rows(results.get("rates", [])) if part == "resolution" else []}


def run(arguments):
    directory = arguments.directory
    results, path = read_results(directory, "stability.json", WHAT), os.path.join(directory, "stability.json")
    charts = drawn_charts(arguments, "stability", path)
    write_page(directory, "stability.html.j2", path, WHAT, lambda: {
        "title": "How stable the errors are: in time, place, number and resolution", "results": results,
        "parts": [section(results, charts, part) for part in PARTS if results.get(part)],
        "bands": [[words(b["id"]), words(b["measure"]), wide(b["formula"]), wide(b["reason"])]
                  for b in results["study"]["bands"]],
        "known": [[words(k["group"]), words(k["kind"]), words(k["method"]), words(k["measure"]),
                   Cell(f"{k['low']:.3g} to {k['high']:.3g}"), wide(k["reason"])] for k in results["study"]["known"]],
        "provenance": key_rows(results["provenance"])})
