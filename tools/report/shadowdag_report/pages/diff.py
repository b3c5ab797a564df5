# SPDX-License-Identifier: Apache-2.0
"""Writes DIFF.html beside DIFF.json, which `shadowdag diff -o DIFF.html` wrote: what changed between two results, worse
first, with the ratio of every number that is positive in both.
"""
import math
import os

from markupsafe import Markup

from ..files import expecting, read_json
from ..palette import BLACK, BLUE, GREY, VERMILION
from .page import Cell, count, grouped, text, to_point, words, write_page_file
from .plot import BOTTOM, TOP, NameAxis, Series, plot, x_axis_of

WHAT = "a difference that diff wrote"
VERDICTS = {"worse": (VERMILION, "up"), "uncertain": (GREY, "cross"), "better": (BLUE, "down"),  # in this order
            "changed": (BLACK, "diamond")}
MOST_CHANGES, MOST_KEYS = 2000, 24  # in a page, in its chart
LEFT = 190  # for the names of values
HEADINGS = ("Verdict", "List", "Row", "Value", "A", "B", "B over A")


def row_id(index):
    return f"change-{index}"


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def ratio_of(change):
    """Returns B over A, None where there is none."""
    a, b = change["a"], change["b"]
    return b / a if is_number(a) and is_number(b) and a > 0 and b > 0 and math.isfinite(b / a) else None


def value_cell(change, side):
    value, interval = change[side], change.get(side + "_interval")

    def short(v):
        return f"{v:.6g}" if isinstance(v, float) else str(grouped(v)) if is_number(v) else text(v)
    shown = Markup(short(value)) if is_number(value) else short(value)
    if "pair_counts" in change:
        shown = Markup("{} of {}").format(shown, short(change["pair_counts"][side == "b"]))
    if interval:
        shown = Markup("{} ({} to {})").format(shown, short(interval[0]), short(interval[1]))
    return Cell(shown, value if is_number(value) else None, is_wide=not is_number(value))


def ratio_cell(ratio):
    return words("") if ratio is None else Cell(f"{ratio:.4g}", ratio)


def ratio_plot(changes):
    """Returns the chart of the ratios by value, or none; changes: with their place in the table."""
    with_ratio = [(i, c, r) for i, c in enumerate(changes) if (r := ratio_of(c)) is not None]
    greatest = {}  # logarithm of a ratio, by value
    for _, change, ratio in with_ratio:
        greatest[change["key"]] = max(greatest.get(change["key"], 0), abs(math.log(ratio)))
    keys = sorted(greatest, key=lambda key: -greatest[key])[:MOST_KEYS]
    shown = {i: (c, r) for i, c, r in with_ratio if c["key"] in keys}
    if not shown:
        return []
    height = TOP + BOTTOM + 26 * max(4, len(keys))
    names = [text(key) if len(text(key)) < 27 else "…" + text(key)[-25:] for key in keys]
    name_of = dict(zip(keys, names))
    series = [Series(verdict, color, shape, [i for i, (c, _) in shown.items() if c["verdict"] == verdict])
              for verdict, (color, shape) in VERDICTS.items()]
    caption = "Each point is a number that changed and is positive in both results; left of 1 it has become smaller."
    if len(greatest) > len(keys):
        caption += f" {len(greatest) - len(keys)} values with smaller changes are in the table alone."

    def in_words(i):
        change, ratio = shown[i]
        return f"{text(change['row'])}: {text(change['key'])} {change['verdict']}, B over A {ratio:.4g}"

    return [plot("plot-diff", "B over A", caption, [s for s in series if s.rows],
                 (x_axis_of("B over A", [r for _, r in shown.values()] + [1.0], LEFT),
                  NameAxis("", names, TOP, height - BOTTOM)),
                 lambda i: (shown[i][1], name_of[shown[i][0]["key"]]), row_id, in_words, height=height, left=LEFT)]


def content(diff, file):
    """Returns what the template shows. file: the name of the data"""
    order = list(VERDICTS)
    changes = sorted(diff["changes"], key=lambda c: (order.index(c["verdict"]), -abs(math.log(ratio_of(c) or 1e300))))
    left_out, changes = max(0, len(changes) - MOST_CHANGES), changes[:MOST_CHANGES]
    plots = ratio_plot(changes)
    plotted = {point["row"] for of in plots for point in of["points"]}
    rows = []
    for i, change in enumerate(changes):
        verdict = Cell(Markup('<span class="{0}">{0}</span>').format(change["verdict"]), order.index(change["verdict"]))
        rows.append([to_point(row_id(i), verdict) if row_id(i) in plotted else verdict, words(change["list"]), words(change["row"]),
                     words(change["key"]), value_cell(change, "a"), value_cell(change, "b"),
                     ratio_cell(ratio_of(change))])
    only = [(f"Only in {side.upper()}: {text(diff[side])}",
             [[words(r["list"]), words(r["row"])] for r in diff[f"only_in_{side}"]])
            for side in "ab" if diff[f"only_in_{side}"]]
    lacking = [[words(r["list"]), words(r["row"]), words(r["key"])] for r in diff["values_only_in_a"]]
    return {"title": "What changed between two results", "diff": diff, "file": file, "plots": plots,
            "headings": HEADINGS, "rows": rows, "row_ids": [row_id(i) for i in range(len(rows))], "only": only,
            "lacking": lacking[:MOST_CHANGES], "lacking_left_out": max(0, len(lacking) - MOST_CHANGES),
            "left_out": left_out,
            "counts": [[words(verdict), count(diff[verdict + "_count"])] for verdict in VERDICTS]}


def declare(parser):
    parser.add_argument("difference", help="DIFF.json, which diff wrote; DIFF.html goes beside it")


def run(arguments):
    with expecting(arguments.difference, WHAT):
        diff = read_json(arguments.difference)
    write_page_file(os.path.splitext(arguments.difference)[0] + ".html", "diff.html.j2", arguments.difference, WHAT,
                    lambda: content(diff, os.path.basename(arguments.difference)))
