# SPDX-License-Identifier: Apache-2.0
"""Finds the commands and the Python code of a document, and checks commands of programs that are not run."""
import re
import shlex

from sources import expect

PROGRAM = re.compile(r"(?:build/[\w-]+/tools/)?shadowdag$")
PYTHONS = ("python3", "/usr/bin/python3")
OTHERS_RUN = ("c++", "tools/studies/update_known.py")  # other programs that are run
FIRST_WORD = re.compile(r"(?:[A-Z_]+=\S+ +)*(\S+)")
ASSIGNMENT = re.compile(r"[A-Z_]+=")
SPAN = re.compile(r"`([^`]+)`")
# A text in backticks that is run, and one that is only checked: a subcommand with an option.
INLINE = re.compile(r"shadowdag \S+ \S")
ABRIDGED = re.compile(r"[a-z]+ (?:.* )?--[a-z]")


def options_of(words):
    """Returns the long options of a command."""
    return [word.split("=")[0] for word in words if re.match(r"--[a-z]", word)]


def texts_of_do(words):
    return [f"\n    {words[1]})", *options_of(words)]


def texts_of_cmake(words):
    return [f'"name": "{preset}"' for option, preset in zip(words, words[1:]) if option == "--preset"]


def texts_of_podman(words):
    return [f"AS {target}" for option, target in zip(words, words[1:]) if option == "--target"]


def texts_of_snakemake(words):
    """Returns the targets, which are rules."""
    return [word for before, word in zip(words, words[1:]) if not word.startswith("-") and not before.startswith("--")]


# Programs that are not run: why, the file of ours that states what they may be given, and a function of a command's words
# that returns the texts that must stand there.
NOT_RUN = {
    "./do": ("installs packages and builds", "do", texts_of_do),
    "cmake": ("builds", "CMakePresets.json", texts_of_cmake),
    "ctest": ("runs the tests", "CMakePresets.json", texts_of_cmake),
    "build/example/shadow_rays": ("another test runs it", "examples/shadow_rays/CMakeLists.txt", lambda words: ["shadow_rays"]),
    "build/release/tests/bench/gl_bench": ("takes minutes", "tests/bench/CMakeLists.txt", lambda words: ["gl_bench"]),
    "tools/gpu_check": ("needs a device", "tools/gpu_check", options_of),
    "snakemake": ("another test runs it", "workflow/Snakefile", texts_of_snakemake),
    "pip": ("another test builds the wheel", "pyproject.toml", lambda words: []),
    "podman": ("needs a network", "Containerfile", texts_of_podman),
    "apt": ("changes the system", "packages.txt", lambda words: []),
}


class Part:
    """A command or code of a document, with its line. Kinds: command, inline, abridged, python."""

    def __init__(self, document, line, kind, text):
        self.document, self.line, self.kind, self.text = str(document), line, kind, text

    def __str__(self):
        return f"{self.document}:{self.line}: {self.text}"


def is_command(line):
    """Returns whether a line is a command of a program that we know."""
    word = FIRST_WORD.match(line.strip())
    return word is not None and (bool(PROGRAM.match(word[1])) or word[1] in (*PYTHONS, *OTHERS_RUN, *NOT_RUN))


def commands_of_block(document, block):
    """Returns the commands of a block's (number, line)s, and the lines beside them that are none."""
    known = [(number, line.strip()) for number, line in block if is_command(line)]
    others = [f"{document}:{number}: '{line.strip()}' stands among commands and is of no program that the tests know"
              for number, line in block if known and not is_command(line)]
    return [Part(document, number, "command", line) for number, line in known], others


def commands_of_prose(document, prose, seen):
    """Returns the commands in backticks of a paragraph's (number, line)s. @param seen those of earlier paragraphs"""
    parts = []
    paragraph = "\n".join(line for _, line in prose)
    for span in SPAN.finditer(paragraph):
        code = " ".join(span[1].split())
        kind = "inline" if INLINE.match(code) else "abridged" if ABRIDGED.match(code) else None
        if kind and code not in seen:
            seen.add(code)
            parts.append(Part(document, prose[0][0] + paragraph.count("\n", 0, span.start()), kind, code))
    return parts


def parts_of(document, text):
    """Returns the parts of a document in order, and what is wrong with its blocks."""
    parts, wrong, seen = [], [], set()
    fence, block, prose = None, [], []  # the language of a fenced block; lines with their numbers
    for number, line in enumerate([*text.splitlines(), ""], 1):
        is_fence = line.startswith("```")
        is_block = fence is not None or line.startswith("    ")
        if is_fence or is_block or not line:
            parts += commands_of_prose(document, prose, seen) if prose else []
            prose = []
        if block and (is_fence or not is_block):
            if fence == "python":
                parts.append(Part(document, block[0][0], "python", "".join(code + "\n" for _, code in block)))
            else:
                commands, others = commands_of_block(document, block)
                parts, wrong = parts + commands, wrong + others
            block = []
        if is_fence:
            fence = (line[3:].strip() or "text") if fence is None else None
        elif is_block:
            block.append((number, line))
        elif line:
            prose.append((number, line))
    return parts, wrong


def chain_of(line):
    """Returns (environment, words) for each command of a line, which && may join."""
    chain = [({}, [])]
    for word in shlex.split(line, comments=True):
        environment, words = chain[-1]
        if word == "&&":
            chain.append(({}, []))
        elif not words and ASSIGNMENT.match(word):
            environment.update([word.split("=", 1)])
        else:
            words.append(word)
    return chain


def wrong_with(root, words):
    """Returns what is wrong with a command of NOT_RUN."""
    _, file, texts = NOT_RUN[words[0]]
    content = (root / file).read_text()
    paths = [path for option, path in zip(words, words[1:]) if option in ("-S", "-f", "--profile")]
    return ([f"'{text.strip()}' does not stand in {file}" for text in texts(words) if text not in content]
            + [f"'{path}' does not exist" for path in paths if not (root / path).exists()])


def self_test():
    """Self-test of what is found in a document."""
    text = ("    shadowdag fit A --size 1x1 # not\n    A=b ./do x && shadowdag info C\n\n"
            "It `shadowdag diff\nA B` or `render --laps N`,\n`shadowdag info`.\n\n    a = b\n    c\n\n```python\n    x\n```\n\n```text\npython3 y\nz\n```\n")
    parts, wrong = parts_of("d.md", text)
    expect([(part.line, part.kind, part.text) for part in parts] == [
        (1, "command", "shadowdag fit A --size 1x1 # not"), (2, "command", "A=b ./do x && shadowdag info C"),
        (4, "inline", "shadowdag diff A B"), (5, "abridged", "render --laps N"), (12, "python", "    x\n"),
        (16, "command", "python3 y")], f"parts {[str(part) for part in parts]}")
    expect(len(wrong) == 1 and wrong[0].startswith("d.md:17: 'z'"), f"an unknown program: {wrong}")
    expect(chain_of(parts[1].text) == [({"A": "b"}, ["./do", "x"]), ({}, ["shadowdag", "info", "C"])], "a chain")
    expect(texts_of_snakemake("snakemake -j2 --configfile a all cores".split()) == ["all", "cores"], "targets")
