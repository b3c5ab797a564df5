# SPDX-License-Identifier: Apache-2.0
"""Runs the commands of the documents, and their Python code, in the order of each document and at small size.

    commands.py SOURCE_DIR                  lists the commands of every document and checks those of other programs; runs none
    commands.py SOURCE_DIR BUILD GROUP      runs those of a group of GROUPS, of all other documents (rest) or of one; BUILD
                                            has the program and the Python module

Commands are the lines of indented and fenced blocks, and texts in backticks that start with `shadowdag `. Each is run in a
folder that looks like the repository, from smaller copies of experiments and studies (small_sizes.py). It must end with 0,
or with a status that STATUSES explains, and write the output that it names. What a reader has before a command is made as
RECIPES says. Commands that are not run must name what exists: options that --help lists, or what command_lines.py says of
other programs. An entry of a table that serves no command is a failure.
"""
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

import command_lines
import small_sizes
from command_lines import PROGRAM, PYTHONS, Part, chain_of, options_of, parts_of, wrong_with
from small_sizes import SCENE, value_of
from sources import expect, project_files, read

# Documents whose commands are run by one test; all others are the group `rest`.
GROUPS = {"guide": ["docs/user_guide.md"], "results": ["docs/results.md"],
          "studies": ["docs/studies.md", "docs/adjudicator.md", "docs/mutants.md"]}

# What stands in documents for a choice of the reader, as an expression, and a choice.
PLACEHOLDERS = {
    r"(?<!\S)SCENE(\.\.\.)?(?!\S)": "YOUR.glb", r"(?<!-o )(?<!\S)[a-z]\w+\.glb\b": "YOUR.glb", r"\breal scenes/": "real FOLDER",
    r"\bDIRECTORY\b": "directory", r"\bscene NAME\b": "scene fail-lantern", r"--only NAME\b": "--only acne",
    r"--taps N\b": "--taps 9", r"\bSUBCOMMAND\b": "render"}
# What a reader has before a command, and the commands that make it. scripts/ has the Python code of each document.
MEASURE = f"shadowdag compare {SCENE} --methods dag,maps --no-charts -o "
RECIPES = {
    "YOUR.glb": ["shadowdag scene fail-lantern -o YOUR.glb"], "hall.glb": ["shadowdag scene fail-lantern -o hall.glb"],
    "FOLDER": ["mkdir FOLDER", "shadowdag scene fail-lantern -o FOLDER/lantern.glb"],
    "a.svdag": [f"shadowdag voxelize {SCENE} -o a.svdag"],
    "report": [MEASURE + "report"],
    **{name: [MEASURE + "measured", f"cp measured/results.json {name}"]
       for name in ("BEFORE.json", "AFTER.json", "OLD.json", "NEW.json")},
    "atrium.npz": ["shadowdag rays builtin:atrium -o atrium.npz"],
    "mine.py": ["cp scripts/rays.py mine.py"], "mine.npz": ["python3 mine.py atrium.npz mine.npz"],
    "my_tracer.cpp": ["cp examples/embree_tracer.cpp my_tracer.cpp"],
    "my_study.json": ["cp scenes/studies/failures.json my_study.json"],
    "FILE.json": ["cp scenes/studies/failures.json FILE.json"],
    "DIR/failures.json": ["shadowdag study failures --only acne -o DIR"],
    "main_gpu/results.json": ["mkdir main_gpu", "cp tests/bench/results/main_gpu.json main_gpu/results.json"],
    "main_placed_gpu/results.json": ["mkdir main_placed_gpu",
                                     "cp tests/bench/results/main_placed_gpu.json main_placed_gpu/results.json"],
}
# Statuses beside 0: an expression of the command, the status, what the program says then, and why.
STATUSES = [
    (r"^study (?!mutants)", 5, "", "a bound does not hold at small size"),
    (r"^study .*--resume", 1, "no unfinished study", "nothing has interrupted it"),
    (r"^study mutants", 5, "", "few checks judge at small size"),
    (r"^study mutants", 1, "without assertions", "only builds with assertions contain faults"),
    (r"^diff ", 5, "", "something is worse, as times may be"),
    (r" --backend cuda", 4, "cuda", "a machine may lack a device")]
# Commands of the program that are not run, and why.
NOT_RUN = {r"^view\b": "needs a screen; the tests of the window start it", r" \.\.\. ": "is abridged"}

