# SPDX-License-Identifier: Apache-2.0
"""Prints the last lines of the output of each failed test, then for each run of ctest how many tests failed and their
names: who keeps only the end of a log sees at least those.

    failed_tests.py FILE...      reads what ctest --output-junit writes
"""
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

LINES = 60


def is_failed(case):
    """Returns whether ctest counts a test as failed: also one that could not start, but not one that skips itself."""
    skipped = case.find("skipped")
    return case.get("status") == "fail" or skipped is not None and not skipped.get("message").startswith("SKIP_")


if __name__ == "__main__":
    summaries = []
    for file in sys.argv[1:]:
        if not pathlib.Path(file).is_file():
            summaries.append(f"{file}: ctest ended before it wrote this")
            continue
        cases = ElementTree.parse(file).getroot().findall("testcase")
        failed = [case for case in cases if is_failed(case)]
        for case in failed:
            output = (case.findtext("system-out") or "").rstrip().split("\n")
            print(f"----- {case.get('name')}, after {float(case.get('time')):.1f} s, the last of its output:")
            print("\n".join(output[-LINES:]))
        summaries += [f"{file}: {len(failed)} of {len(cases)} tests failed"]
        summaries += [f"  {case.get('name')}" for case in failed]
    print("\n".join(summaries))
