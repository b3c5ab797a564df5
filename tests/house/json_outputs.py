# SPDX-License-Identifier: Apache-2.0
"""Runs the program's commands at the smallest sizes, and yields the JSON that each writes, with the table of
docs/json_reference.md that describes it. Some JSON is edited before it is read again, to provoke rare keys."""
import json
import os
import pathlib
import shlex
import struct
import subprocess
import tempfile
import zipfile

SCENE = "builtin:fail-lantern"
SMALL = "--size 64x36 --resolution 64"
# Studies of one small row each, by kind; texts are added.
STUDIES = {
    "stability": {
        "width": 64, "frames": 2, "cases": [{"method": "maps", "name": "alone", "settings": "hysteresis=off"}],
        "bands": [{"id": "any", "part": "numeric", "kinds": ["rays"], "methods": ["dag believe all"],
                   "measure": "lost_count", "low": "0", "high": "1", "formula": "0 to 1", "reason": "x"}], "known": [],
        "rows": [{"name": "time-a", "part": "time", "scene": "builtin:fail-popping", "outlines": 4, "what": "x"},
                 {"name": "numeric-a", "part": "numeric", "kind": "rays", "sizes": [64], "what": "x"}]},
    "real": {"settings": "resolution=64", "frames": 1, "placed_lights": 1, "rows": []},
    "ablation": {
        "scenes": [SCENE], "size": "64x36", "resolution": 64, "sequence_frames": 1, "repeats": 1, "cost_terms": False,
        "rows": [{"name": "row", "what": "x", "method": "maps", "metric": "time_ms", "error_metric": "flip",
                  "off": "taps=1", "on": "taps=4", "source": "x"}]},
    "adjudication": {
        "disputed_size": "16x9", "faultless": ["truth"],
        "rows": [{"name": "row", "scene": SCENE, "pairs": 50}, {"name": "scene", "geometry_hash": "0"}]},
    "scale": {
        "size": "16x9", "settings": "pool=64M", "repeats": 1,
        "rows": [{"name": "row", "scene": SCENE, "what": "x", "grow": "tessellate", "triangles": [1, 2],
                  "resolutions": [64]}]},
}
SCENES_OF = {"real": "scene.glb", "adjudication": "scene.glb"}  # given on the command line


def npy(letters, values):
    """Returns numbers in numpy's file format. @param letters "B" for bytes, "d" for doubles"""
    kind = {"B": "|u1", "d": "<f8"}[letters]
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': ({len(values)},), }}".ljust(117) + "\n"
    return (b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode()
            + struct.pack(f"<{len(values)}{letters}", *values))


def write_answers(path, name, ray_set, times):
    """Writes the answer "lit" to all pairs of a set. @param times of repetitions; may be none"""
    arrays = {"name": npy("B", name.encode()), "set_id": npy("B", ray_set["set_id"].encode()),
              "lit": npy("B", [1] * ray_set["pair_count"]), "build_ms": npy("d", [1.0])}
    if times:
        arrays["time_ms"] = npy("d", times)
    with zipfile.ZipFile(path, "w") as file:
        for array, content in arrays.items():
            file.writestr(array + ".npy", content)


def write_changed(path, results):
    """Writes results of compare that differ in all ways that diff tells apart."""
    changed = json.loads(json.dumps(results))
    changed["provenance"]["commit"] = "other"
    for run in changed["runs"]:
        for key in ("time_ms", "time_ms_low", "time_ms_high", "time_ms_min", "time_ms_max"):
            run[key] *= 100
        run["false_light_count"] += 1
        run["pair_count"] += 1
        del run["flip"]
    changed["runs"][0]["label"] = "other"
    path.write_text(json.dumps(changed))


