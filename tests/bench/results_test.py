# SPDX-License-Identifier: Apache-2.0
"""How results.py ends, by a program that only ends with the statuses that it is told.

    results_test.py
"""
import os
import pathlib
import stat
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import results  # noqa: E402

STUB = '#!/bin/sh\necho "$*" >>"$CALLS"\n[ "$1" = diff ] && exit "$DIFF"\nexit "$MEASURE"\n'


def main():
    with tempfile.TemporaryDirectory() as folder:
        program, calls = os.path.join(folder, "program"), pathlib.Path(folder) / "calls"
        pathlib.Path(program).write_text(STUB)
        os.chmod(program, os.stat(program).st_mode | stat.S_IXUSR)
        os.environ["CALLS"] = str(calls)
        for measured, differs, names, status, commands in (
                (0, 0, [], 0, ["compare", "diff", "bench", "diff"]), (0, 5, [], 5, ["compare", "diff", "bench", "diff"]),
                (3, 0, ["small"], 3, ["compare"]), (5, 0, ["stability"], 0, ["study", "diff"]), (0, 1, ["small"], 1, ["compare", "diff"]),
                (0, 0, ["nothing"], 1, [])):
            calls.write_text("")
            os.environ |= {"MEASURE": str(measured), "DIFF": str(differs)}
            ended = results.main(program, names)
            called = [line.split()[0] for line in calls.read_text().splitlines()]
            if (ended, called) != (status, commands):
                sys.exit(f"{names}: ended with {ended} after {called}, not with {status} after {commands}")
    missing = [name for name in results.QUICK | results.LONGER if not (results.RESULTS / f"{name}.json").exists()]
    if missing:
        sys.exit(f"not committed: {missing}")


main()