# The Python code of a document is one script: its arguments, and what a reader has before it.
ARGUMENTS = {"docs/rays.md": ["atrium.npz", "again.npz"], "docs/file_formats.md": ["fast.svdag"]}
BEFORE = {"docs/python.md": """
import numpy
vertices = numpy.array([[-3, 0, -3], [3, 0, -3], [3, 0, 3], [-3, 0, 3], [-1, 1, -1], [1, 1, -1], [0, 1, 1]], numpy.float32)
triangles = numpy.array([[0, 2, 1], [0, 3, 2], [4, 6, 5]], numpy.uint32)
points = [(0, 3, 0), (1, 3, 1)]
start, end = vertices + numpy.float32(0.5), numpy.array([0, 3, 0], numpy.float32)
index = 0
"""}


class Program:
    """The program, and what its --help says."""

    def __init__(self, path):
        self.path, self.helps = path, {}

    def help(self, *words):
        """Returns what --help prints of the program or of a subcommand."""
        if words not in self.helps:
            done = subprocess.run([self.path, *words, "--help"], capture_output=True, text=True)
            self.helps[words] = done.stdout if done.returncode == 0 else ""
        return self.helps[words]

    def subcommands(self):
        listed = re.search(r"^Subcommands:\n((?: .+\n)+)", self.help(), re.MULTILINE)
        return re.findall(r"^  (\w+)", listed[1], re.MULTILINE) if listed else []

    def wrong_with(self, words):
        """Returns what a command names and --help does not list."""
        if words[0] not in self.subcommands():
            return [f"there is no subcommand '{words[0]}'"]
        listed = set(re.findall(r"^  (?:-\w,)?(--[a-z][\w-]*)", self.help(words[0]), re.MULTILINE))
        return [f"'{words[0]}' has no option '{option}'" for option in options_of(words) if option not in listed]


class Folder:
    """The folder in which a document's commands are run."""

    def __init__(self, source, build, path, scripts):
        self.source, self.path, self.program, self.done = source, path, Program(build / "tools/shadowdag"), []
        self.charted = False
        for name in ("build", "scenes/experiments", "scenes/studies", "scripts"):
            (path / name).mkdir(parents=True)
        for name in ("release", "ci"):
            (path / "build" / name).symlink_to(build)
        for name in ("examples", "tests", "tools", "workflow"):
            (path / name).symlink_to(source / name)
        for file in (source / "scenes/experiments").glob("*.json"):
            small = small_sizes.small_experiment(json.loads(file.read_text()))
            (path / "scenes/experiments" / file.name).write_text(json.dumps(small))
        for file in (source / "scenes/studies").glob("*.json"):
            self.write_study(file.name, [])
        for document, script in scripts.items():
            (path / "scripts" / pathlib.Path(document).name).with_suffix(".py").write_text(script)
        # Nothing is written outside of the folder.
        self.environment = dict(os.environ, HOME=str(path), XDG_CACHE_HOME=str(path / "cache"), MPLBACKEND="Agg",
                                PYTHONPATH=str(build / "python"), PYTHONDONTWRITEBYTECODE="1",
                                SHADOWDAG_PROGRAM=str(self.program.path))

    def write_study(self, name, only):
        """Writes the smaller copy of a study."""
        small = small_sizes.small_study(json.loads((self.source / "scenes/studies" / name).read_text()), only)
        (self.path / "scenes/studies" / name).write_text(json.dumps(small))

    def provide(self, words, line):
        """Makes what a command reads and no earlier one has written. Returns what failed."""
        failed = []
        for before, word in zip(["", *words], words):
            for name in (word, *re.findall(r'"([^"]+)"', word)):
                made = before in ("-o", "--output") or (self.path / name).exists()
                if name in RECIPES and not made and line not in RECIPES[name]:
                    failed += [failure for step in RECIPES[name] for failure in self.run(step)]
        return failed

    def run(self, line, once=False):
        """Runs a line at small size. Returns what failed. @param once not if the same was run before"""
        for expression, choice in PLACEHOLDERS.items():
            line = re.sub(expression, choice, line)
        failed = []
        for environment, words in chain_of(line):
            if words[0] in command_lines.NOT_RUN:
                continue
            failed += self.provide(words, line)
            if failed:
                break
            if PROGRAM.match(words[0]):
                failed += self.run_program(words[1:], environment, once)
            else:
                failed += self.execute([sys.executable if words[0] in PYTHONS else words[0], *words[1:]], environment)
        return failed

    def run_program(self, words, environment, once):
        """Runs a command of the program at small size. Returns what failed."""
        text = " ".join(words)
        if any(re.search(key, text) for key in NOT_RUN):
            return self.program.wrong_with(words)
        small = small_sizes.small_words(words)
        study = pathlib.Path(words[1]).with_suffix(".json").name if words[0] == "study" else ""
        if study and (self.source / "scenes/studies" / study).exists():
            self.write_study(study, value_of(words, "--only").split(","))
            small[1] = f"scenes/studies/{study}"
        # What differs in its scene or size alone is one command at small size, and a compare replaces its own report.
        if (once or small[0] == "compare" and "--resume" not in small) and small in self.done:
            return []
        # Its charts take longer than a small compare. Those of all experiments are drawn from the committed results.
        draws = small[0] == "compare" and not {"--no-charts", "--part", "--help"} & set(small)
        added = ["--no-charts"] if draws and self.charted else []
        self.charted |= draws
        self.done.append(small)
        statuses = [(status, said) for expression, status, said, _ in STATUSES if re.search(expression, text)]
        return self.execute([str(self.program.path), *small, *added], environment, statuses)

    def execute(self, words, environment=None, statuses=()):
        """Executes a command. Returns what failed. @param statuses beside 0, each with what the output says then"""
        done = subprocess.run(words, cwd=self.path, env=self.environment | (environment or {}), capture_output=True, text=True)
        said = done.stdout[-1000:] + done.stderr[-2000:]
        if done.returncode and not any(done.returncode == status and text in said for status, text in statuses):
            return [f"ended with {done.returncode}: {shlex.join(words)}\n{said}"]
        output = value_of(words, "-o")
        if output and done.returncode in (0, 5) and not list(self.path.glob(str(pathlib.Path(output).with_suffix("")) + "*")):
            return [f"wrote no '{output}': {shlex.join(words)}\n{said}"]
        return []


