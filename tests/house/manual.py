# SPDX-License-Identifier: Apache-2.0
"""Checks that the man page and the shells' completions name every subcommand and, under each, every option of --help,
that the shells and man accept them, and that the documents use only subcommands and options that exist. Reads --help by
other means than what wrote the page and the completions.

    manual.py PROGRAM DIR SOURCE_DIR      checks DIR and the documents, after checking itself on planted violations
"""
import pathlib
import re
import shutil
import subprocess
import sys

from sources import expect, project_files, read, report

# Where a file names the options of a subcommand.
SECTIONS = {"shadowdag.1": r"^\.SH {upper}$(.*?)(?=^\.SH |\Z)", "shadowdag.bash": r"^        {name}\) options=(.*?)$",
            "_shadowdag": r"^        {name}\)$(.*?);;$"}
TESTERS = {"shadowdag.1": ("man", "--warnings", "-l"), "shadowdag.bash": ("bash", "-n"), "_shadowdag": ("zsh", "-n")}
# A command in a document: in an indented block, or in backticks.
COMMAND = re.compile(r"(?:^ {4,}(?:build/release/tools/)?|`)shadowdag ([a-z]+)((?: [^`\n]*)?)", re.MULTILINE)
# Asks bash for the words that follow a command line; "default" and "dirnames" are what bash completes by itself.
ASK_BASH = """source "$1"; shift; compopt() { COMPREPLY+=("$2"); }; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _shadowdag
echo "${COMPREPLY[@]}\""""


def help_of(program, *words):
    return subprocess.run([program, *words, "--help"], check=True, capture_output=True, text=True).stdout


def options_in(text):
    """Returns the names of options at the beginnings of the lines of a help text."""
    return [name for names in re.findall(r"^  (-[\w,-]+)", text, re.MULTILINE) for name in names.split(",")]


def missing(file, text, command, names):
    """Returns which options of a subcommand its section in a file lacks."""
    plain = re.sub(r"\\f[BIR]", "", text.replace("\\-", "-"))
    section = re.search(SECTIONS[file].format(name=command, upper=command.upper()), plain, re.MULTILINE | re.DOTALL)
    if not section:
        return [f"{file}: has no section of '{command}'"]
    return [f"{file}: '{command}' lacks {name}" for name in names
            if not re.search(rf"(?<![\w-]){name}(?![\w-])", section[1])]


def unknown_in(path, text, known):
    """Returns the subcommands and options in a document's commands that the program does not have.

    known: the names of options, by subcommand
    """
    violations = []
    for command, words in COMMAND.findall(text):
        if command not in known:
            violations.append(f"{path}: uses the subcommand '{command}', which does not exist")
        else:
            used = re.findall(r"(?<![\w-])--[a-z][\w-]*", words.split(" # ")[0])
            violations += [f"{path}: uses '{command} {name}', which does not exist"
                           for name in used if name not in known[command]]
    return violations


def check(program, folder, root):
    """Returns the violations and the number of files."""
    texts = {file: (folder / file).read_text() for file in SECTIONS}
    commands = re.findall(r"^  ([a-z]+) ", help_of(program).split("Subcommands:\n")[1], re.MULTILINE)
    violations = [] if len(commands) > 10 else [f"only the subcommands {commands} were found in --help"]
    known = {command: options_in(help_of(program, command)) for command in commands}
    for command, names in known.items():
        for file, text in texts.items():
            violations += missing(file, text, command, names)
    for file, tester in TESTERS.items():
        if shutil.which(tester[0]):
            run = subprocess.run([*tester, str(folder / file)], capture_output=True, text=True)
            if run.returncode or run.stderr:
                violations.append(f"{file}: {' '.join(tester)} says '{run.stderr.strip()}'")
    files, folders = ["default"], ["dirnames"]
    for line, wanted in ((("",), commands), (("render", "--method", "d"), ["dag"]), (("fit", "--minimi"), ["--minimise"]),
                         (("voxelize", "--packing", ""), ["fast", "compact"]), (("calibrate", "-o", ""), files),
                         (("fit", "--costs", ""), files), (("fit", "--experiment-out", ""), files),
                         (("compare", "-o", ""), folders), (("view", "--frames", ""), []),
                         (("render", "--exposure", ""), [])):
        words = subprocess.run(["bash", "-c", ASK_BASH, "bash", str(folder / "shadowdag.bash"), "shadowdag", *line],
                               capture_output=True, text=True).stdout.split()
        if not set(wanted) <= set(words) or (words and not wanted):
            violations.append(f"shadowdag.bash: completes 'shadowdag {' '.join(line)}' by {words}, not {wanted}")
    documents = [path for path in project_files(root) if path.suffix == ".md"]
    for path in documents:
        violations += unknown_in(path, read(root, path), known)
    return violations, len(texts) + len(documents)


def self_test():
    """Self-test: plants sections with and without an option."""
    expect(options_in("Options:\n  -o,--output F  text --no\n  --json  x\n") == ["-o", "--output", "--json"], "options")
    page = ".SH RENDER\n.TP\n\\fB\\-o\\fR, \\fB\\-\\-output\\fR\n.SH FIT\n.TP\n\\fB\\-\\-json\\fR\n"
    expect(not missing("shadowdag.1", page, "render", ["-o", "--output"]), "a complete page")
    expect(len(missing("shadowdag.1", page, "render", ["--json"])) == 1, "an option of another subcommand")
    expect(len(missing("shadowdag.bash", "        fit) options='--a-b' ;;\n", "fit", ["--a-b", "--a"])) == 1, "a prefix")
    expect(len(missing("_shadowdag", "        fit)\n  '--a[x]' ;;\n", "view", ["--a"])) == 1, "a missing subcommand")
    text = "    build/release/tools/shadowdag fit A --max 1 --gone # --not\n`shadowdag go` and `shadowdag fit --max`\n"
    found = unknown_in("x.md", text, {"fit": ["--max"]})
    expect(len(found) == 2 and "'fit --gone'" in found[0] and "'go'" in found[1], f"got {found}")


if __name__ == "__main__":
    self_test()
    sys.exit(report("manual", *check(sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]))))
