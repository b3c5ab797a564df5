#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes tools/studies/failures_known.cpp: what was measured once of every cell of the matrix of failures,
or tools/studies/real_known.cpp, the same of real scenes.

    shadowdag compare failures -o DIR; tools/report/failure_known.py DIR/failures.json tools/studies/failures_known.cpp
    shadowdag compare real FILE... -o DIR; tools/report/failure_known.py DIR/real.json tools/studies/real_known.cpp

Bounds follow from it by boundOf (tools/studies/failures.h). Cells that the file does not hold keep their old
numbers, so that a part (--only) can be written anew. Prints every number that got larger: look at
each before you commit it.
"""
import json
import os
import re
import sys

METHODS = {"maps": "kMaps", "dag": "kDag", "dag-exact": "kDagExact", "hybrid": "kHybrid"}
MEASURES = ["false_shadow_count", "false_light_count", "unexplained_count", "acne_count",
            "contact_count", "missing_tap_count", "mean_error_millionths", "flicker_count"]
TABLES = {  # by the file that is written: header, function, the run's file, what columns begin with
    "failures_known.cpp": ("failures.h", "knownCells", "failures.json", "failure, method, remedy on"),
    "real_known.cpp": ("real_scenes.h", "knownRealCells", "real.json", "scene, method, true"),
}
HEAD = """// SPDX-License-Identifier: Apache-2.0
// Written by tools/report/failure_known.py out of a run's {run}; not to be edited.
// Columns: {columns}; false shadow, false light, unexplained, acne, contact, missing
// taps, mean error in millionths, flicker.
#include "tools/{header}"

namespace shadowdag {{

// clang-format off
const std::vector<KnownCell>& {function}() {{
    using enum MatrixMethod;
    static const std::vector<KnownCell> cells = {{
"""
TAIL = """    };
    return cells;
}
// clang-format on

} // namespace shadowdag
"""


def read_table(text):
    """Returns {(failure, method's constant, remedy on): counts} of a table as this script writes it."""
    rows = {}
    for name, method, is_on, counts in re.findall(
            r'\{"([\w-]+)", (k\w+), (true|false), \{\{([\d, ]+)\}\}\}', text):
        rows[name, method, is_on] = [int(count) for count in counts.split(",")]
    return rows


def name_of(cell):
    """Returns what a cell is known by: its failure, or its scene."""
    return cell["failure"] if "failure" in cell else cell["scene"]


def main(arguments):
    if len(arguments) != 3:
        print("usage: failure_known.py failures.json failures_known.cpp", file=sys.stderr)
        return 1
    table = TABLES.get(os.path.basename(arguments[2]))
    if table is None:
        print(f"failure_known.py: {arguments[2]}: must be one of {', '.join(TABLES)}", file=sys.stderr)
        return 1
    try:
        with open(arguments[1], encoding="utf-8") as file:
            cells = json.load(file)["cells"]
    except (OSError, ValueError, KeyError) as error:
        print(f"failure_known.py: {arguments[1]}: holds no cells of a compare: {error!r}",
              file=sys.stderr)
        return 2
    with open(arguments[2], encoding="utf-8") as file:
        old = read_table(file.read())
    rows = {}
    for cell in cells:
        name = name_of(cell)
        remedy = cell.get("remedy", "none")
        key = (name, METHODS[cell["method"]], "false" if remedy == "off" else "true")
        rows[key] = [cell[measure] for measure in MEASURES]
        for measure, now, before in zip(MEASURES, rows[key], old.get(key, rows[key])):
            if now > before:
                print(f"{name} by {cell['method']}, remedy {remedy}: {measure} rises "
                      f"from {before} to {now}")
    failures = {name_of(cell) for cell in cells}
    rows = {key: value for key, value in old.items() if key[0] not in failures} | rows
    with open(arguments[2], "w", encoding="utf-8") as file:
        header, function, run, columns = table
        file.write(HEAD.format(header=header, function=function, run=run, columns=columns))
        for (name, method, is_on), counts in rows.items():
            numbers = ", ".join(str(count) for count in counts)
            file.write(f'        {{"{name}", {method}, {is_on}, {{{{{numbers}}}}}}},\n')
        file.write(TAIL)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
