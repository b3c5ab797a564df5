# SPDX-License-Identifier: Apache-2.0
"""Runs the fuzz targets of a build, as `./do fuzz` does.

    run.py BUILD_DIR MINUTES [--jobs N] [TARGET...]      MINUTES: of all targets together, N at a time

Finds stay in BUILD_DIR/corpus/TARGET, inputs that end a target in BUILD_DIR/crashes. Prints how often each target ran
and adds that to BUILD_DIR/executions.json, whose copy in tests/bench/results is the data of the table in
docs/promises.md (command `fuzzing` of tools/report/shadowdag_report). Exit status 1 when a target ended: by a crash, an
input that took more than 10 s, or memory.

How memory is measured: memory_meter_sanitizer.cpp counts what malloc and operator new hold, libraries included; a run
that holds more than the bound of its target (FuzzTarget::memory, 64 MiB plus 32 times the input) ends it. libFuzzer
ends a process of more than 2 GiB, and one allocation of more than 1 GiB.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

RUN_SECONDS, RESIDENT_MIB, ALLOCATION_MIB, MAX_BYTES = 10, 2048, 1024, 65536


def last_number(pattern, text):
    """Returns the number of the last match, or 0."""
    found = re.findall(pattern, text)
    return int(found[-1]) if found else 0


def run(binary, target, folder, seconds):
    """Runs one target; returns whether it ended well, its output and what to record."""
    seeds, finds, crashes = (folder / name / target for name in ("seeds", "corpus", "crashes"))
    for path in (seeds, finds, crashes):
        path.mkdir(parents=True, exist_ok=True)
    options = os.environ.get("ASAN_OPTIONS", "")
    environment = {**os.environ, "ASAN_OPTIONS": f"max_allocation_size_mb={ALLOCATION_MIB}:allocator_may_return_null=1:{options}"}
    subprocess.run([binary], check=True, env={**environment, "SDAG_FUZZ_SEEDS": str(seeds)})
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(
            [binary, finds, seeds, f"-max_total_time={seconds}", f"-timeout={RUN_SECONDS}", f"-rss_limit_mb={RESIDENT_MIB}",
             f"-malloc_limit_mb={ALLOCATION_MIB}", f"-max_len={MAX_BYTES}", f"-artifact_prefix={crashes}/",
             "-print_final_stats=1"], env=environment, stderr=log, stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        log.seek(0)
        text = log.read().decode(errors="replace")
    return process.returncode == 0, text, {
        # A target that ended states no total; the last status line does.
        "executions": last_number(r"number_of_executed_units: *(\d+)", text) or last_number(r"(?m)^#(\d+)\s", text),
        "cpu_s": round(usage.ru_utime + usage.ru_stime, 1),
        "edge_count": last_number(r" cov: (\d+) ", text),
        "kept_count": len(list(finds.iterdir())),
    }


def commit_of(folder):
    described = subprocess.run(["git", "-C", folder, "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"],
                               capture_output=True, text=True)
    return described.stdout.strip() or "unknown"


def main(build, minutes, jobs, names):
    folder = pathlib.Path(build).resolve()
    binaries = {path.name.removeprefix("fuzz_"): path for path in sorted((folder / "tests/fuzz").glob("fuzz_*"))
                if path.is_file() and os.access(path, os.X_OK)}
    unknown = [name for name in names if name not in binaries]
    if not binaries or unknown:
        sys.exit(f"no such target: {' '.join(unknown) or 'none is built'}; there are {' '.join(binaries)}")
    chosen = names or list(binaries)
    seconds = max(1, round(60 * minutes * min(jobs, len(chosen)) / len(chosen)))
    record = folder / "executions.json"
    totals = json.loads(record.read_text()) if record.exists() else {}
    commit = commit_of(pathlib.Path(__file__).resolve().parent)
    failed = []
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        runs = {pool.submit(run, binaries[target], target, folder, seconds): target for target in chosen}
        for done in concurrent.futures.as_completed(runs):
            target, (is_whole, text, once) = runs[done], done.result()
            total = totals.setdefault(target, {"executions": 0, "cpu_s": 0, "edge_count": 0, "kept_count": 0,
                                               "ended_count": 0, "commits": []})
            total["executions"] += once["executions"]
            total["cpu_s"] = round(total["cpu_s"] + once["cpu_s"], 1)
            total["edge_count"] = max(total["edge_count"], once["edge_count"])
            total["kept_count"] = once["kept_count"]
            total["ended_count"] += not is_whole
            if commit not in total["commits"]:
                total["commits"].append(commit)
            print(f"{target:12} {once['executions']:10} executions in {seconds} s, {total['executions']} in all"
                  + ("" if is_whole else "; ENDED"), flush=True)
            if not is_whole:
                failed.append(target)
                print("\n".join(text.splitlines()[-40:]), flush=True)
            record.write_text(json.dumps(totals, indent=1, sort_keys=True) + "\n")
    print(f"{sum(total['executions'] for total in totals.values())} executions of all runs in {record}")
    if failed:
        sys.exit(f"ended: {' '.join(failed)}; the inputs are in {folder / 'crashes'}")


if __name__ == "__main__":
    arguments = sys.argv[1:]
    job_count = 1
    if "--jobs" in arguments[2:3] and re.fullmatch(r"[1-9]\d*", "".join(arguments[3:4])):
        job_count = int(arguments[3])
        del arguments[2:4]
    if len(arguments) < 2 or not re.fullmatch(r"\d+(\.\d+)?", arguments[1]) or "--jobs" in arguments:
        sys.exit(__doc__)
    main(arguments[0], float(arguments[1]), job_count, arguments[2:])