def is_run(line):
    """Returns whether a command of a line is run, or all are only checked."""
    return any(words[0] not in command_lines.NOT_RUN and not any(re.search(key, " ".join(words[1:])) for key in NOT_RUN)
               for _, words in chain_of(line))


def script_of(document, parts):
    """Returns the Python code of a document as one script at small size, or nothing."""
    code = "".join(part.text for part in parts if part.kind == "python")
    return BEFORE.get(document, "") + small_sizes.small_python(code) if code else ""


def run_document(document, parts, folder):
    """Runs a document's commands in order, then its Python code. Returns the number of failures."""
    failures, began, counts = 0, time.time(), {}

    def run(kind, what, action):
        nonlocal failures
        since = time.time()
        failed = action()
        print(f"{time.time() - since:6.1f} s  {what}")
        print("".join(f"FAILED {what}\n    {failure}\n" for failure in failed), end="", flush=True)
        failures += len(failed)
        counts[kind] = counts.get(kind, 0) + 1

    for part in parts:
        if part.kind in ("command", "inline"):
            run("run" if is_run(part.text) else "checked", part, lambda: folder.run(part.text, once=part.kind == "inline"))
        elif part.kind == "abridged" and part.text.split()[0] in folder.program.subcommands():
            run("checked", part, lambda: folder.program.wrong_with(re.findall(r"[^\s,()]+", part.text)))
    script = f"scripts/{pathlib.Path(document).stem}.py"
    if (folder.path / script).exists():
        words = ["python3", script, *ARGUMENTS.get(document, [])]
        named = re.findall(r'"[\w.]+"', (folder.path / script).read_text())
        first = next(part for part in parts if part.kind == "python")
        run("script", f"{document}:{first.line}: its Python code",
            lambda: folder.provide([*words, *named], "") or folder.run(shlex.join(words)))
    said = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items()))
    print(f"{document}: {said}; {failures} failures, {time.time() - began:.0f} s")
    return failures


