# SPDX-License-Identifier: Apache-2.0
"""Numbers with a unit in the prose of docs/ that no text of prose.py states: each is in a list of exceptions, with the reason why it
is not computed from the committed results. A new one fails until it has a line in prose.py or here."""
import re

# What measured numbers are numbers of. "x", "at 4096^3" and the sizes of pictures name settings, not results.
UNITS = ("%|ms|s|ns|µs|KiB|MiB|GiB|MB|GB|bytes?|bits?|million|thousand|M|times|pairs|scenes|frames|triangles|answers|checks|texels|rays|cells|"
         "minutes|seconds|false lights?|false shadows?|wrong pairs")
ONE = r"\d[\d.,]*(?: \d{3})*"
NUMBER = re.compile(rf"(?<![\w.^-]){ONE}(?: (?:to|of|and|against|/) {ONE})* ?(?:{UNITS})(?![\w/^])")
GENERATED = re.compile(r"<!-- ([\w -]+):begin -->.*?<!-- \1:end -->", re.DOTALL)
SECTION = re.compile(r"^(?=##+ )", re.MULTILINE)
SETTING = "a setting or a definition, not a result"
ONCE = "measured once, by hand or with a program of then; no result is committed, and the section says so (UNBACKED)"
UNBACKED = "no data file"
LIMIT = "a limit or a cost that the code or a test states"
# {document: {heading: [(reason, numbers in the order of the text)]}}
EXCEPTIONS = {
    "docs/results.md": {
        "The paper's evaluation": [(SETTING, ["16 texels"])],
        "Flicker under a slow camera": [(SETTING, ["120 s"])],
        "Regret of the cost models": [
            ("read off the rows and intervals of regret.json, in words", ["4 frames", "18 to 21 ms", "2.5 to 3.5 times"]),
            ("the bound of the test", ["5 %"])],
        "Which voxels to believe": [("memory and errors of rows of the table of claims", ["0.89 to 1.01 times", "0.03 %"])],
        "Beams": [("errors that the section of the main chart states, too", ["0.05 to 4.6 %"]), ("the goal", ["1.6 times"])],
        "Real scenes": [("the tolerance of the study", ["1 %", "1 %", "0.2 %", "1 %"])],
        "Many scenes in one chart": [
            (SETTING, ["1536 texels", "2 GiB", "256 MiB", "96 texels"]),
            (ONCE, ["3.6 %", "104 ms", "1.24 million"]), ("a time of main_gpu.json, which prose.py states in another sentence", ["19 ms"])],
        "More triangles, the same voxels": [
            ("sizes of scale.json, rounded; the page of the study has them", ["325 thousand", "1.3 and 5.2 million"])],
        "Latency of the window": [(SETTING, ["60 times"]), (ONCE, ["0.07 to 0.12 s"])],
        "On a GPU": [("of the profiles, rounded; the table has them", ["5 %", "11 million"]), (ONCE, ["0.96 ms", "1.79 ms"])],
        "OpenGL": [(ONCE, ["2.7 M", "1.6 M", "1.4 M", "0.002 %", "0.020 %", "0.068 %", "0.002 %", "0.013 %", "0.066 %", "0.09 %", "0.24 %",
                           "0.33 %", "10 to 41 times"]), (SETTING, ["128 texels"])]},
    "docs/limits.md": {
        "Accuracy": [("the null rates of real_scenes.json, which docs/results.md states and prose.py computes", ["37 of 42 scenes"]),
                     (SETTING, ["32 texels", "256 MiB"])],
        "Speed": [(LIMIT, ["70 to 100 bytes", "100 to 400 bytes", "100 KiB", "76 MiB"]),
                  ("what the makers state of their devices", ["32 to 64 times"]),
                  (ONCE, ["3 and 93 MiB", "40 frames", "1.2 s", "0.03 s", "0.04 s"])],
        "Scenes": [(LIMIT, ["16384 texels", "1.3 GiB", "64 times", "64 times", "16 MiB", "16 MiB", "64 MiB", "32 times", "512 MiB", "4 GiB", "1000001 frames", "140 bytes", "9 GiB"])],
        "Systems": [(LIMIT, ["256 MiB", "8 MiB", "60 s", "20 s", "160 times", "600 times"])]},
    "docs/adjudicator.md": {},
}


def prose_sections(text):
    """Returns {heading: its text in one line} of a document, without generated blocks, commands and the targets of links."""
    sections = {}
    for section in SECTION.split(GENERATED.sub("", text)):
        heading, _, body = section.partition("\n")
        body = "\n".join(line for line in body.splitlines() if not line.startswith("    "))
        sections[heading.lstrip("# ")] = " ".join(re.sub(r"\]\([^)]*\)", "]", body).split())
    return sections


def unstated(flat, stated):
    """Returns the numbers with a unit of a text that none of the stated texts covers, in their order."""
    covered = [(match.start(), match.end()) for claim in stated for match in re.finditer(re.escape(claim), flat)]
    return [match.group() for match in NUMBER.finditer(flat) if not any(low <= match.start() < high for low, high in covered)]


def check_numbers(document, text, stated, exceptions):
    """Returns the numbers of a document that are neither in a stated text nor an exception of their section, and the exceptions that
    their section no longer needs."""
    violations = []
    sections = prose_sections(text)
    for heading in dict.fromkeys((*sections, *exceptions)):
        allowed = [number for _, numbers in exceptions.get(heading, ()) for number in numbers]
        for number in unstated(sections.get(heading, ""), stated):
            if number in allowed:
                allowed.remove(number)
            else:
                violations.append(f"{document}: '{heading}' says '{number}', which no text of prose.py states and no exception of "
                                  "stated_numbers.py explains")
        if any(reason == ONCE for reason, _ in exceptions.get(heading, ())) and UNBACKED not in sections.get(heading, ""):
            violations.append(f"{document}: '{heading}' has numbers that no result backs and does not say '{UNBACKED}'")
        violations += [f"stated_numbers.py: the exception '{number}' is not needed in '{heading}' of {document}" for number in allowed]
    return violations
