# SPDX-License-Identifier: Apache-2.0
"""Every committed result can be made again: the commit that it names is part of this history.

    commits.py SOURCE_DIR      ends with 77, which is a skipped test, without git or where the history is not that of the project
"""
import json
import pathlib
import subprocess
import sys

SKIPPED = 77


def git(root, *words):
    """Returns the status and the output of a git command."""
    try:
        done = subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=False)
    except OSError:
        return 1, ""
    return done.returncode, done.stdout.strip()


def commits_of(value):
    """Returns the commits of all provenances in a result."""
    if isinstance(value, list):
        return {commit for item in value for commit in commits_of(item)}
    if not isinstance(value, dict):
        return set()
    found = {commit for item in value.values() for commit in commits_of(item)}
    provenance = value.get("provenance")
    return found | {provenance["commit"]} if isinstance(provenance, dict) and "commit" in provenance else found


def unknown_commits(root, named):
    """Returns a complaint for each commit that is not part of the history. named: by file, its commits"""
    known = {commit: git(root, "merge-base", "--is-ancestor", commit, "HEAD")[0] == 0 for commit in set().union(*named.values())}
    return [f"{name}: names the commit '{commit}', which is not in this history; measure it again"
            for name, commits in sorted(named.items()) for commit in sorted(commits) if not known[commit]]


def main(root):
    status, shallow = git(root, "rev-parse", "--is-shallow-repository")
    if status or shallow != "false":
        print("commits: no complete history, so nothing was checked")
        return SKIPPED
    head = git(root, "rev-parse", "--short=12", "HEAD")[1]
    if len(unknown_commits(root, {"planted.json": {head, "0" * 12}})) != 1:
        print("commits: the check itself is wrong")
        return 1
    named = {path.name: commits_of(json.loads(path.read_text())) for path in pathlib.Path(root, "tests/bench/results").glob("*.json")}
    complaints = unknown_commits(root, named)
    if len(complaints) == sum(map(len, named.values())):
        print("commits: none of the results is of this history, as in a copy of the files alone, so nothing was checked")
        return SKIPPED
    print("\n".join(complaints + [f"commits: {len(named)} results, {len(complaints)} violations"]))
    return bool(complaints)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
