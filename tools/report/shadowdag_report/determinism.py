# SPDX-License-Identifier: Apache-2.0
"""Writes the table of determinism in docs/promises.md from the hashes of tests/determinism/measure.py.

    determinism docs/promises.md tests/bench/results/determinism.json [--check]

With --check nothing is written, and the file is refused when it differs from the generated text.
"""
from .files import Refused, expecting, read_json, replace_marked

BEGIN, END = "<!-- determinism:begin -->", "<!-- determinism:end -->"
# Differences from the reference, the first compiler's portable code on one thread of the CPU, that are known: (back end,
# end of what was hashed) and the reason.
EXPLANATIONS = {
    ("gl", "counts"): "OpenGL's rasterizer sees other triangles at outlines and on coplanar faces, so samples and pairs "
                      "differ there; `FrameGlScene.EqualsTheCpu` bounds how many",
    ("gl", "picture"): "OpenGL shows these other samples, and its colours are a few roundings apart "
                       "(`FrameGlScene.EqualsTheCpu`)",
}


def column(row):
    """Returns the heading of a row's column: the system without its code name, the architecture unless it is x86-64, the compiler, and
    where it ran."""
    system = " ".join([row["system"].partition(" (")[0], *([row["architecture"]] if row.get("architecture") else [])])
    where = "{backend} on {device}".format(**row) if row["device"] else row["backend"]
    return "{}, {}, {}".format(system, row["compiler"], where)


def grouped(results):
    """Returns {what: {heading of a column: [(row, is it equal to the reference)]}}."""
    groups = {}
    for row in results["rows"]:
        groups.setdefault((row["scene"], row["what"]), []).append(row)
    table = {}
    for (_, what), rows in groups.items():
        for row in rows:
            table.setdefault(what, {}).setdefault(column(row), []).append(
                (row, row["hash"] == rows[0]["hash"]))
    return table


def explanation(row):
    return EXPLANATIONS.get((row["backend"], row["what"].split(", ")[-1]))


def unexplained(results):
    """Returns a line for each hash that differs from the reference without an explanation."""
    return ["{scene}, {what}: {hash} by {column}, {isa}, {threads} threads differs".format(column=column(row), **row)
            for columns in grouped(results).values() for rows in columns.values() for row, is_equal in rows
            if not is_equal and not explanation(row)]


def cell(rows):
    """Returns how many hashes of a cell equal the reference."""
    equal = sum(is_equal for _, is_equal in rows)
    return "all {}".format(len(rows)) if equal == len(rows) else "{} of {}".format(equal, len(rows))


def table(results):
    """Returns everything between the markers."""
    content = grouped(results)
    columns = list(dict.fromkeys(heading for cells in content.values() for heading in cells))
    scenes = list(dict.fromkeys(row["scene"] for row in results["rows"]))
    lines = ["", "{:,} hashes of {} scenes ({}). A cell counts the hashes that equal those of {}, portable code, one "
             "thread.".format(len(results["rows"]), len(scenes), ", ".join(scenes), columns[0]), ""]
    if results["left_out"]:
        lines += ["Not measured, because no machine supports it: {}.".format(", ".join(results["left_out"])), ""]
    lines += ["| hash of | " + " | ".join(columns) + " |",
              "|---|" + "---:|" * len(columns)]
    for what, cells in content.items():
        lines.append("| {} | {} |".format(what, " | ".join(cell(cells[c]) if c in cells else "–" for c in columns)))
    for title, key in (("instruction sets", "isa"), ("threads", "threads")):
        used = {c: dict.fromkeys(str(row[key]) for row in results["rows"] if column(row) == c) for c in columns}
        lines.append("| {} | {} |".format(title, " | ".join(", ".join(used[c]) for c in columns)))
    programs = {column(row): results["provenance"][row["program"]] for row in results["rows"]}
    lines.append("| commit | {} |".format(" | ".join(programs[c]["commit"] for c in columns)))
    lines.append("| processor | {} |".format(" | ".join(programs[c]["cpu"] for c in columns)))
    reasons = {}
    for what, cells in content.items():
        for rows in cells.values():
            for row, is_equal in rows:
                if not is_equal:
                    reasons.setdefault(explanation(row), {}).setdefault(what, set()).add(row["scene"])
    lines += [""] if reasons else ["", "No hash differs."]
    for reason, places in reasons.items():
        lines.append("- {} ({}).".format(reason, "; ".join(
            "{}: {}".format(what, ", ".join(sorted(scenes))) for what, scenes in places.items())))
    return "\n".join(lines) + "\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("results", help="the hashes")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    results = read_json(arguments.results)
    with expecting(arguments.results, "hashes of tests/determinism/measure.py"):
        text = table(results)
        lines = unexplained(results)
    if lines:
        raise Refused("{}: {} differences have no explanation: {}".format(arguments.results, len(lines), lines[0]))
    replace_marked(arguments.document, (BEGIN, END), text, arguments.check,
                   f"the table of {arguments.results}; write it with the command determinism")