def stale(parts):
    """Returns the entries of the tables that serve none of these parts."""
    lines = [part.text for part in parts if part.kind in ("command", "inline")]
    chains = [words for line in lines for _, words in chain_of(line)]
    programs = [" ".join(words[1:]) for words in chains if PROGRAM.match(words[0])]
    scripts = {part.document for part in parts if part.kind == "python"}
    texts = "\n".join([*lines, *(part.text for part in parts if part.kind == "python"), str(list(RECIPES.values())),
                       str(list(ARGUMENTS.values()))])
    unused = {
        "PLACEHOLDERS": [key for key in PLACEHOLDERS if not any(re.search(key, line) for line in lines)],
        "RECIPES": [key for key in RECIPES if not re.search(rf"(?<![\w./-]){re.escape(key)}(?![\w-])", texts)],
        "STATUSES": [key for key, *_ in STATUSES if not any(re.search(key, text) for text in programs)],
        "NOT_RUN": [key for key in NOT_RUN if not any(re.search(key, text) for text in programs)],
        "ADDED": [key for key in small_sizes.ADDED if not any(text.startswith(" ".join(key)) for text in programs)],
        "OTHERS_RUN": [key for key in command_lines.OTHERS_RUN if not any(words[0] == key for words in chains)],
        "NOT_RUN of command_lines": [key for key in command_lines.NOT_RUN if not any(words[0] == key for words in chains)],
        "ARGUMENTS": ARGUMENTS.keys() - scripts, "BEFORE": BEFORE.keys() - scripts}
    return [f"{table}: '{key}' serves no command" for table, keys in unused.items() for key in keys]


def self_test():
    """Self-test of what is refused."""
    command_lines.self_test()
    small_sizes.self_test()
    program = Program("none")
    program.helps = {(): "Subcommands:\n  fit   Fits\n\n", ("fit",): "  -o,--output F  Out, not --min\n  --max E  Error\n"}
    expect(program.wrong_with("fit --max 1 --output x".split()) == [], "options that exist")
    expect(len(program.wrong_with("fit --min 1".split())) == 1, "an option that does not exist")
    expect(len(program.wrong_with(["fot"])) == 1, "a subcommand that does not exist")
    found = stale([Part("d.md", 1, "command", "shadowdag view hall.glb")])
    expect("NOT_RUN of command_lines: 'pip' serves no command" in found, "a stale entry")
    expect(not any("view" in entry or "hall" in entry for entry in found), f"entries that serve: {found}")
    expect(is_run("./do x && shadowdag info A") and not is_run("./do x") and not is_run("shadowdag view A"), "what is run")
    with tempfile.TemporaryDirectory() as path:
        (pathlib.Path(path) / "source/scenes").mkdir(parents=True)
        folder = Folder(pathlib.Path(path) / "source", pathlib.Path(path), pathlib.Path(path) / "folder", {})
        expect(folder.run("python3 -c 'raise SystemExit(3)'")[0].startswith("ended with 3"), "a status")
        expect(folder.run("python3 -c pass -o x")[0].startswith("wrote no 'x'"), "an output that is not there")
        expect(folder.run("python3 -c pass") == [], "a command that works")


def main(source, build=None, group=None):
    texts = {str(path): read(source, path) for path in project_files(source) if path.suffix == ".md"}
    found = {document: parts_of(document, text) for document, text in texts.items()}
    parts = {document: of for document, (of, _) in found.items()}
    violations = [violation for _, wrong in found.values() for violation in wrong]
    violations += [f"{part}\n    {wrong}" for of in parts.values() for part in of if part.kind == "command"
                   for _, words in chain_of(part.text) if words[0] in command_lines.NOT_RUN for wrong in wrong_with(source, words)]
    violations += [f"commands.py: {entry}" for entry in stale([part for of in parts.values() for part in of])]
    grouped = [document for documents in GROUPS.values() for document in documents]
    violations += [f"commands.py: GROUPS: '{document}' is no document" for document in grouped if document not in texts]
    if group is None:
        print("".join(f"{part}\n" for of in parts.values() for part in of if part.kind != "python"), end="")
    print("".join(f"FAILED {violation}\n" for violation in violations), end="")
    rest = [document for document in texts if document not in grouped and parts[document]]
    chosen = [] if group is None else GROUPS.get(group) or (rest if group == "rest" else [group])
    scripts = {document: script_of(document, of) for document, of in parts.items() if script_of(document, of)}
    failures = len(violations)
    for document in chosen:
        with tempfile.TemporaryDirectory() as path:
            failures += run_document(document, parts[document], Folder(source, build, pathlib.Path(path) / "run", scripts))
    print(f"commands of {len(chosen) or len(texts)} documents, {failures} failures")
    return 1 if failures or not texts else 0


if __name__ == "__main__":
    self_test()
    sys.exit(main(*(pathlib.Path(place).resolve() for place in sys.argv[1:3]), *sys.argv[3:4]))
