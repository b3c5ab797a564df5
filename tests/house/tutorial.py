# SPDX-License-Identifier: Apache-2.0
"""Runs every command of docs/tutorial.md that starts the program, and its Python, in order and at small size.

    tutorial.py SOURCE_DIR BUILD      BUILD has the program and the Python module
"""
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

from sources import expect

# Values that replace those of the tutorial, where the subcommand has the option.
SMALL = {"--size": "48x27", "--resolution": "64", "--repeats": "1", "--warmups": "0"}
WINDOWED = "view"  # needs a screen; tests of the window start it
COMMAND = re.compile(r"^ {4}shadowdag (.+)$", re.MULTILINE)
PYTHON = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def small(words, known):
    """Returns the words of a command with the small values, of options among `known`."""
    words = list(words)
    for name, value in SMALL.items():
        if name in words:
            words[words.index(name) + 1] = value
        elif name in known:
            words += [name, value]
    return words


def commands_of(text):
    """Returns the words of every command of the program."""
    return [shlex.split(line, comments=True) for line in COMMAND.findall(text)]


def self_test():
    """Self-test of what is run."""
    expect(commands_of("    shadowdag fit A --size 1x1 # not\n    ./do x\n") == [["fit", "A", "--size", "1x1"]], "commands")
    expect(small(["fit", "--size", "1x1"], "--repeats N") == ["fit", "--size", "48x27", "--repeats", "1"], "small values")


def main(source, build):
    program = build / "tools/shadowdag"
    text = (source / "docs/tutorial.md").read_text()
    failures = 0
    commands, scripts = commands_of(text), PYTHON.findall(text)
    expect(len(commands) > 5 and len(scripts) == 1, f"docs/tutorial.md has {len(commands)} commands, {len(scripts)} of Python")
    with tempfile.TemporaryDirectory() as folder:
        # Nothing is written outside of the folder.
        environment = dict(os.environ, XDG_CACHE_HOME=folder, PYTHONPATH=str(build / "python"), MPLBACKEND="Agg",
                           SHADOWDAG_PROGRAM=str(program))

        def run(words):
            done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
            if done.returncode:
                print(f"FAILED with {done.returncode}: {shlex.join(map(str, words))}")
                print(done.stdout[-1000:] + done.stderr[-2000:])
            return done.returncode != 0
        failures += run([program, "scene", "fail-lantern", "-o", "YOUR.glb"])
        for words in commands:
            if words[0] != WINDOWED:
                known = subprocess.run([program, words[0], "--help"], capture_output=True, text=True).stdout
                failures += run([program, *small(words, known if not words[0].startswith("-") else "")])
        script = re.sub(r'"size": "\w+"', f'"size": "{SMALL["--size"]}"', scripts[0])
        failures += run([sys.executable, "-c", script])
    print(f"tutorial: {len(commands)} commands and a script, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    self_test()
    sys.exit(main(*(pathlib.Path(argument).resolve() for argument in sys.argv[1:])))
