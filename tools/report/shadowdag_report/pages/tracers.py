# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/tracers.json of `shadowdag rays --answer` or `--tracer`: a row for each tracer."""
import os

from .compare import interval_cell
from .page import count, decimal, declare, key_rows, percent, read_results, words, write_page  # noqa: F401

WHAT = "rows of shadowdag rays"


def timed(cell):
    """Returns a cell of a run that has times; else it is empty."""
    return lambda run: cell(run) if "time_ms" in run else words("")


COLUMNS = (  # heading, cell of a run
    ("Tracer", lambda r: words(r["label"])), ("Scene", lambda r: words(r["scene"])), ("Pairs", lambda r: count(r["pair_count"])),
    ("Time of the pairs, ms", timed(lambda r: decimal(r["time_ms"], 2))), ("95 % interval", timed(interval_cell)),
    ("n", timed(lambda r: count(r["repeat_count"]))), ("ns per pair", timed(lambda r: decimal(r["ns_per_pair"], 1))),
    ("Build, ms", lambda r: decimal(r["build_ms"], 1) if "build_ms" in r else words("")),
    ("Mean error", lambda r: decimal(r["mean_abs_visibility_error"], 5)),
    ("False shadow, %", lambda r: decimal(percent(r, "false_shadow_count"), 3)),
    ("False light, %", lambda r: decimal(percent(r, "false_light_count"), 3)),
    ("Proven wrong", lambda r: count(r["proven_wrong_count"])), ("of proven pairs", lambda r: count(r["proven_count"])))


def run(arguments):
    directory = arguments.directory
    results = read_results(directory, "tracers.json", WHAT)
    rows = results["runs"] + results["untimed_runs"]
    columns = COLUMNS + ((("Remark", lambda r: words(r.get("warning", ""))),) if any("warning" in r for r in rows) else ())
    write_page(directory, "tracers.html.j2", os.path.join(directory, "tracers.json"), WHAT, lambda: {
        "title": "Tracers of others", "headings": [heading for heading, _ in columns],
        "rows": [[cell(r) for _, cell in columns] for r in rows],
        "provenance": key_rows(results["provenance"]) + key_rows({"set": results["set_id"]})})
