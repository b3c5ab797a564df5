# SPDX-License-Identifier: Apache-2.0
"""Hashes assets and frames of built-in scenes over instruction sets, threads, back ends and compilers.

    measure.py [BACKEND,...:]PROGRAM... -o FILE.json [--quick] [--isas ISA,...] [--threads N,...]

Each PROGRAM is a build of shadowdag; its provenance names the compiler and the system. Of each the back ends cpu and gl
are hashed, or those that stand before it. A program of the preset cuda-host plays its device (cuda_host). One for
arm64 may be a script that starts it by qemu-aarch64. The results are the data of the table in
docs/promises.md, which the command `determinism` of tools/report/shadowdag_report writes. They are added to those in
FILE.json and replace what the same system, compiler, back end and device gave before; the first ever measured is the
reference. --isas and --threads hash fewer, on a machine that is lent for minutes. --quick: fewer scenes and settings and nothing added, for a test, which fails (status 1) on a difference that no
explanation of the table covers.
"""
import argparse
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools/report"))
from shadowdag_report.determinism import column, unexplained  # noqa: E402

ISAS = ("portable", "avx2", "avx512")
THREADS = (1, 2, 3, 8, 16)
SCENES = ("fail-wires", "fail-lantern", "fail-alpha", "fail-sun", "fail-mover", "atrium")
# Name of a frame in the table and the options of its method.
FRAMES = {
    "dag believe all": ("--method", "dag", "--believe", "all", "--resolution", "512"),
    "dag believe none": ("--method", "dag", "--believe", "none"),
    "maps": ("--method", "maps",),
    "hybrid": ("--method", "hybrid", "--model", "texels:96", "--believe", "all", "--resolution", "512"),
}
# Keys of a frame's JSON that are not counts of what was computed.
NO_COUNTS = ("time_ms", "wall_ms", "stages_ms", "output", "host_copy_count", "host_readback_count")


def digest(data):
    return hashlib.sha256(data).hexdigest()[:16]


class Runner:
    """Runs one program with one instruction set, number of threads and back end."""

    def __init__(self, program, folder, isa, threads, backend):
        self.program, self.folder = program, folder
        self.environment = {**os.environ, "SHADOWDAG_ISA": isa, "XDG_CACHE_HOME": str(folder / f"cache-{isa}-{threads}-{backend}")}
        # Pages of sparse textures have the device's size, and so other counts.
        self.pages = ["--gl-pages", "atlas"] if backend == "gl" else []
        self.options = ["--threads", str(threads), "--backend", backend, "--json"]

    def json(self, *arguments):
        """Returns the JSON of a command, or None if it lacks the device or the instruction set."""
        ended = subprocess.run([self.program, *arguments, *self.options], env=self.environment, capture_output=True)
        if ended.returncode == 4:
            return None
        if ended.returncode != 0:
            sys.exit(f"{' '.join(arguments)}: status {ended.returncode}: {ended.stderr.decode()}")
        return json.loads(ended.stdout)

    def asset(self, scene):
        path = self.folder / "a.svdag"
        if self.json("voxelize", f"builtin:{scene}", "-o", str(path), "--resolution", "512") is None:
            return None
        return digest(path.read_bytes())

    def frame(self, scene, options):
        """Returns the provenance, the hash of the counts and that of the picture."""
        path = self.folder / "f.png"
        result = self.json("render", f"builtin:{scene}", "-o", str(path), "--size", "160x90", *options, *self.pages)
        if result is None:
            return None
        counts = {key: value for key, value in result["frames"][0].items() if key not in NO_COUNTS}
        return result["provenance"], digest(json.dumps(counts, sort_keys=True).encode()), digest(path.read_bytes())


