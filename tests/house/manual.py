# SPDX-License-Identifier: Apache-2.0
"""Checks that the man page and the shells' completions name every subcommand and, under each, every option of --help,
and that the shells and man accept them. Reads --help by other means than what wrote them.

    manual.py PROGRAM DIR      checks DIR, after checking itself on planted violations
"""
import pathlib
import re
import shutil
import subprocess
import sys

from sources import expect, report

# Where a file names the options of a subcommand.
SECTIONS = {"shadowdag.1": r"^\.SH {upper}$(.*?)(?=^\.SH |\Z)", "shadowdag.bash": r"^        {name}\) options=(.*?)$",
            "_shadowdag": r"^        {name}\)$(.*?);;$"}
TESTERS = {"shadowdag.1": ("man", "--warnings", "-l"), "shadowdag.bash": ("bash", "-n"), "_shadowdag": ("zsh", "-n")}
# Asks bash for the words that follow a command line.
ASK_BASH = 'source "$1"; shift; compopt() { :; }; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _shadowdag; echo "${COMPREPLY[@]}"'


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


def check(program, folder):
    """Returns the violations and the number of files."""
    texts = {file: (folder / file).read_text() for file in SECTIONS}
    commands = re.findall(r"^  ([a-z]+) ", help_of(program).split("Subcommands:\n")[1], re.MULTILINE)
    violations = [] if len(commands) > 10 else [f"only the subcommands {commands} were found in --help"]
    for command in commands:
        names = options_in(help_of(program, command))
        for file, text in texts.items():
            violations += missing(file, text, command, names)
    for file, tester in TESTERS.items():
        if shutil.which(tester[0]):
            run = subprocess.run([*tester, str(folder / file)], capture_output=True, text=True)
            if run.returncode or run.stderr:
                violations.append(f"{file}: {' '.join(tester)} says '{run.stderr.strip()}'")
    for line, wanted in ((("",), commands), (("render", "--method", "d"), ["dag"]), (("fit", "--minimi"), ["--minimise"])):
        words = subprocess.run(["bash", "-c", ASK_BASH, "bash", str(folder / "shadowdag.bash"), "shadowdag", *line],
                               capture_output=True, text=True).stdout.split()
        if not set(wanted) <= set(words):
            violations.append(f"shadowdag.bash: completes 'shadowdag {' '.join(line)}' by {words}, not {wanted}")
    return violations, len(texts)


def self_test():
    """Self-test: plants sections with and without an option."""
    expect(options_in("Options:\n  -o,--output F  text --no\n  --json  x\n") == ["-o", "--output", "--json"], "options")
    page = ".SH RENDER\n.TP\n\\fB\\-o\\fR, \\fB\\-\\-output\\fR\n.SH FIT\n.TP\n\\fB\\-\\-json\\fR\n"
    expect(not missing("shadowdag.1", page, "render", ["-o", "--output"]), "a complete page")
    expect(len(missing("shadowdag.1", page, "render", ["--json"])) == 1, "an option of another subcommand")
    expect(len(missing("shadowdag.bash", "        fit) options='--a-b' ;;\n", "fit", ["--a-b", "--a"])) == 1, "a prefix")
    expect(len(missing("_shadowdag", "        fit)\n  '--a[x]' ;;\n", "view", ["--a"])) == 1, "a missing subcommand")


if __name__ == "__main__":
    self_test()
    sys.exit(report("manual", *check(sys.argv[1], pathlib.Path(sys.argv[2]))))
