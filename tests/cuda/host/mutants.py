# SPDX-License-Identifier: Apache-2.0
"""Which tests notice which mutant of the device layer (faults.h).

    mutants.py record BUILD RESULTS.json            runs the tests of CUDA under each mutant until one notices it
    mutants.py check BUILD RESULTS.json             runs only the recorded test of each mutant, which must notice it again
    mutants.py document DOCUMENT RESULTS.json [--check]   writes the table between the marker lines of a document

BUILD is a build with the preset cuda-host. A test notices a mutant by failing, by the end of its process, or by taking
more than a minute, when it runs alone; a mutant that no test reaches is an error.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

# Programs and their tests, in the order in which they are asked: from the smallest tests to all passes of small scenes.
PROGRAMS = {"tests/cuda/cuda_test": "*cuda*:*Cuda*", "tests/cuda/cuda_host_test": "CudaHostBuffers.*",
            "tests/shadowmap/shadowmap_test": "ShadowMaps.Cuda*:*OfEveryPass*cuda",
            "tests/hybrid/test_parity": "*PassParity*fail_alpha_cuda:*PassParity*fail_acne_cuda"}
VARIABLE = "SDAG_CUDA_HOST_MUTANT"
TIMEOUT_S = 60
BEGIN, END = "<!-- cuda-mutants:begin -->", "<!-- cuda-mutants:end -->"


def run(build, program, mutant, test_filter):
    """Returns (whether the mutant was committed, the test that noticed it or None, how)."""
    environment = {**os.environ, VARIABLE: mutant}
    command = [str(build / program), f"--gtest_filter={test_filter}", "--gtest_fail_fast", "--gtest_brief=0"]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, errors="replace")
        out, err, status = done.stdout, done.stderr, done.returncode
    except subprocess.TimeoutExpired as late:
        out, err, status = (late.stdout or b"").decode(errors="replace"), (late.stderr or b"").decode(errors="replace"), None
    committed = f"cuda host: commits {mutant}" in err
    if status == 0:
        if "[  PASSED  ]" not in out or "Running 0 tests" in out:
            sys.exit(f"mutants: {program} ran no test of {test_filter}")
        return committed, None, ""
    running = re.findall(r"^\[ RUN      \] (\S+)", out, re.MULTILINE)
    failed = re.findall(r"^\[  FAILED  \] ([^\s,]+)", out, re.MULTILINE)
    if status == 1 and failed:
        return committed, failed[0], "a comparison"
    if not running:
        sys.exit(f"mutants: {program} did not start under {mutant}: {err[-500:]}")
    said = re.findall(r"^(?:cuda host: (?!commits|CUDA is played)(.*)|terminate called.*|.*assertion failed.*)$", err, re.MULTILINE)
    kinds = (("touches", "a protected page"), ("beside", "bytes beside an allocation"), ("assertion failed", "an assertion"),
             ("its mask names", "a lane that left"), ("wait for others", "waits without end"), ("left, although", "a lane that left"),
             ("mask that does not name it", "a mask without its lane"))
    how = next((kind for text in said for words, kind in kinds if words in text), "the end of the process")
    return committed, running[-1], "no end in time" if status is None else how


def mutants_of(build):
    """Returns (name, what is wrong) of all mutants, as the program lists them."""
    listed = subprocess.run([str(build / next(iter(PROGRAMS)))], env={**os.environ, VARIABLE: "list"}, check=True,
                            capture_output=True, text=True).stdout
    return [tuple(line.split("\t")) for line in listed.splitlines()]


def candidates(build, program, test_filter, test):
    """Returns a test, and then all others in their order: what a test left in a queue may be noticed in the next one only."""
    listed = subprocess.run([str(build / program), "--gtest_list_tests", f"--gtest_filter={test_filter}"], check=True,
                            capture_output=True, text=True).stdout
    tests, suite = [], ""
    for line in listed.splitlines():
        word = line.split("#")[0].rstrip()
        if word.startswith("  "):
            tests.append(suite + word.strip())
        elif word.endswith("."):
            suite = word
    return [test] + [other for other in tests if other != test]


def noticed(build, mutant, what):
    """Returns a row of the results."""
    committed = False
    for program, test_filter in PROGRAMS.items():
        was_committed, test, _ = run(build, program, mutant, test_filter)
        committed |= was_committed
        for alone in candidates(build, program, test_filter, test) if test else []:
            _, found, how = run(build, program, mutant, alone)
            if found:
                return {"name": mutant, "what": what, "program": program, "test": found, "how": how, "committed": committed}
    return {"name": mutant, "what": what, "program": None, "test": None, "how": "", "committed": committed}


def in_parallel(work, items):
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, items))


def complaints(rows):
    """Returns what is wrong with results: mutants that survive or are not reached, and noise without any."""
    wrong = [f'{row["name"]}: no test notices it' for row in rows if row["name"] != "none" and not row["test"]]
    wrong += [f'{row["name"]}: no test reaches it' for row in rows if row["name"] != "none" and not row["committed"]]
    return wrong + [f'without a mutant {row["test"]} fails' for row in rows if row["name"] == "none" and row["test"]]


def record(build, results):
    rows = in_parallel(lambda mutant: noticed(build, *mutant), mutants_of(build))
    part = results.with_suffix(".part")
    part.write_text(json.dumps(rows, indent=1) + "\n")
    part.replace(results)
    return complaints(rows)


def check(build, results):
    rows = json.loads(results.read_text())
    if [(row["name"], row["what"]) for row in rows] != mutants_of(build):
        return [f"{results} has other mutants than the program; record them anew"]
    by_tests = [row for row in rows if row["test"]]

    def again(row):
        committed, test, how = run(build, row["program"], row["name"], row["test"])
        return {**row, "committed": committed, "test": test, "how": how}
    clean = [{"name": "none", "test": test} for program in PROGRAMS if any(row["program"] == program for row in by_tests)
             for _, test, _ in [run(build, program, "none", ":".join(sorted({row["test"] for row in by_tests
                                                                              if row["program"] == program})))]]
    return complaints([row for row in rows if row["name"] != "none" and not row["test"]] + in_parallel(again, by_tests) + clean)


def document(path, results, only_check):
    rows = [row for row in json.loads(results.read_text()) if row["name"] != "none"]
    lines = ["", f'{len(rows)} mutants, {sum(bool(row["test"]) for row in rows)} of them noticed.', "",
             "| Mutant | What is wrong | First noticed by | As |", "|---|---|---|---|"]
    lines += [f'| `{row["name"]}` | {row["what"]} | `{row["test"]}` | {row["how"]} |' for row in rows]
    text = path.read_text()
    head, rest = text.split(BEGIN)
    written = head + BEGIN + "\n" + "\n".join(lines) + "\n\n" + END + rest.split(END)[1]
    if written == text:
        return []
    if only_check:
        return [f"{path}: its table is not that of {results}; write it with: mutants.py document"]
    part = path.with_suffix(".part")
    part.write_text(written)
    part.replace(path)
    return []


if __name__ == "__main__":
    arguments = [argument for argument in sys.argv[1:] if argument != "--check"]
    if len(arguments) != 3 or arguments[0] not in ("record", "check", "document"):
        sys.exit(__doc__)
    command, first, second = arguments[0], *map(pathlib.Path, arguments[1:])
    found = (record(first, second) if command == "record" else check(first, second) if command == "check"
             else document(first, second, "--check" in sys.argv))
    for complaint in found:
        print(complaint)
    print(f"mutants of the device layer: {len(found)} complaints")
    sys.exit(1 if found else 0)
