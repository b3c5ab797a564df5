# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/mutants.json of `shadowdag study mutants`: which check notices which fault."""
import os

from .page import counted, declare, key_rows, read_results, wide, words, write_page  # noqa: F401
from ..mutation import HEADINGS, power_text, rows, summary

WHAT = "a result of study mutants"


def run(arguments):
    directory = arguments.directory
    results = read_results(directory, "mutants.json", WHAT)
    write_page(directory, "mutants.html.j2", os.path.join(directory, "mutants.json"), WHAT, lambda: {
        "title": "The judge judged: which check notices which fault", "results": results, "summary": summary(results) + " " + power_text(results),
        "headings": HEADINGS, "rows": [[words(name), *map(wide, cells), counted(more), counted(hidden)] for name, *cells, more, hidden in rows(results)],
        "provenance": key_rows(results["provenance"])})
