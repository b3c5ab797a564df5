# SPDX-License-Identifier: Apache-2.0
"""Checks the documents: README's size, every relative link, every mentioned file, the steps of docs/developing.md, the
numbers of README's claims and of the prose of docs/ (prose.py, stated_numbers.py), the tests of docs/promises.md, that the gallery shows every
picture, and that no merge conflict is left.

    docs.py SOURCE_DIR      checks the tree, after checking itself on planted violations
"""
import json
import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools/report"))
from shadowdag_report.intervals import confidence_text, interval, least_confidence, pair_time  # noqa: E402
from shadowdag_report.texels import PAPER_TEXELS  # noqa: E402

from prose import check_prose, main_scenes, prose_of, wrong as wrong_share
from stated_numbers import EXCEPTIONS, ONCE, UNBACKED, check_numbers
from sources import CODE_SUFFIXES, expect, project_files, read, report

README_LINES, README_COLUMNS = 150, 120
DEVELOPING = "docs/developing.md"
MARKER = re.compile(r"^(?:<{7} |={7}$|>{7} )", re.MULTILINE)
LINK = re.compile(r"\]\(([^()\s#]*)(#[^()\s]*)?\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
# A step of docs/developing.md: a numbered item that starts with a link names the file and, in brackets, an anchor: text
# that the file holds at the place to edit.
STEP = re.compile(r"^\d+\. \[`?([^\]`]+)`?\]\(([^)]+)\)(?: \(`([^`]+)`\))?", re.MULTILINE)
PROMISES = "docs/promises.md"
# A test as C++, CMake and the checks of this folder declare it, and as docs/promises.md names it.
TESTS = re.compile(r"^TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", re.MULTILINE)
CMAKE_TESTS = re.compile(r"add_test\(NAME ([\w.]+)")
HOUSE_TESTS = re.compile(r"^sdag_add_check\((\w+)", re.MULTILINE)
FUZZ_TARGETS = re.compile(r"^set\(targets ([\w\s]+)\)", re.MULTILINE)
PROMISED_ROW = re.compile(r"^\| (.+) \| (.+) \|$", re.MULTILINE)
TEST_NAME = re.compile(r"`(\w+\.\w+)`")
# A key that the reader of a study asks for.
STUDY_KEY = re.compile(r'\.(?:choices?|flag|list|numbers?|object|required|requiredNumber|settings|texts?)\(\s*"(\w+)"')
STUDY_KINDS = ("failures", "real", "stability", "ablation", "mutants", "adjudication", "scale")
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
    """Returns the broken links of a document."""
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
    """Returns the missing files of this project that a document or a comment mentions, and its citations of other
    documents. NAME in a path means any name."""
    if path.suffix in CODE_SUFFIXES:
        text = "\n".join(COMMENT.findall(text))
    violations = [f"{path}: mentions '{name}', which does not exist"
                  for name in sorted(set(MENTION.findall(text))) if name not in known and "NAME" not in name]
    return violations + [f"{path}: cites '{cited}', which is not in the repository"
                         for cited in sorted(set(OUTSIDE.findall(text)))]


def check_readme(text):
    """Returns the violations of README's size."""
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


def check_studies(document, readers):
    """Returns the keys that a study's reader asks for and that docs/studies.md lacks in the section of its kind.

    @param readers the text of a kind's reader, by kind
    """
    sections = {text.split()[0]: text for text in re.split(r"^## ", document, flags=re.MULTILINE)[1:]}
    return [f"docs/studies.md: '## {kind}' does not describe the key '{key}'"
            for kind, text in readers.items() for key in sorted(set(STUDY_KEY.findall(text)) - {"name"})
            if f"`{key}`" not in sections.get(kind, "")]


def tests_of(cpp, cmake, house, fuzz):
    """Returns the names of all tests in these texts."""
    return ({f"{suite}.{name}" for suite, name in TESTS.findall(cpp)} | set(CMAKE_TESTS.findall(cmake))
            | {f"House.{name}" for name in HOUSE_TESTS.findall(house)}
            | {f"Fuzz.{name}" for names in FUZZ_TARGETS.findall(fuzz) for name in names.split()})


def check_promises(text, tests):
    """Returns the promises without a test, and the tests that do not exist."""
    rows = PROMISED_ROW.findall(re.sub(r"<!-- \w+:begin -->.*?<!-- \w+:end -->", "", text, flags=re.DOTALL))
    if ("promise", "tested by") not in rows:
        return [f"{PROMISES}: has no table of promises"]
    violations = []
    for promise, held in rows:
        names = TEST_NAME.findall(held)
        if not names and held not in ("tested by", "the same"):
            violations.append(f"{PROMISES}: no test holds '{promise}'")
        violations += [f"{PROMISES}: names the test '{name}', which does not exist" for name in names if name not in tests]
    return violations


def check_gallery(text, pictures):
    """Returns the pictures of docs/ that the gallery does not show. Of a chart with two forms it shows one."""
    shown = {pathlib.Path(target).stem for target in re.findall(r"!\[[^]]+\]\(([^)]+)\)", text)}
    return [f"docs/gallery.md: does not show {picture}" for picture in pictures if pathlib.Path(picture).stem not in shown]


def check_statuses(guide, help_text):
    """Returns what the user guide and the program's help say differently of exit statuses."""
    in_guide = re.findall(r"^\| (\d) \| (.*?) \|$", guide, re.MULTILINE)
    in_help = re.findall(r'^\s*"  (\d) (.*)\\n"$', help_text, re.MULTILINE)
    if in_guide and [(number, meaning.replace("`", "")) for number, meaning in in_guide] == in_help:
        return []
    return [f"docs/user_guide.md: the exit statuses are {in_guide}, and {in_help} in the help"]


def bench_claims(bench):
    """Returns what README's third claim says of a result of `bench voxel`: medians with their intervals, and n. Embree's fastest call is
    named beside rtcOccluded16, which the method `embree` uses, where it is another one."""
    rates = {r["tracer"]: {"repeat_count": bench["repeat_count"]} | r for r in bench["rates"] if r["order"] == "cluster"}
    of_pair = {m["method"]: pair_time(m, bench["repeat_count"]) for m in bench["frame"]["methods"]}
    def text(row, key, decimals):
        low, high, _ = interval(row, key)
        return f"{row[key]:.{decimals}f} ({low:.{decimals}f} to {high:.{decimals}f})"
    rate = lambda name: text(rates[name], "megarays_per_s", 2)
    pair = lambda name: text(of_pair[name], "ns_per_pair", 0)
    held = min([least_confidence(rates.values(), "megarays_per_s"), least_confidence(of_pair.values(), "ns_per_pair")])
    fastest = max((name for name in rates if name.startswith("rtcOccluded")), key=lambda name: rates[name]["megarays_per_s"])
    calls = dict.fromkeys(("rtcOccluded1", "rtcOccluded16", fastest))
    measured = [name for name in ("rtcOccluded8", "rtcOccluded16") if name in of_pair]
    return [
        f"Streams take {pair('exact streams')} ns a pair, " + ", ".join(f"`{name}` takes {pair(name)}" for name in measured),
        f"(medians of {bench['repeat_count']} with the intervals that hold them with {confidence_text(held)})",
        f"{rate('traceStream AVX2')} million rays",
        ", ".join(f"`{name}` traces {rate(name)}" if i == 0 else f"`{name}` {rate(name)}" for i, name in enumerate(calls)),
        f"NanoVDB's HDDA {rate('NanoVDB HDDA')}"]


def chart_claims(compared, exact_ms):
    """Returns what README says of its chart: its time by exact rays beside that of the claims, and that 96 texels draw every map."""
    exact = next(run for run in compared["runs"] if run["label"] == "dag believe none")
    requests = [cost["texels"] for cost in compared["map_costs"]]
    if min(requests) < PAPER_TEXELS:
        return [f"(a map requests {min(requests):.0f} texels: rewrite what README says of {PAPER_TEXELS})"]
    low, high, _ = interval(exact)
    return [f"exact rays take {exact['time_ms']:.0f} ({low:.0f} to {high:.0f}) ms in this chart and {exact_ms:.0f} ms in the claims",
            f"A cross marks the paper's threshold of {PAPER_TEXELS} texels: every map of this view requests more"]


def claims_of(results):
    """Returns the literal claims of README, from the committed results."""
    def load(name):
        return json.loads((results / name).read_text())
    scenes = main_scenes(results)
    runs = scenes["atrium"]
    over = {label: sorted(of[label]["time_over_embree"] for of in scenes.values()) for label in ("dag believe none", "maps", "maps warm")}
    warm_wrong = sorted(wrong_share(of["maps warm"]) for of in scenes.values())
    labels = ("dag believe none", "embree", "dag 4096^3 believe all", "maps")
    exact, embree, dag, maps = (runs[label] for label in labels)
    validations = [load(path.name) for path in sorted(results.glob("validate-*-dag-none.json"))]
    wrong = sum(v["false_shadow_count"] + v["false_light_count"] for v in validations)
    disputes = {(v["scene"], v["disputed"]["frame_pair_count"]): v["disputed"]
                for name in ("adjudication.json", "adjudication_real.json") for v in load(name)["verdicts"]}
    asked = [disputes.get((v["scene"].removeprefix("builtin:").removesuffix(".glb"), v["pair_count"])) for v in validations]
    ambiguous = sum(d["ambiguous_count"] for d in asked if d)
    mebibytes = [(run["dag_bytes"] + run["map_bytes"] + run.get("exact_bytes", 0)) / 2.0**20 for run in (exact, embree, dag, maps)]
    return [
        f"{exact['time_ms']:.0f} ms by rays that believe no voxel, {embree['time_ms']:.0f} ms by Embree's packets, "
        f"{dag['time_ms']:.0f} ms through the DAG at 4096^3 and {maps['time_ms']:.0f} ms with maps",
        "{:.5f}, {:.5f}, {:.4f} and {:.4f}".format(*(run["mean_abs_visibility_error"] for run in (exact, embree, dag, maps))),
        "{:.1f}, {:.1f}, {:.1f} and {:.1f} MiB".format(*mebibytes),
        "all but {} of {} pairs".format(wrong, f"{sum(v['pair_count'] for v in validations):,}".replace(",", " ")),
        "the adjudicator](docs/adjudicator.md#results) finds {} of these ambiguous".format("all" if ambiguous == wrong else ambiguous),
        "{:.2f} to {:.2f} times as long as Embree's frame".format(over["dag believe none"][0], over["dag believe none"][-1]),
        "{:.2f} to {:.2f} times as long when they are drawn anew, {:.2f} to {:.2f} times when a frame of the same view left them".format(
            over["maps"][0], over["maps"][-1], over["maps warm"][0], over["maps warm"][-1]),
        "{:.2f} to {:.1f} % of the pairs wrong".format(warm_wrong[0], warm_wrong[-1]),
    ] + chart_claims(load("compare-atrium.json"), exact["time_ms"]) + bench_claims(load("bench-voxel-atrium-4096.json"))


def check_claims(text, claims):
    """Returns the claims that README lacks or states differently."""
    flat = " ".join(text.split())
    return [f"README.md: does not say '{claim}', as the committed results do" for claim in claims if claim not in flat]


def check(root, claims):
    """Returns the violations of the tree, and the number of files checked."""
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
        if path.parts[:2] != ("tests", "house"):  # the checks plant violations themselves
            violations += check_mentions(path, text, known)
    readme = read(root, "README.md")
    violations += check_readme(readme) + check_claims(readme, claims)
    violations += check_developing(root, read(root, DEVELOPING))
    return violations, len(files)


def check_against_sources(root):
    """Returns where documents differ from the sources that they describe."""
    readers = {kind: read(root, f"tools/studies/{kind}_study.cpp") for kind in STUDY_KINDS}
    cpp, cmake = ("\n".join(read(root, path) for path in project_files(root)
                            if path.parts[0] == "tests" and (path.suffix == suffix or path.name == suffix))
                  for suffix in (".cpp", "CMakeLists.txt"))
    tests = tests_of(cpp, cmake, read(root, "tests/house/CMakeLists.txt"), read(root, "tests/fuzz/CMakeLists.txt"))
    stated = prose_of(root / "tests/bench/results")
    pictures = sorted(path.name for path in project_files(root) if str(path.parent) == "docs" and path.suffix in (".png", ".svg"))
    return (check_studies(read(root, "docs/studies.md"), readers)
            + check_promises(read(root, PROMISES), tests)
            + [v for document, texts in stated.items() for v in check_prose(document, read(root, document), texts)]
            + [v for document, exceptions in EXCEPTIONS.items()
               for v in check_numbers(document, read(root, document), stated.get(document, ()), exceptions)]
            + check_gallery(read(root, "docs/gallery.md"), pictures)
            + check_statuses(read(root, "docs/user_guide.md"), read(root, "tools/settings/command_line.cpp")))


def self_test():
    """Self-test: plants one violation of each kind and clean files, and verifies the result."""
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
    readers = {"real": 'reader.required("name"); reader.text("said", a); reader.numbers("unsaid", b);'}
    found = check_studies("# Studies\n## real\n| `said` |\n## other\n`unsaid`\n", readers)
    expect(found == ["docs/studies.md: '## real' does not describe the key 'unsaid'"], f"got {found}")
    tests = tests_of("TEST(A, IsSo)\nTEST_P(B, Too) {", "add_test(NAME C.c COMMAND x)", "sdag_add_check(D x)", "set(targets e\nf)")
    expect(tests == {"A.IsSo", "B.Too", "C.c", "House.D", "Fuzz.e", "Fuzz.f"}, f"tests {tests}")
    promises = "| promise | tested by |\n|---|---|\n| one | `A.IsSo`, `A.IsGone` |\n| two | hope |\n| three | the same |\n"
    found = check_promises(promises, tests)
    expect(len(found) == 2 and "'A.IsGone'" in found[0] and "'two'" in found[1], f"promises {found}")
    expect(len(check_promises("none", tests)) == 1, "a page without promises")
    found = check_gallery("![A chart](a.png) [b](b.png)", ["a.png", "a.svg", "b.png"])
    expect(found == ["docs/gallery.md: does not show b.png"], f"gallery {found}")
    table = "| 0 | done |\n| 1 | wrong usage, or `fit` |\n"
    equal = '    "Exit status:\\n"\n    "  0 done\\n"\n    "  1 wrong usage, or fit\\n"\n'
    expect(not check_statuses(table, equal), "equal statuses")
    expect(len(check_statuses(table, equal.replace("wrong ", ""))) == 1, "a status that differs")
    found = check_prose("docs/x.md", "It takes\n1.00 s here.", ["takes 1.00 s", "takes 1.01 s"])
    expect(found == ["docs/x.md: does not say 'takes 1.01 s', as the committed results do"], f"prose {found}")
    prose = ("# D\n## A\nRays take\n1.5 to 2.0 times as long and 7 MiB. Size 640 x 360, 4096^3.\n\n    sleep 5 s\n## B\nIt has 3 000 pairs.\n"
             "<!-- x y:begin -->\n9 ms\n<!-- x y:end -->\nand [8 %](a-9 %.md)\n")
    found = check_numbers("d.md", prose, ["take 1.5 to 2.0 times"], {"A": [("why", ["7 MiB"])], "B": [("why", ["8 %", "8 %"])]})
    expect(len(found) == 2 and "'B' says '3 000 pairs'" in found[0] and "exception '8 %' is not needed in 'B'" in found[1], f"numbers {found}")
    for text, count in (("## A\nIt took 3 s.\n", 1), (f"## A\nIt took 3 s ({UNBACKED}).\n", 0)):
        found = check_numbers("d.md", text, [], {"A": [(ONCE, ["3 s"])]})
        expect(len(found) == count and all("no result backs" in v for v in found), f"numbers {found}")
    found = check_numbers("d.md", prose, ["take 1.5 to 2.1 times"], {"A": [("why", ["7 MiB"])], "B": [("why", ["8 %", "3 000 pairs"])]})
    expect(len(found) == 1 and "'A' says '1.5 to 2.0 times'" in found[0], f"numbers {found}")
    rate = lambda name, m, low, high: {"tracer": name, "order": "cluster", "megarays_per_s": m, "megarays_per_s_low": low,
                                       "megarays_per_s_high": high, "megarays_per_s_confidence": 0.97, "repeat_count": 10}
    method = lambda name, ns: {"method": name, "ns_per_pair": ns, "ns_per_pair_low": ns - 1, "ns_per_pair_high": ns + 1,
                               "ns_per_pair_confidence": 0.97, "repeat_count": 10}
    bench = {"repeat_count": 10, "rates": [rate("traceStream AVX2", 6, 5, 7), rate("rtcOccluded1", 8, 7, 9), rate("rtcOccluded8", 12, 11, 13),
                                           rate("rtcOccluded16", 10, 9, 11), rate("NanoVDB HDDA", 1, 1, 1)],
             "frame": {"methods": [method("exact streams", 70), method("rtcOccluded16", 69), method("rtcOccluded8", 60)]}}
    found = bench_claims(bench)
    expect(found[:2] == ["Streams take 70 (69 to 71) ns a pair, `rtcOccluded8` takes 60 (59 to 61), `rtcOccluded16` takes 69 (68 to 70)",
                         "(medians of 10 with the intervals that hold them with 95 %)"], f"claims {found}")
    expect(found[3] == "`rtcOccluded1` traces 8.00 (7.00 to 9.00), `rtcOccluded16` 10.00 (9.00 to 11.00), `rtcOccluded8` 12.00 (11.00 to 13.00)",
           f"claims {found}")
    bench["rates"][3]["megarays_per_s"] = 13
    expect("rtcOccluded8" not in bench_claims(bench)[3], "the fastest call is named already")
    compared = {"runs": [{"label": "dag believe none", "time_ms": 5.5, "time_ms_low": 4, "time_ms_high": 7}],
                "map_costs": [{"texels": 97.0}, {"texels": 300.0}]}
    expect(chart_claims(compared, 4.2)[0] == "exact rays take 6 (4 to 7) ms in this chart and 4 ms in the claims", "the chart's time")
    compared["map_costs"][0]["texels"] = 95.0
    expect("a map requests 95 texels" in chart_claims(compared, 4.2)[0], "a map below the paper's threshold")
    expect(len(check_readme("x\n" * (README_LINES + 1))) == 1, "a README that is too long")
    expect(len(check_readme("x" * (README_COLUMNS + 1))) == 1, "a README that is too wide")
    expect(not check_readme("x" * README_COLUMNS + "\n" + "x\n" * (README_LINES - 1)), "a README of the right size")


if __name__ == "__main__":
    self_test()
    source = pathlib.Path(sys.argv[1])
    found, count = check(source, claims_of(source / "tests/bench/results"))
    sys.exit(report("documents", found + check_against_sources(source), count))