class Commands:
    """Runs commands in a folder that is their working directory and their cache."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(folder), MPLBACKEND="Agg")

    def run(self, line, program=None, statuses=(0,)):
        """Runs a command and returns its standard output."""
        done = subprocess.run([*(program or [self.program]), *shlex.split(line)], cwd=self.folder, env=self.environment,
                              capture_output=True, text=True)
        if done.returncode not in statuses:
            raise SystemExit(f"shadowdag {line}: ended with {done.returncode}: {(done.stdout + done.stderr)[-2000:]}")
        return done.stdout

    def json(self, line, statuses=(0,)):
        return json.loads(self.run(line + " --json", statuses=statuses))

    def read(self, name):
        return json.loads((self.folder / name).read_text())

    def outputs(self):
        """Yields (command, table, value)."""
        def said(line, table, statuses=(0,)):
            return f"shadowdag {line}", table, self.json(line, statuses)

        def wrote(line, table, file):
            return f"shadowdag {line}: {file}", table, self.read(file)

        yield said("scene --list", "messages")
        yield said("study --list", "messages")
        yield said("scene fail-lantern -o scene.glb", "messages")
        yield said(f"info {SCENE}", "info")
        yield said(f"voxelize {SCENE} -o a.svdag --resolution 64", "voxelize")
        yield said("info a.svdag", "asset")
        for part in "12":
            yield said(f"voxelize {SCENE} -o {part}.svpart --part {part}/2 --resolution 64", "voxelize")
        yield said("merge 1.svpart 2.svpart -o merged.svdag", "voxelize")
        yield said("export a.svdag -o a.nvdb", "messages")
        yield said("import a.nvdb -o b.svdag", "voxelize")

        yield said(f"render {SCENE} -o a.png --method hybrid --frames 0:1 {SMALL}", "render")
        yield said(f"render {SCENE} -o b.png --method truth --views 2 --size 16x9", "render")
        yield said(f"render {SCENE} --laps 2 --method maps --frames 0:1 --size 64x36", "render")
        yield said(f"validate {SCENE} --method maps --size 64x36", "validate")
        yield said(f"validate {SCENE} --views 2 --size 16x9", "validate")
        yield said(f"bench voxel {SCENE} --repeats 1 {SMALL}", "bench")
        yield said(f"bench raster {SCENE} --repeats 1 --maps 2 --face 64 --size 64x36", "bench")
        yield said(f"bench shading {SCENE} --repeats 1 --size 64x36", "bench")

        measured = "--repeats 2 --warmups 0 --no-charts"
        full = "--page-size 256 --pool 1M"  # a pool that is full
        line = f"compare {SCENE} {SMALL} --believe all --start cold,warm --lights 4 --thresholds 16 {full} {measured}"
        yield said(f"{line} -o a", "messages")
        yield wrote(line, "compare", "a/results.json")
        yield wrote(line, "costs", "a/costs.json")
        write_changed(self.folder / "changed.json", self.read("a/results.json"))
        yield said("diff a changed.json", "diff", statuses=(5,))
        line = f"compare {SCENE} {SMALL} --sequence --variants PMCD-EB,Hybrid --frames 0:1 {measured} -o sequence"
        yield said(line, "messages")
        yield wrote(line, "compare", "sequence/results.json")
        for part in "12":
            line = f"compare {SCENE} --frames 0:1 --methods dag --size 64x36 --repeats 1 --part {part}/2 -o part-{part}"
            yield said(line, "messages")
        line = "compare --join part-1 part-2 -o joined --no-charts"
        yield said(line, "messages")
        yield wrote(line, "compare", "joined/results.json")

        # The choice of bytes has a cheaper neighbour that breaks the bound.
        for objective, rest in (("bytes", "builtin:fail-silhouette --max 0.02 --no-charts"),
                                ("time", f"{SCENE} --max 0.9 {measured}")):
            line = (f"fit -o {objective}.json --minimise {objective} --size 64x36 --frames 0 --resolution 64,128 "
                    "--believe all --methods dag,maps,hybrid --undersample 1,2 --taps 1 --maps-per-light 1 "
                    f"--thresholds 16 {full} {rest}")
            yield said(line, "messages")
            yield wrote(line, "fit", f"{objective}.json")
        line = f"calibrate {SCENE} builtin:fail-contact --quick -o C.json --observations O.json {SMALL} --believe all"
        yield said(line, "messages")
        yield wrote(line, "calibrate", "C.json")
        yield wrote(line, "calibrate", "O.json")

        line = f"rays {SCENE} --size 16x9 -o set.npz"
        yield said(line, "messages")
        ray_set = self.json(line)
        write_answers(self.folder / "timed.npz", "timed", ray_set, [1.0, 2.0])
        write_answers(self.folder / "untimed.npz", "untimed", ray_set, [])
        line = "rays set.npz --answer timed.npz --answer untimed.npz -o rows"
        yield said(line, "rays")
        yield wrote(line, "rays", "rows/tracers.json")
        plugin = pathlib.Path(self.program).resolve().parents[1] / "examples/libembree_tracer.so"
        if plugin.exists():  # masks cut the scene, which it does not see
            yield said(f"rays builtin:fail-alpha --size 16x9 --tracer {plugin} -o cut", "rays")
        yield from self.studies(said, wrote)
        yield from self.reports(said, wrote)

    def studies(self, said, wrote):
        """Yields what studies write."""
        line = "study failures --only acne -o failures --no-charts"
        yield said(line, "messages", statuses=(0, 5))
        yield wrote(line, "study-failures", "failures/failures.json")
        for kind, study in STUDIES.items():
            study = {"kind": kind, "title": "x", "what": "x"} | study
            (self.folder / f"{kind}.study.json").write_text(json.dumps(study))
            line = f"study {kind}.study.json {SCENES_OF.get(kind, '')} -o {kind} --no-charts"
            yield said(line, "messages", statuses=(0, 5))
            yield wrote(line, f"study-{kind}", f"{kind}/{kind}.json")

    def reports(self, said, wrote):
        """Yields what the package of reports writes."""
        yield said("figures sequence -o figures", "messages")
        compare = f"compare {SCENE} {SMALL} --believe all --methods dag,maps,hybrid --model cost --model oracle"
        self.run(f"{compare} --costs C.json --repeats 2 --warmups 0 --no-charts -o routed")
        package = self.program.parent / "shadowdag_report"
        self.run("regret routed/results.json -o regret", program=["/usr/bin/python3", package])
        yield wrote(compare + ", shadowdag_report regret", "regret", "regret/regret.json")


def outputs_of(program):
    """Yields (command, table, value) of all commands."""
    with tempfile.TemporaryDirectory() as folder:
        yield from Commands(program, pathlib.Path(folder)).outputs()
