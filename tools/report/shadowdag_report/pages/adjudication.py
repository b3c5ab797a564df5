# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/adjudication.json of `shadowdag study adjudication`: who answers which pairs wrongly."""
import os

from .page import count, counted, declare, key_rows, marked, read_results, words, write_page  # noqa: F401
from ..adjudicated import (DISPUTES, SCORES, VERDICTS, dispute_rows, dispute_text, score_rows, summary, verdict_rows)

WHAT = "a result of study adjudication"
CELLS = ("Scene", *SCORES)


def cell_rows(results):
    faultless = results["study"]["faultless"]
    return [[words(c["scene"]), words(c["tracer"]), count(c["pair_count"]), count(c["false_shadow_count"]), count(c["false_light_count"]),
             marked(c["wrong_count"], c["wrong_count"] and c["tracer"] in faultless), count(c["ambiguous_dark_count"])]
            for c in results["cells"]]


def run(arguments):
    directory = arguments.directory
    results = read_results(directory, "adjudication.json", WHAT)
    write_page(directory, "adjudication.html.j2", os.path.join(directory, "adjudication.json"), WHAT, lambda: {
        "title": "Tracers against the adjudicator", "results": results, "summary": summary(results),
        "disputes": dispute_text(results),
        "tables": [("All scenes", SCORES, [list(map(counted, row)) for row in score_rows(results)]),
                   ("Pairs in which truth and exact packets differ", DISPUTES, [list(map(counted, row)) for row in dispute_rows(results)]),
                   ("What the adjudicator says", VERDICTS, [list(map(counted, row)) for row in verdict_rows(results)]),
                   ("By scene", CELLS, cell_rows(results))],
        "provenance": key_rows(results["provenance"])})
