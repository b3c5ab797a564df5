# SPDX-License-Identifier: Apache-2.0
"""Every committed result can be made again: the commit that it names is part of this history, and nothing was changed beside it.
What names no such commit has a line in EXCEPTIONS, with the reason.

    commits.py SOURCE_DIR      ends with 77, which is a skipped test, without git or where the history is not that of the project
"""
import json
import pathlib
import subprocess
import sys

SKIPPED = 77
NONE = "no commit"
EXCEPTIONS = {  # {file: ({commits}, reason)}
    "determinism.json": ({"76ebfd5a7e3a+dirty", "de52f882f287+dirty", "unknown"},
                         "builds of trees that were copied or changed; their hashes are those of builds that name their commit"),
    "faults.json": ({NONE}, "counts of the calls that tests made fail; measure.py reads them from the tests"),
    "filters.json": ({NONE}, "of a bench that records no provenance"),
    "fuzzing.json": ({NONE}, "counts of the inputs that were tried; no answer of the program")}


def git(root, *words):
    """Returns the status and the output of a git command."""
    try:
        done = subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=False)
    except OSError:
        return 1, ""
    return done.returncode, done.stdout.strip()


def commits_of(value):
    """Returns all commits that a result names, at any depth."""
    if isinstance(value, list):
        return {commit for item in value for commit in commits_of(item)}
    if not isinstance(value, dict):
        return set()
    found = {commit for item in value.values() for commit in commits_of(item)}
    return found | {value["commit"]} if isinstance(value.get("commit"), str) else found


def complaints_of(root, named, exceptions):
    """Returns a complaint for each commit that is not part of the history, for each result that names none, and for each exception that
    is not needed. named: by file, its commits; exceptions: by file, ({commits}, reason)"""
    known = {commit: git(root, "merge-base", "--is-ancestor", commit, "HEAD")[0] == 0 for commit in set().union(*named.values())}
    complaints = []
    for name, commits in sorted(named.items()):
        excused = exceptions.get(name, (set(), ""))[0]
        strange = {commit for commit in commits if not known[commit]} or ({NONE} if not commits else set())
        complaints += [f"{name}: names {commit}, which is not in this history; measure it again" for commit in sorted(strange - excused)]
        complaints += [f"commits.py: {name} needs no exception for {commit}" for commit in sorted(excused - strange)]
    return complaints


def main(root):
    status, shallow = git(root, "rev-parse", "--is-shallow-repository")
    if status or shallow != "false":
        print("commits: no complete history, so nothing was checked")
        return SKIPPED
    head = git(root, "rev-parse", "--short=12", "HEAD")[1]
    planted = {"a.json": {head, "0" * 12}, "b.json": {head + "+dirty"}, "c.json": set(), "d.json": {"unknown"}}
    if len(complaints_of(root, planted, {"d.json": ({"unknown", NONE}, "planted")})) != 4:
        print("commits: the check itself is wrong")
        return 1
    named = {path.name: commits_of(json.loads(path.read_text())) for path in pathlib.Path(root, "tests/bench/results").glob("*.json")}
    if not any(git(root, "merge-base", "--is-ancestor", commit, "HEAD")[0] == 0 for commit in set().union(*named.values())):
        print("commits: none of the results is of this history, as in a copy of the files alone, so nothing was checked")
        return SKIPPED
    complaints = complaints_of(root, named, EXCEPTIONS)
    print("\n".join(complaints + [f"commits: {len(named)} results, {len(complaints)} violations"]))
    return bool(complaints)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
