# SPDX-License-Identifier: Apache-2.0
"""Writes the table of docs/mutants.md from the results of `shadowdag study mutants`.

    mutation docs/mutants.md tests/bench/results/mutants.json [--check]

With --check nothing is written, and the file is refused when it differs from the generated text.
"""
from .files import expecting, read_json, replace_marked

BEGIN, END = "<!-- mutants:begin -->", "<!-- mutants:end -->"
HEADINGS = ("Fault", "What is wrong", "Noticed by", "By validate", "In rows", "Additional wrong pairs", "Explained away, %")
NONE = "none"
SELF_CHECKS = ("pairs", "samples", "hidden", "picture", "resolution", "lookup", "belief", "level", "proven")


def unique(words):
    return list(dict.fromkeys(word for word in words if word))


def noticed_by(mutant):
    """Returns the checks that notice a fault, those above a bound first."""
    checks = unique(notice["check"] for notice in mutant["notices"])
    return sorted(checks, key=lambda check: check.endswith(" too low"))


def seen_by_validate(mutant):
    """Returns whether `validate`, which knows no recorded counts, says that the frame is not what its method promises."""
    return any(notice["check"] in SELF_CHECKS for notice in mutant["notices"])


def excess_of(mutant):
    """Returns how many more wrong pairs a fault makes, and how many of these the resolution explains."""
    wrong, explained = (sum(row[key] for row in mutant.get("excess", ())) for key in ("wrong_count", "explained_count"))
    return wrong, min(max(explained, 0), wrong)


def hidden_share(mutant):
    """Returns the share of a fault's wrong pairs that the class "explained" hides; None without any."""
    wrong, explained = excess_of(mutant)
    return explained / wrong if wrong else None


def rows(results):
    """Returns the cells of each fault's row."""
    lines = []
    for mutant in results["mutants"]:
        share = hidden_share(mutant)
        checks = ", ".join(check.replace("_", " ").removesuffix(" count") for check in noticed_by(mutant))
        if mutant["ended"]:
            checks += f': {mutant["ended"]}'
        if mutant["name"] != NONE and not checks:
            checks = "nothing: " + (mutant["harmless"] or "survives")
        lines.append((mutant["name"], mutant["what"], checks or "nothing, as it must be",
                      "yes" if seen_by_validate(mutant) else "–",
                      ", ".join(unique(notice["row"] for notice in mutant["notices"])),
                      f"{excess_of(mutant)[0]:,}".replace(",", " ") if share is not None else "–",
                      f"{100 * share:.0f}" if share is not None else "–"))
    return lines


def summary(results):
    """Returns the counts as a sentence."""
    faults = [m for m in results["mutants"] if m["name"] != NONE and not m["harmless"]]
    survivors = [m["name"] for m in faults if not m["notices"]]
    return "{} faults, {} of them noticed{}, {} by what `validate` holds any frame against, without recorded counts.".format(
        len(faults), len(faults) - len(survivors), ", not " + ", ".join(survivors) if survivors else "", sum(map(seen_by_validate, faults)))


def power_text(results):
    """Returns for which faults more than half of the wrong pairs are explained."""
    shares = {m["name"]: hidden_share(m) for m in results["mutants"] if hidden_share(m) is not None}
    hidden = [name for name, share in shares.items() if share > 0.5]
    return ("{} of these faults make more wrong pairs in the rows of the table of failures. Of {}, more than half of these pairs count as "
            "explained, so there the class says little{}.".format(
                len(shares), len(hidden) or "none", ": " + ", ".join(f"`{name}`" for name in hidden) if hidden else ""))


def table(results):
    """Returns everything between the markers."""
    provenance = results["provenance"]
    lines = ["", summary(results) + " `shadowdag study mutants -o mutants` (preset {preset}, {compiler}).".format(**provenance), "", power_text(results), "",
             "| " + " | ".join(HEADINGS) + " |", "|---" * (len(HEADINGS) - 2) + "|---:" * 2 + "|"]
    lines += ["| " + " | ".join((f"`{name}`", *cells)) + " |" for name, *cells in rows(results)]
    return "\n".join(lines) + "\n"


def declare(parser):
    parser.add_argument("document", help="the file that holds the marker lines")
    parser.add_argument("results", help="the results of the study")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    results = read_json(arguments.results)
    with expecting(arguments.results, "a result of study mutants"):
        text = table(results)
    replace_marked(arguments.document, (BEGIN, END), text, arguments.check, f"the table of {arguments.results}; write it with the command mutation")
