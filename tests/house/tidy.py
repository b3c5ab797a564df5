# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy with the checks of .clang-tidy over a configured build that compiles folders together.

    tidy.py SOURCE_DIR BUILD_DIR [--jobs N] [--all]

Without --all only over what holds sources that changed since origin/HEAD (where HEAD is that, or there is no remote:
since HEAD~1), or includes headers that did, directly or through other headers; over all where git knows no commit
before. Each run covers up to twelve sources, whose headers it reads once.
"""
import concurrent.futures
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from sources import code_files, expect, read, report

FOLDERS = ("cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid", "tools")


def git(root, *words):
    """Returns git's output, or None if it fails."""
    result = subprocess.run(["git", "-c", f"safe.directory={root}", "-C", str(root), *words],
                            capture_output=True, text=True)
    return result.stdout.strip() if result.returncode == 0 else None


def changed_files(root):
    """Returns the paths changed since origin/HEAD, committed or not; None if git has nothing to compare with."""
    head = git(root, "rev-parse", "HEAD")
    for base in ("origin/HEAD", "origin/main"):
        merged = git(root, "merge-base", base, "HEAD")
        if merged and merged != head:
            break
    else:
        merged = git(root, "rev-parse", "HEAD~1")
    names = merged and git(root, "diff", "--name-only", merged)
    if names is None:
        return None
    return set((names + "\n" + (git(root, "ls-files", "-o", "--exclude-standard") or "")).split())


def members(root, source):
    """Returns the project's sources that a translation unit is made of, relative to root."""
    source = pathlib.Path(source)
    paths = [source]
    if "Unity" in source.parts:
        paths = [pathlib.Path(path) for path in re.findall(r'#include "(.+)"', source.read_text())]
    inside = [path.relative_to(root) for path in paths if path.is_relative_to(root)]
    return [path for path in inside if path.parts[0] in FOLDERS]


def units(root, build):
    """Returns (translation unit, its sources) of the libraries and the program."""
    commands = json.loads((pathlib.Path(build) / "compile_commands.json").read_text())
    pairs = [(c["file"], members(root, c["file"])) for c in commands if c["file"].endswith((".cpp", ".cxx"))]
    return [(file, sources) for file, sources in pairs if sources]


def included(root, path):
    """Returns the project's files that a file includes directly."""
    return set(re.findall(r'^\s*#\s*include "(.+)"', read(root, path), re.MULTILINE))


def touched(root, pairs, changed):
    """Returns the units that hold a changed source, or include a changed header, directly or through others."""
    headers = {name for name in changed if name.endswith(".h")}
    of = {str(path): included(root, path) for path in code_files(root) if path.suffix == ".h"}
    while more := {name for name, names in of.items() if names & headers} - headers:
        headers |= more
    return [(unit, sources) for unit, sources in pairs
            if any(str(s) in changed or included(root, s) & headers for s in sources)]


def run(build, unit, command="clang-tidy-19"):
    """Returns clang-tidy's message about a translation unit, or an empty string."""
    result = subprocess.run([command, "-p", str(build), "--quiet",
                             "--extra-arg=-Wno-unknown-warning-option",
                             "--extra-arg=-Wno-deprecated-declarations", unit], capture_output=True, text=True)
    if result.returncode == 0:
        return ""
    return result.stdout.strip() or result.stderr.strip() or f"{unit}: {command} ended in {result.returncode}, silently"


def self_test():
    """Units are chosen by their sources and by headers that these include; what fails without a word is told."""
    with tempfile.TemporaryDirectory() as planted:
        root = pathlib.Path(planted)
        (root / "inner.h").write_text("#pragma once\n")
        (root / "outer.h").write_text('#pragma once\n#include "inner.h"\n')
        (root / "a.cpp").write_text('#include "outer.h"\n')
        (root / "b.cpp").write_text('#include <string>\n')
        pairs = [("a", [pathlib.Path("a.cpp")]), ("b", [pathlib.Path("b.cpp")])]
        for changed, chosen in (("b.cpp", ["b"]), ("outer.h", ["a"]), ("inner.h", ["a"]), ("README.md", [])):
            units = [unit for unit, _ in touched(root, pairs, {changed})]
            expect(units == chosen, f"of a changed {changed}: {units}")
    expect("silently" in run("build", "a.cpp", "false"), "a clang-tidy that fails without output")
    with tempfile.TemporaryDirectory() as planted:
        check_clones(pathlib.Path(planted))


def check_clones(folder):
    """What changed is found without a remote, in fresh, detached and shallow clones, and with work not committed."""
    origin, clone, shallow = folder / "origin", folder / "clone", folder / "shallow"
    origin.mkdir()
    identity = ("-c", "user.name=check", "-c", "user.email=check@example.org", "-c", "init.defaultBranch=main")

    def commit(root, name):
        (root / name).write_text(name)
        git(root, "add", name)
        expect(git(root, *identity, "commit", "-q", "-m", name) is not None, f"a commit of {name}")

    expect(changed_files(origin) is None, "no repository: all")
    git(origin, *identity, "init", "-q")
    commit(origin, "a.cpp")
    expect(changed_files(origin) is None, "one commit: all")
    commit(origin, "b.cpp")
    expect(changed_files(origin) == {"b.cpp"}, "no remote: the last commit")
    git(folder, "clone", "-q", str(origin), str(clone))
    expect(changed_files(clone) == {"b.cpp"}, "a fresh clone: the last commit")
    commit(clone, "c.cpp")
    commit(clone, "d.cpp")
    (clone / "e.cpp").write_text("e")
    expect(changed_files(clone) == {"c.cpp", "d.cpp", "e.cpp"}, "a clone at work: all since origin/HEAD")
    git(clone, "checkout", "-q", "--detach")
    git(clone, "remote", "remove", "origin")
    expect(changed_files(clone) == {"d.cpp", "e.cpp"}, "detached, without a remote: the last commit")
    git(folder, "clone", "-q", "--depth", "1", f"file://{origin}", str(shallow))
    expect(changed_files(shallow) is None, "a shallow clone: all")


if __name__ == "__main__":
    folder, built = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    job_count = int(sys.argv[sys.argv.index("--jobs") + 1]) if "--jobs" in sys.argv else 1
    self_test()
    chosen = units(folder, built)
    total = len(chosen)
    since = None if "--all" in sys.argv else changed_files(folder)
    if since is not None:
        chosen = touched(folder, chosen, since)
    print(f"clang-tidy: {len(chosen)} of {total} translation units")
    if not chosen and total:
        sys.exit(0)
    with concurrent.futures.ThreadPoolExecutor(job_count) as pool:
        found = [c for c in pool.map(lambda pair: run(built, pair[0]), chosen) if c]
    sys.exit(report("clang-tidy", found, len(chosen)))
