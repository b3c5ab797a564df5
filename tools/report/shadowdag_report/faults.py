# SPDX-License-Identifier: Apache-2.0
"""Writes the table of faults in docs/promises.md from the record that tests/faults/measure.py keeps.

    faults docs/promises.md tests/bench/results/faults.json [--check]

With --check nothing is written, and the file is refused when it differs from the generated text.
"""
import re

from .files import expecting, read_json, replace_marked

BEGIN, END = "<!-- faults:begin -->", "<!-- faults:end -->"


def table(record):
    """Returns everything between the markers."""
    tests = {}  # of all commands
    for name, total in sorted(record.items()):
        test, _, command = name.partition("/")
        tests.setdefault(test, []).append((command, total))
    commits = sorted({commit for total in record.values() for commit in total["commits"]})
    failed = [name for name, total in sorted(record.items()) if total["failed_count"] > 0]
    lines = ["", "{:,} faults, kills and signals at commit {}; {}.".format(
                 sum(total["tried_count"] for total in record.values()), ", ".join(commits),
                 "none failed" if not failed else "failed: " + ", ".join(f"`{name}`" for name in failed)), "",
             "| test | tried | of these |", "|---|---:|---|"]
    for test, totals in tests.items():
        lines.append("| `{}` | {:,} | {} |".format(
            test, sum(total["tried_count"] for _, total in totals),
            ", ".join("{} {:,}".format(command, total["tried_count"]) for command, total in totals if command)))
    calls = {name.partition("/")[2]: dict(re.findall(r"(\w+) (\d+ of \d+)", total["calls"]))
             for name, total in sorted(record.items()) if "calls" in total}
    if calls:
        functions = sorted({function for of in calls.values() for function, text in of.items() if text != "0 of 0"})
        lines += ["", "Of `Faults.AFailedCallLosesNothing`, how many of the calls that a run makes were made to fail:", "",
                  "| command | " + " | ".join(f"`{function}`" for function in functions) + " |",
                  "|---|" + "---:|" * len(functions)]
        lines += ["| {} | {} |".format(command, " | ".join(of.get(function, "none") for function in functions))
                  for command, of in calls.items()]
    return "\n".join(lines) + "\n\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("results", help="the record")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    record = read_json(arguments.results)
    with expecting(arguments.results, "a record of tests/faults/measure.py"):
        text = table(record)
    replace_marked(arguments.document, (BEGIN, END), text, arguments.check,
                   f"the table of {arguments.results}; write it with the command faults")
