# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of docs/adjudicator.md from the results of `shadowdag study adjudication`.

    adjudicated docs/adjudicator.md tests/bench/results/adjudication.json [--name REAL] [--beside OTHER.json] [--check]

--beside: results of the same study by a program with another version of Embree, whose scores stand in a table of their own.
The marker lines are `adjudication:begin` and `adjudication:end`, with --name `adjudication-REAL:begin` and so on: a
document may hold the tables of several results. With --check nothing is written, and the file is refused when it differs from the generated text.
"""
from .files import expecting, read_json, replace_marked

VERDICTS = ("Scene", "Triangles", "Pairs", "Lit", "Dark", "Ambiguous", "Of these witnessed")
DISPUTES = ("Scene", "Pairs of the frame", "Disputed", "Ambiguous", "Truth right", "Exact packets right")
DISPUTE_KEYS = ("frame_pair_count", "count", "ambiguous_count", "truth_right_count", "exact_right_count")
SCORES = ("Tracer", "Pairs", "False shadow", "False light", "Wrong", "Ambiguous pairs dark")


def grouped(count):
    return f"{count:,}".replace(",", " ")


def verdict_rows(results):
    """Returns the cells of each scene: what the adjudicator says of its pairs."""
    return [(v["scene"], *(grouped(v[key]) for key in ("triangle_count", "pair_count", "lit_count", "dark_count",
                                                       "ambiguous_count", "witnessed_count")))
            for v in results["verdicts"]]


def score_rows(results):
    """Returns the cells of each tracer, summed over all scenes."""
    keys = ("pair_count", "false_shadow_count", "false_light_count", "wrong_count", "ambiguous_dark_count")
    tracers = dict.fromkeys(cell["tracer"] for cell in results["cells"])
    return [(tracer, *(grouped(sum(cell[key] for cell in results["cells"] if cell["tracer"] == tracer)) for key in keys))
            for tracer in tracers]


def disputed_sums(results, scenes=None):
    """Returns the counts of DISPUTE_KEYS over the scenes of these names, all if there are none."""
    rows = [v["disputed"] for v in results["verdicts"] if scenes is None or v["scene"] in scenes]
    return {key: sum(row[key] for row in rows) for key in DISPUTE_KEYS}


def dispute_rows(results):
    """Returns the cells of each scene with disputed pairs: who is right."""
    return [(v["scene"], *(grouped(v["disputed"][key]) for key in DISPUTE_KEYS))
            for v in results["verdicts"] if v["disputed"]["count"]]


def dispute_text(results):
    """Returns their sums as a sentence."""
    size, sums = results["study"].get("disputed_size", "640x360"), disputed_sums(results)
    return ("In whole frames of {} truth and exact packets differ in {} of {} pairs. Of these {} are ambiguous; in {} the truth is "
            "right, in {} the exact packets.".format(
                size.replace("x", " x "), *(grouped(sums[key]) for key in (
                    "count", "frame_pair_count", "ambiguous_count", "truth_right_count", "exact_right_count"))))


def skipped_text(results):
    """Returns which rows were not measured and why, "" if all were."""
    skipped = results["skipped"]
    return " Skipped: {}.".format("; ".join("{scene}, {reason}".format(**row) for row in skipped)) if skipped else ""


def summary(results):
    """Returns the counts as a sentence."""
    pairs, ambiguous = (sum(v[key] for v in results["verdicts"]) for key in ("pair_count", "ambiguous_count"))
    *others, last = faultless = results["study"]["faultless"]
    wrong = sum(cell["wrong_count"] for cell in results["cells"] if cell["tracer"] in faultless)
    return (f"{grouped(pairs)} pairs of {len(results['verdicts'])} scenes, {grouped(ambiguous)} of them ambiguous; "
            f"of the others, {', '.join(others)} and {last} answer {grouped(wrong)} wrongly." + skipped_text(results))


def rows_of(headings, rows):
    return ["| " + " | ".join(headings) + " |", "|---" + "|---:" * (len(headings) - 1) + "|",
            *("| " + " | ".join(cells) + " |" for cells in rows)]


def version_rows(results, other):
    """Returns the cells of each tracer: its wrong answers by either version of Embree, false shadow and false light."""
    scores = [{row[0]: row for row in score_rows(of)} for of in (results, other)]
    return [(tracer, *(f"{row[4]} ({row[2]}, {row[3]})" if row else "–" for row in (of.get(tracer) for of in scores)))
            for tracer in scores[0]]


def version_text(results, other):
    """Returns what is said of two programs that were asked about the same scenes."""
    keys = ("scene", "pair_count", "lit_count", "dark_count", "ambiguous_count")
    mine, theirs = ({v["scene"]: tuple(v[key] for key in keys) for v in of["verdicts"]} for of in (results, other))
    different = [scene for scene in mine if mine[scene] != theirs.get(scene)]
    return ("The same study by a program with Embree {embree} ({system}, {compiler}, commit {commit}): ".format(**other["provenance"]) +
            (f"its verdicts differ in {', '.join(different)}." if different else "its verdicts are the same in every scene."))


def command_of(name):
    return f"shadowdag study adjudication_{name} FOLDER" if name else "shadowdag study adjudication"


def table(results, name="", other=None):
    """Returns everything between the markers.

    other: results of another version of Embree, or None
    """
    provenance, disputes = results["provenance"], dispute_rows(results)
    lines = ["", summary(results) + " `{} -o adjudication` (preset {preset}, {compiler}).".format(command_of(name), **provenance),
             "", *rows_of(SCORES, score_rows(results))]
    if other:
        versions = (f"Embree {of['provenance']['embree']}: wrong (false shadow, false light)" for of in (results, other))
        lines += ["", version_text(results, other), "", *rows_of(("Tracer", *versions), version_rows(results, other))]
    lines += ["", dispute_text(results)]
    lines += ["", *rows_of(DISPUTES, disputes)] if disputes else []
    lines += ["", *rows_of(VERDICTS, verdict_rows(results))]
    return "\n".join(lines) + "\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("results", help="the results of the study")
    parser.add_argument("--name", default="", help="of the marker lines and the study, for others than the program's scenes")
    parser.add_argument("--beside", help="results of the same study by a program with another version of Embree")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    results = read_json(arguments.results)
    other = read_json(arguments.beside) if arguments.beside else None
    with expecting(arguments.results, "a result of study adjudication"):
        text = table(results, arguments.name, other)
    marker = "adjudication" + (f"-{arguments.name}" if arguments.name else "")
    replace_marked(arguments.document, (f"<!-- {marker}:begin -->", f"<!-- {marker}:end -->"), text, arguments.check,
                   f"the tables of {arguments.results}; write them with the command adjudicated")
