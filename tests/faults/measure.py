# SPDX-License-Identifier: Apache-2.0
"""Runs tests of faults and keeps what they tried: how often, from which seed, at which commit, and what failed.

    measure.py build/werror/tests/faults/faults_test -o tests/bench/results/faults.json [--rounds N] [--filter TESTS]

--rounds is SDAG_FAULT_ROUNDS, how many times as much a test tries; --filter is googletest's. Each test is added to the
record when it ends, so a run that is stopped keeps what it did. --anew forgets what the record has of the test.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile


def commit_of(folder):
    described = subprocess.run(["git", "-C", folder, "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"],
                               capture_output=True, text=True)
    return described.stdout.strip() or "unknown"


def tests_of(binary, pattern):
    text = subprocess.run([binary, "--gtest_list_tests", f"--gtest_filter={pattern}"], capture_output=True, text=True,
                          check=True).stdout
    suite, names = "", []
    for line in text.splitlines():
        if line.startswith("  "):
            names.append(suite + line.split("#")[0].strip())
        elif line.endswith("."):
            suite = line
    return names


def run(binary, name, rounds):
    """Returns what googletest reports of one test."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        subprocess.run([binary, f"--gtest_filter={name}", f"--gtest_output=json:{report}"],
                       env=os.environ | {"SDAG_FAULT_ROUNDS": str(rounds)}, check=False)
        (suite,) = json.loads(report.read_text())["testsuites"]
        return suite["testsuite"][0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", help="faults_test or signals_test")
    parser.add_argument("-o", "--output", required=True, help="the record, which is added to")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--filter", default="*")
    parser.add_argument("--anew", action="store_true")
    arguments = parser.parse_args()
    record = pathlib.Path(arguments.output)
    totals = json.loads(record.read_text()) if record.exists() else {}
    commit = commit_of(pathlib.Path(__file__).resolve().parent)
    failed = []
    for name in tests_of(arguments.binary, arguments.filter):
        result = run(arguments.binary, name, arguments.rounds)
        if "seed" not in result and "failures" not in result:
            continue  # skipped, or it tries nothing at random
        name = name.removeprefix("Command/")
        if arguments.anew:
            totals.pop(name, None)
        total = totals.setdefault(name, {"tried_count": 0, "failed_count": 0, "seeds": [], "commits": []})
        total["tried_count"] += int(result.get("tried_count", 0))
        total["failed_count"] += "failures" in result
        if "seed" in result:
            total["seeds"].append(result["seed"])
        if "calls" in result:
            total["calls"] = result["calls"]  # of the last run
        if commit not in total["commits"]:
            total["commits"].append(commit)
        record.write_text(json.dumps(totals, indent=1, sort_keys=True) + "\n")
        if "failures" in result:
            failed.append(name)
    if failed:
        sys.exit(f"failed: {' '.join(failed)}")


if __name__ == "__main__":
    main()
