# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy with the checks of .clang-tidy over a configured build that compiles folders together.

    tidy.py SOURCE_DIR BUILD_DIR [--jobs N] [--all]

Without --all only over what holds sources that changed since origin/HEAD (where HEAD is that: since HEAD~1), or
includes headers that did. Each run covers up to eight sources, whose headers it reads once.
"""
import concurrent.futures
import json
import pathlib
import re
import subprocess
import sys

from sources import expect, read, report

FOLDERS = ("cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid", "tools")


def git(root, *words):
    """Returns what git prints, or None where it fails."""
    result = subprocess.run(["git", "-c", f"safe.directory={root}", "-C", str(root), *words],
                            capture_output=True, text=True)
    return result.stdout.strip() if result.returncode == 0 else None


def changed_files(root):
    """Returns the paths changed since origin/HEAD, committed or not; None where git knows nothing to compare with."""
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


def touched(root, pairs, changed):
    """Returns the units that hold a changed source, or include a changed header."""
    headers = [name for name in changed if name.endswith(".h")]
    return [(unit, sources) for unit, sources in pairs
            if any(str(s) in changed or any(f'"{h}"' in read(root, s) for h in headers) for s in sources)]


def run(build, unit):
    """Returns clang-tidy's complaint about a translation unit, or an empty string."""
    result = subprocess.run(["clang-tidy-19", "-p", str(build), "--quiet",
                             "--extra-arg=-Wno-unknown-warning-option",
                             "--extra-arg=-Wno-deprecated-declarations", unit], capture_output=True, text=True)
    return result.stdout.strip() or result.stderr.strip() if result.returncode else ""


def self_test(root):
    """Units are chosen by their sources and by headers that these include."""
    pairs = [("a", [pathlib.Path("cuda/backend.cpp")]), ("b", [pathlib.Path("cuda/buffer.cpp")])]
    expect([u for u, _ in touched(root, pairs, {"cuda/backend.cpp"})] == ["a"], "a changed source")
    expect([u for u, _ in touched(root, pairs, {"cuda/buffer.h"})] == ["b"], "a changed header")
    expect(touched(root, pairs, {"README.md"}) == [], "a document")


if __name__ == "__main__":
    folder, built = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    job_count = int(sys.argv[sys.argv.index("--jobs") + 1]) if "--jobs" in sys.argv else 1
    self_test(folder)
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
