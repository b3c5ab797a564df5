# SPDX-License-Identifier: Apache-2.0
"""Checks the documents: README's size, every relative link, every mentioned file, the steps of docs/developing.md, the
numbers of README's claims, and that no merge conflict is left.

    docs.py SOURCE_DIR      checks the tree, after checking itself on planted violations
"""
import json
import pathlib
import re
import sys
import tempfile

from sources import CODE_SUFFIXES, expect, project_files, read, report

README_LINES, README_COLUMNS = 150, 120
DEVELOPING = "docs/developing.md"
MARKER = re.compile(r"^(?:<{7} |={7}$|>{7} )", re.MULTILINE)
LINK = re.compile(r"\]\(([^()\s#]*)(#[^()\s]*)?\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
# A step of docs/developing.md: a numbered item that starts with a link names the file and, in brackets, an anchor: text
# that the file holds at the place to edit.
STEP = re.compile(r"^\d+\. \[`?([^\]`]+)`?\]\(([^)]+)\)(?: \(`([^`]+)`\))?", re.MULTILINE)
# A path below one of our folders, as comments and documents name it.
FOLDERS = "cuda|gl|scenes|voxel|shadowmap|hybrid|tools|tests|docs|workflow|cmake"
MENTION = re.compile(rf"(?<![\w./-])((?:{FOLDERS})/[\w./-]*\w\.(?:h|cpp|cu|py|md|glsl|comp|json))\b(?![*<{{])")
MENTIONING = CODE_SUFFIXES + (".md", ".py", ".glsl", ".comp", ".frag", ".vert", ".cmake")
COMMENT = re.compile(r"//.*$", re.MULTILINE)
# Documents that are not part of the project.
OUTSIDE = re.compile(r"\bfailure \d+\b|\bARCHITECTURE\b(?!S|\})|\bCONVENTIONS\b|\bINTERFACE\.md|\bDIGEST\b|\bshared/[A-Z]\w+\.md|"
                     r"\b[Ii]ssue #?\d+\b")


def anchor_of(heading):
    """Returns the anchor that GitHub gives a heading."""
    text = re.sub(r"[`*]|\[|\]\([^)]*\)", "", heading).strip().lower()
    return "#" + re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def check_links(root, path, text):
    """Returns the links of a document that lead nowhere."""
    violations = []
    for target, anchor in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        file = root / path.parent / target if target else root / path
        if not file.exists():
            violations.append(f"{path}: links to '{target}', which does not exist")
        elif anchor and file.suffix == ".md" and anchor not in map(anchor_of, HEADING.findall(file.read_text())):
            violations.append(f"{path}: links to '{target}{anchor}', which has no such heading")
    return violations


def check_mentions(path, text, known):
    """Returns the files of this project that a document or a comment mentions and that do not exist, and what it cites
    from elsewhere. NAME in a path stands for any name."""
    if path.suffix in CODE_SUFFIXES:
        text = "\n".join(COMMENT.findall(text))
    violations = [f"{path}: mentions '{name}', which does not exist"
                  for name in sorted(set(MENTION.findall(text))) if name not in known and "NAME" not in name]
    return violations + [f"{path}: cites '{cited}', which is not in the repository"
                         for cited in sorted(set(OUTSIDE.findall(text)))]


def check_readme(text):
    """Returns what is wrong with README's size."""
    lines = text.splitlines()
    violations = []
    if len(lines) > README_LINES:
        violations.append(f"README.md: {len(lines)} lines; {README_LINES} at most, the rest belongs into docs/")
    violations += [f"README.md:{number}: {len(line)} columns; {README_COLUMNS} at most"
                   for number, line in enumerate(lines, 1) if len(line) > README_COLUMNS]
    return violations


def check_developing(root, text):
    """Returns the steps that name no file or anchor, or one that does not exist."""
    violations = []
    sections = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    for section in sections:
        title = section.splitlines()[0]
        steps = STEP.findall(section)
        if title.startswith("Add ") and not steps:
            violations.append(f"{DEVELOPING}: '{title}' has no step that names a file")
        for name, target, anchor in steps:
            file = root / "docs" / target
            if not file.is_file():
                violations.append(f"{DEVELOPING}: '{title}' names '{name}', which does not exist")
            elif file.resolve() != (root / name).resolve():
                violations.append(f"{DEVELOPING}: '{title}' says '{name}' and links to '{target}'")
            elif not anchor:
                violations.append(f"{DEVELOPING}: '{title}' names no anchor in '{name}'")
            elif anchor not in file.read_text():
                violations.append(f"{DEVELOPING}: '{title}' names '{anchor}', which '{name}' does not hold")
    if not sections:
        violations.append(f"{DEVELOPING}: has no sections")
    return violations


def claims_of(results):
    """Returns what README must say, word for word, from the committed results."""
    def load(name):
        return json.loads((results / name).read_text())
    runs = {run["label"]: run for run in load("compare-atrium.json")["runs"]}
    dag, maps, exact = runs["dag 4096^3"], runs["maps"], runs["dag-exact 4096^3"]
    validations = [load(path.name) for path in sorted(results.glob("validate-*-dag-exact.json"))]
    wrong = sum(v["false_shadow_count"] + v["false_light_count"] for v in validations)
    rates = {r["tracer"]: r["megarays_per_s"] for r in load("bench-voxel-atrium-4096.json")["rates"] if r["order"] == "cluster"}
    mebibytes = [(run["dag_bytes"] + run["map_bytes"]) / 2.0**20 for run in (dag, maps)]
    return [
        f"{dag['time_ms']:.0f} ms through the DAG at 4096^3 and {maps['time_ms']:.0f} ms with maps",
        f"{dag['mean_abs_visibility_error']:.4f} and {maps['mean_abs_visibility_error']:.4f}",
        "{:.1f} and {:.1f} MiB".format(*mebibytes),
        "all but {} of {} pairs".format(wrong, f"{sum(v['pair_count'] for v in validations):,}".replace(",", " ")),
        f"{exact['time_ms']:.0f} ms a frame",
        f"{rates['traceStream AVX-512']:.2f} million rays",
        f"`rtcOccluded1` traces {rates['rtcOccluded1']:.2f}, `rtcOccluded16` {rates['rtcOccluded16']:.2f}",
        f"NanoVDB's HDDA {rates['NanoVDB HDDA']:.2f}",
    ]


def check_claims(text, claims):
    """Returns the claims that README does not state as they were measured."""
    flat = " ".join(text.split())
    return [f"README.md: does not say '{claim}', as the committed results do" for claim in claims if claim not in flat]


def check(root, claims):
    """Returns the violations of the tree, and the number of files looked at."""
    root = pathlib.Path(root)
    files = [path for path in project_files(root) if path.suffix in MENTIONING]
    known = {str(path) for path in project_files(root)}
    violations = []
    for path in files:
        text = read(root, path)
        if MARKER.search(text):
            violations.append(f"{path}: holds the markers of a merge conflict")
        if path.suffix == ".md":
            violations += check_links(root, path, text)
        if path.parts[:2] != ("tests", "house"):  # the checks plant what they look for
            violations += check_mentions(path, text, known)
    readme = read(root, "README.md")
    violations += check_readme(readme) + check_claims(readme, claims)
    violations += check_developing(root, read(root, DEVELOPING))
    return violations, len(files)


def self_test():
    """Plants one violation of each kind, and clean files, and sees the check tell them apart."""
    developing = ("# Developing\n## Add a row\n1. [`tools/a.cpp`](../tools/a.cpp) (`kRows`): add one.\n"
                  "2. [`tools/a.cpp`](../tools/a.cpp) (`kGone`): add one.\n3. [`tools/b.cpp`](../tools/b.cpp) (`kRows`)\n"
                  "4. [`tools/a.cpp`](../tools/a.cpp): no anchor\n5. [`tools/c.h`](../tools/a.cpp) (`kRows`)\n## Add nothing\nText.\n")
    planted = {
        "README.md": "short\nthe claim\nholds [x](docs/x.md#the-x-y)\n",
        "docs/developing.md": developing,
        "docs/x.md": "# The `X` y\n[gone](gone.png), [here](#nowhere), [far](https://example.org/gone)\nSee tools/gone.cpp and tools/NAME.cpp.\n" + "<" * 7 + " ours\n",
        "tools/a.cpp": "int kRows; // see tools/a.cpp, not tools/old.h (" + "failure" + " 12)\nconst char* f = \"tools/made.json\";\n",
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in planted.items():
            (root / name).parent.mkdir(exist_ok=True)
            (root / name).write_text(text)
        violations, checked = check(root, ["the claim holds", "another claim"])
        expected = ["'kGone'", "names 'tools/b.cpp'", "names no anchor", "says 'tools/c.h'", "'Add nothing' has no step",
                    "'gone.png'", "'#nowhere'", "'tools/gone.cpp'", "'tools/old.h'", "cites 'failure", "'another claim'"]
        # The links of the planted steps to files that do not exist are found as links, too.
        expected += ["links to '../tools/b.cpp'", "docs/x.md: holds the markers"]
        expect(checked == len(planted), f"{checked} files seen")
        for part in expected:
            expect(sum(part in v for v in violations) == 1, f"wanted one violation with {part}, got {violations}")
        extra = [v for v in violations if not any(part in v for part in expected)]
        expect(not [v for v in extra if "mentions 'tools/" not in v], f"not wanted: {extra}")
    expect(len(check_readme("x\n" * (README_LINES + 1))) == 1, "a README that is too long")
    expect(len(check_readme("x" * (README_COLUMNS + 1))) == 1, "a README that is too wide")
    expect(not check_readme("x" * README_COLUMNS + "\n" + "x\n" * (README_LINES - 1)), "a README of the right size")


if __name__ == "__main__":
    self_test()
    source = pathlib.Path(sys.argv[1])
    sys.exit(report("documents", *check(source, claims_of(source / "tests/bench/results"))))