def measure(program, folder, scenes, isas, threads, backends):
    """Returns one row per hash."""
    rows, left_out = [], []
    for backend in backends:
        for isa in isas if backend == "cpu" else isas[:1]:  # devices have instructions of their own
            for count in threads if backend == "cpu" else threads[:1]:
                runner = Runner(program, folder, isa, count, backend)
                probe = runner.frame(scenes[0], FRAMES["dag believe all"])
                if probe is None:
                    left_out.append(f"{backend} {isa}")
                    break
                where = {"system": probe[0]["system"], "compiler": probe[0]["compiler"], "backend": backend, "isa": isa,
                         "threads": count, "device": probe[0]["device"]}
                if "-march=armv8" in probe[0]["flags"]:
                    where["architecture"] = "arm64"
                for scene in scenes:
                    if backend == "cpu":
                        rows.append({**where, "scene": scene, "what": "asset", "hash": runner.asset(scene)})
                    for name, options in FRAMES.items():
                        if backend == "gl" and "none" in options:
                            continue  # exact rays are not supported
                        _, counts, picture = runner.frame(scene, options)
                        rows.append({**where, "scene": scene, "what": name + ", counts", "hash": counts})
                        rows.append({**where, "scene": scene, "what": name + ", picture", "hash": picture})
    return rows, left_out, probe_provenance(program, folder)


def refuses_unknown_instructions(program, folder):
    runner = Runner(program, folder, "sse9", 1, "cpu")
    ended = subprocess.run([program, "render", f"builtin:{SCENES[0]}", "-o", str(folder / "f.png"), *FRAMES["dag believe all"],
                            "--backend", "cpu"],
                           env=runner.environment, capture_output=True)
    return ended.returncode == 1 and b"SHADOWDAG_ISA 'sse9'" in ended.stderr


def probe_provenance(program, folder):
    return Runner(program, folder, "portable", 1, "cpu").frame(SCENES[0], FRAMES["dag believe all"])[0]


def joined(before, results):
    """Returns the record with new results: what was measured again, by column, instructions and threads, is replaced."""
    def place(row):
        return column(row), row["isa"], row["threads"]
    newer = {place(row) for row in results["rows"]}
    kept = [(row, before) for row in before["rows"] if place(row) not in newer] + [(row, results) for row in results["rows"]]
    columns = list(dict.fromkeys(column(row) for result in (before, results) for row in result["rows"]))
    rows, provenance = [], []
    for row, result in sorted(kept, key=lambda one: columns.index(column(one[0]))):  # the reference stays the first
        program = result["provenance"][row["program"]]
        if program not in provenance:
            provenance.append(program)
        rows.append({**row, "program": provenance.index(program)})
    isas = {f'{row["backend"]} {row["isa"]}' for row in rows}
    return {"provenance": provenance, "left_out": sorted({*before["left_out"], *results["left_out"]} - isas), "rows": rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--isas", default=",".join(ISAS))
    parser.add_argument("--threads", default=",".join(map(str, THREADS)))
    arguments = parser.parse_args()
    scenes = SCENES[:2] if arguments.quick else SCENES
    threads = (1, 3) if arguments.quick else tuple(map(int, arguments.threads.split(",")))
    isas = tuple(arguments.isas.split(","))
    if arguments.quick and arguments.threads != ",".join(map(str, THREADS)):
        parser.error("--quick has threads of its own; drop --threads")
    if not set(isas) <= set(ISAS):
        parser.error(f"--isas {arguments.isas}: use some of {', '.join(ISAS)}")
    rows, left_out, provenances = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.programs:
            backends, _, program = name.rpartition(":")
            program = os.path.abspath(program)
            measured = measure(program, pathlib.Path(folder), scenes, isas, threads, (backends or "cpu,gl").split(","))
            rows += [{**row, "program": len(provenances)} for row in measured[0]]
            left_out += measured[1]
            provenances.append(measured[2])
            if "cpu" in (backends or "cpu") and not refuses_unknown_instructions(program, pathlib.Path(folder)):
                sys.exit("SHADOWDAG_ISA=sse9 is not refused")
    output = pathlib.Path(arguments.output)
    is_added = output.exists() and not arguments.quick
    before = json.loads(output.read_text()) if is_added else {"provenance": [], "left_out": [], "rows": []}
    result = joined(before, {"provenance": provenances, "left_out": left_out, "rows": rows})
    output.write_text(json.dumps(result, indent=1) + "\n")
    print(f"{len(rows)} hashes; left out for lack of a device or an instruction set: {', '.join(result['left_out']) or 'nothing'}")
    lines = unexplained(result)
    print("\n".join(lines))
    sys.exit(1 if lines else 0)


if __name__ == "__main__":
    main()
