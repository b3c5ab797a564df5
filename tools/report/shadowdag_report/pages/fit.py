# SPDX-License-Identifier: Apache-2.0
"""Writes FIT.html beside FIT.json of `shadowdag fit`: the choice, every model with its measurement or the rule that
excluded it, the neighbours of the choice, the laws that the search assumed; and the chart as FIT.svg and FIT.png.
"""
import os

from ..files import Refused, expecting, read_json
from ..palette import BLACK, BLUE, PURPLE, VERMILION
from ..scales import plain
from .page import (MEBI, Cell, count, cubed, decimal, key_rows, marked, number, text, to_point, wide, words,
                   write_page_file)
from .plot import Series, plot, x_axis_of, y_axis_of

WHAT = "a result of fit"
METHODS = {"dag": ("rays", BLUE, "circle"), "maps": ("maps", VERMILION, "up"), "hybrid": ("hybrid", PURPLE, "diamond")}
METRICS = {"false": ("wrong pairs, worst frame (%)", 100), "visibility": ("visibility error, worst frame", 1),
           "flip": ("FLIP, worst frame", 1)}
TIME = "first_frame_time_ms"


def row_id(index):
    return f"model-{index}"


def error_text(model, metric):
    """Returns a model's error: in percent for wrong pairs."""
    error = model["error"]
    return f"{100 * error:.3f} % of the pairs wrong" if metric == "false" else f"{metric} error {error:.5f}"


def optional(row, key, decimals, scale=1):
    return decimal(row[key] * scale, decimals) if row.get(key) is not None else words("")


def mebi(row, key):
    return Cell(plain(row[key] / MEBI), row[key] / MEBI) if key in row else words("")


def columns(metric):
    """Returns (heading, cell of a model)."""
    name, scale = METRICS[metric]
    return (("Model", lambda m: words(cubed(text(m["label"])))),
            ("Status", lambda m: marked(m["status"], m["status"] == "chosen")),
            ("Error: " + name, lambda m: optional(m, "error", 5, scale)),
            ("First frame, ms", lambda m: optional(m, TIME, 2)),
            ("All frames, ms", lambda m: optional(m, "time_ms", 2)),
            ("± standard error", lambda m: optional(m, "time_ms_standard_error", 2)),
            ("Memory, MiB", lambda m: mebi(m, "bytes")),
            ("DAG", lambda m: mebi(m, "dag_bytes")),
            ("Maps", lambda m: mebi(m, "map_bytes")),
            ("False shadow", lambda m: count(m["false_shadow_count"]) if "false_shadow_count" in m else words("")),
            ("False light", lambda m: count(m["false_light_count"]) if "false_light_count" in m else words("")),
            ("FLIP", lambda m: optional(m, "flip", 4)), ("Rule", lambda m: words(m.get("rule", ""))),
            ("Why", lambda m: wide(m.get("reason", ""))), ("By", lambda m: words(cubed(text(m.get("by", ""))))))


def facts(headings):
    """Returns those of the cells that the chart shows beside a point."""
    return [h for h in headings if h.startswith("Error: ")] + [
        "Status", "First frame, ms", "All frames, ms", "± standard error", "Memory, MiB", "False shadow", "False light",
        "Why", "By"]


