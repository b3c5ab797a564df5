#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the counts of a run into the rows of a study, under "known", from which bounds are computed.

    shadowdag study failures -o DIR; tools/studies/update_known.py DIR/failures.json scenes/studies/failures.json
    shadowdag study real FILE... -o DIR; tools/studies/update_known.py DIR/real.json scenes/studies/real.json

Rows that the run does not contain keep their numbers, so that a part (--only) can be updated. A scene that was
measured as "another file" is another scene of the same name: it keeps its numbers, too, and is reported. Prints every
number that increased: check each before you commit it.
"""
import json
import os
import sys

MEASURES = ["false_shadow_count", "false_light_count", "unexplained_count", "acne_count",
            "contact_count", "magnified_count", "missing_tap_count", "mean_error_millionths", "flicker_count"]
WIDTH = 170


def text_of(value, indent=0, lead=0):
    """Returns JSON with short objects and lists on one line."""
    line = json.dumps(value, ensure_ascii=False)
    if not isinstance(value, (dict, list)) or not value or len(line) + indent + lead <= WIDTH:
        return line
    pad = " " * (indent + 2)
    if isinstance(value, dict):
        items = [f"{pad}{json.dumps(key)}: {text_of(item, indent + 2, len(key) + 4)}" for key, item in value.items()]
        return "{\n" + ",\n".join(items) + "\n" + " " * indent + "}"
    items = [pad + text_of(item, indent + 2) for item in value]
    return "[\n" + ",\n".join(items) + "\n" + " " * indent + "]"


def name_of(cell):
    """Returns the row that a cell is of: its failure, or its scene."""
    return cell["failure"] if "failure" in cell else cell["scene"]


def known_of(cells):
    """Returns the cells of a row in the form of "known"; counts of 0 are omitted."""
    known = []
    for cell in cells:
        entry = {"method": cell["method"]}
        if cell.get("remedy", "none") == "off":
            entry["remedy"] = "off"
        elif "remedy" in cell and any(other["remedy"] in ("on", "off", "not read") for other in cells):
            entry["remedy"] = "on"
        entry.update({measure: cell[measure] for measure in MEASURES if cell[measure]})
        known.append(entry)
    return known


def report_rises(name, old, new):
    """Prints the numbers that increased."""
    before = {(entry["method"], entry.get("remedy")): entry for entry in old}
    for entry in new:
        was = before.get((entry["method"], entry.get("remedy")))
        for measure in MEASURES if was else []:
            if entry.get(measure, 0) > was.get(measure, 0):
                print(f"{name} by {entry['method']}, remedy {entry.get('remedy', 'none')}: {measure} rises "
                      f"from {was.get(measure, 0)} to {entry[measure]}")


def main(arguments):
    if len(arguments) != 3:
        print("usage: update_known.py RESULTS.json STUDY.json", file=sys.stderr)
        return 1
    try:
        with open(arguments[1], encoding="utf-8") as file:
            cells = json.load(file)["cells"]
        with open(arguments[2], encoding="utf-8") as file:
            study = json.load(file)
    except (OSError, ValueError, KeyError) as error:
        print(f"update_known.py: {arguments[1]} must be the results and {arguments[2]} the file of a study: {error!r}",
              file=sys.stderr)
        return 2
    foreign = {name_of(cell) for cell in cells if cell.get("known") == "another file"}
    for row in study["rows"]:
        if row["name"] in foreign:
            print(f"{row['name']}: the file that was measured has another geometry_hash; nothing is written")
            continue
        known = known_of([cell for cell in cells if name_of(cell) == row["name"]])
        if known:
            report_rises(row["name"], row.get("known", []), known)
            row["known"] = known
    unfinished = f"{arguments[2]}.new"  # so that a full disk does not damage the study
    try:
        with open(unfinished, "w", encoding="utf-8") as file:
            file.write(text_of(study) + "\n")
        os.replace(unfinished, arguments[2])
    except OSError as error:
        print(f"update_known.py: {arguments[2]}: cannot be written: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
