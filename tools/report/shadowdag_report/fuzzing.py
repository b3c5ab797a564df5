# SPDX-License-Identifier: Apache-2.0
"""Writes the table of fuzzing in docs/promises.md from the record that tests/fuzz/run.py keeps.

    fuzzing docs/promises.md tests/bench/results/fuzzing.json [--check]

With --check nothing is written, and the file is refused when it differs from the generated text.
"""
from .files import expecting, read_json, replace_marked

BEGIN, END = "<!-- fuzzing:begin -->", "<!-- fuzzing:end -->"


def table(totals):
    """Returns everything between the markers."""
    commits = list(dict.fromkeys(commit for total in totals.values() for commit in total["commits"]))
    ended = sum(total["ended_count"] for total in totals.values())
    lines = ["", "{:,} executions in {:,.0f} s of a processor, at {}; {} ended a target.".format(
                 sum(total["executions"] for total in totals.values()), sum(total["cpu_s"] for total in totals.values()),
                 ", ".join(commits), "none" if ended == 0 else ended), "",
             "| target | executions | processor seconds | edges reached | inputs kept | ended it |",
             "|---|---:|---:|---:|---:|---:|"]
    for target, total in sorted(totals.items()):
        lines.append("| {} | {:,} | {:,.0f} | {:,} | {:,} | {} |".format(
            target, total["executions"], total["cpu_s"], total["edge_count"], total["kept_count"], total["ended_count"]))
    return "\n".join(lines) + "\n\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("results", help="the record")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    totals = read_json(arguments.results)
    with expecting(arguments.results, "a record of tests/fuzz/run.py"):
        text = table(totals)
    replace_marked(arguments.document, (BEGIN, END), text, arguments.check,
                   f"the table of {arguments.results}; write it with the command fuzzing")