def fit_plot(result, by_index):
    """Returns the chart of the measured models. by_index: these, by their place among all"""
    name, scale = METRICS[result["metric"]]
    cost_of, unit, axis = ((lambda m: m["bytes"] / MEBI, "MiB", "shadow data, peak (MiB)") if result["minimise"] == "bytes" else
                     (lambda m: m[TIME], "ms", "time of the first frame (ms)"))
    chosen = [i for i, m in by_index.items() if m["status"] == "chosen"]
    front, best = [], None
    for i in sorted(by_index, key=lambda i: (cost_of(by_index[i]), by_index[i]["error"])):
        if best is None or by_index[i]["error"] < best:
            best = by_index[i]["error"]
            front.append(i)
    series = []
    for method in dict.fromkeys(m["method"] for m in by_index.values()):
        called, color, shape = METHODS.get(method, (text(method), BLACK, "cross"))
        series.append(Series(called, color, shape, [i for i, m in by_index.items() if m["method"] == method]))

    def in_words(i):
        m = by_index[i]
        return (f"{cubed(text(m['label']))}: {plain(cost_of(m))} {unit}, error {number(scale * m['error'], 5)}, "
                f"{text(m['status'])}")

    errors = [scale * m["error"] for m in by_index.values()] + [scale * result["bound"]]
    return plot("plot-fit", "Error against cost",
                "Filled points keep the bound, hollow ones break it; the ring is the choice, the grey band the front.",
                series, (x_axis_of(axis, [cost_of(m) for m in by_index.values()]), y_axis_of(name, errors)),
                lambda i: (cost_of(by_index[i]), scale * by_index[i]["error"]), row_id, in_words,
                hollow=[i for i, m in by_index.items() if m["error"] > result["bound"]], ringed=chosen, front=front,
                guide=(scale * result["bound"], f"bound {scale * result['bound']:g}"))


def content(result, stem, has_charts):
    """Returns what the template shows. stem: the name of the result without .json"""
    measured = {i: m for i, m in enumerate(result["models"]) if "error" in m}
    of, chosen = columns(result["metric"]), result["chosen"]
    rows = []
    for i, model in enumerate(result["models"]):
        first, *rest = [cell(model) for _, cell in of]
        rows.append([to_point(row_id(i), first) if i in measured else first, *rest])
    neighbours = [[words(cubed(text(m["label"]))), words(m["differs_in"]), words(m["status"]),
                   optional(m, "error_over_bound", 3), optional(m, "cost_over_choice", 3), wide(m.get("reason", ""))]
                  for m in result["neighbours"]]
    laws = [[words(law["models"]), words(law["law"]), wide(", ".join(map(text, law["axes"]))),
             count(law["checked_pair_count"]), count(law["violation_count"]),
             words("given up" if law["is_given_up"] else "used")] for law in result["laws"]]
    headings = [heading for heading, _ in of]
    bound = (f"{100 * result['bound']:g} % of the pairs wrong" if result["metric"] == "false" else
             f"a {METRICS[result['metric']][0].split(',')[0]} of {result['bound']:g}")
    return {"title": f"The least model in {text(result['minimise'])} with at most {bound}", "result": result,
            "stem": stem, "has_charts": has_charts, "plots": [fit_plot(result, measured)], "chosen": chosen,
            "error_of": lambda model: error_text(model, result["metric"]),
            "cost": "memory" if result["minimise"] == "bytes" else "time", "headings": headings,
            "facts": facts(headings), "rows": rows, "row_ids": [row_id(i) for i in range(len(rows))],
            "neighbours": neighbours, "laws": laws, "chosen_mebi": chosen and plain(chosen["bytes"] / MEBI),
            "counts": [[words(key), count(value)] for key, value in result["status_counts"].items()],
            "provenance": key_rows(result["provenance"]) + key_rows(result["sweep"])}


def declare(parser):
    parser.add_argument("result", help="what fit wrote")
    parser.add_argument("-o", dest="directory", required=True, help="where the page and the chart go")
    parser.add_argument("--no-charts", action="store_true", help="leave out the chart, which needs matplotlib")


def run(arguments):
    with expecting(arguments.result, WHAT):
        result = read_json(arguments.result)
        measured = [m for m in result["models"] if "error" in m]
    if not measured:
        raise Refused(f"{arguments.result}: holds no measured model")
    stem = os.path.splitext(os.path.basename(arguments.result))[0]
    if not arguments.no_charts:
        from ..charts import fit as drawing
        drawing.draw(result, os.path.join(arguments.directory, stem))
    write_page_file(os.path.join(arguments.directory, stem + ".html"), "fit.html.j2", arguments.result, WHAT,
                    lambda: content(result, os.path.basename(arguments.result), "" if arguments.no_charts else stem))
