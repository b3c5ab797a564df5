# SPDX-License-Identifier: Apache-2.0
"""Measures what the Python module adds to the time of a frame, and how long an asset takes from its file to traced rays.

    module.py BUILD -o FILE.json [--repeats N]      BUILD: a build of preset release with the module

Frames: wall clock of a call of Scene.frame(record=False) over that of the renderer inside it (Frame.wall_ms), each scene, size and method
in a process of its own, after two calls that are not counted. Nothing is reported unless the frame's counts equal those of `shadowdag render`.

Assets: 4096^3, packed fast, each time in a new process: wall clock of load_asset, which reads and verifies all of it, and of the first call
of occluded, which builds the form that rays read and traces a few. The file is in the system's cache. Nothing is timed unless the loaded
voxels equal those that were saved.

Written are medians, least and greatest of each, and what was measured by which program.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

SCENES = ("builtin:atrium", "builtin:houses", "builtin:necropolis")
METHODS = {"maps": {"pool_mib": 1024, "start": "cold"}, "dag": {"believe": "none"}, "embree": {}}
OPTIONS = {"maps": ["--pool", "1G"], "dag": ["--believe", "none"], "embree": []}

# Run by an interpreter of their own. They print JSON.
FRAMES = """
import json, sys, time
import shadowdag
scene_name, repeats, settings = sys.argv[1], int(sys.argv[2]), json.loads(sys.argv[3])
scene, calls, renderer = shadowdag.load(scene_name), [], []
for _ in range(repeats + 2):
    begin = time.perf_counter()
    frame = scene.frame(settings, record=False)
    calls.append(1e3 * (time.perf_counter() - begin))
    renderer.append(frame.wall_ms)
print(json.dumps({"call_ms": calls[2:], "renderer_ms": renderer[2:], "counts": frame.counts}))
"""
ASSET = """
import json, sys, time
import numpy as np
import shadowdag
start = np.zeros((64, 3), np.float32)
end = np.full((64, 3), 4096, np.float32)
end[:, 0] -= np.arange(64)
begin = time.perf_counter()
dag = shadowdag.load_asset(sys.argv[1])
read = time.perf_counter()
dag.occluded(start, end)
traced = time.perf_counter()
print(json.dumps({"read_ms": 1e3 * (read - begin), "first_rays_ms": 1e3 * (traced - read), "open_ms": 1e3 * (traced - begin)}))
"""
SAVE = """
import sys
import shadowdag
dag = shadowdag.load(sys.argv[1]).voxelize(4096)
dag.save(sys.argv[2], packing="fast")
if (shadowdag.load_asset(sys.argv[2]).words != dag.words).any():
    sys.exit("the asset has other voxels than the scene")
print(len(dag.words))
"""


def python(build, code, *words):
    environment = os.environ | {"PYTHONPATH": str(build / "python")}
    return json.loads(subprocess.run([sys.executable, "-c", code, *map(str, words)], check=True, text=True, stdout=subprocess.PIPE,
                                     env=environment).stdout)


def spread(key, values):
    return {key: statistics.median(values), f"{key}_min": min(values), f"{key}_max": max(values)}


def frame_row(build, scene, size, method, repeats):
    """Returns a row of `frames` and the program's provenance. Exits where module and program count different things."""
    told = subprocess.run([build / "tools/shadowdag", "render", scene, "--method", method, "--size", size, *OPTIONS[method], "--laps", "1",
                           "--json"], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    program = json.loads(told)
    module = python(build, FRAMES, scene, repeats, json.dumps({"method": method, "size": size} | METHODS[method]))
    program_counts = {key: program["frames"][0][key] for key in module["counts"]}
    if program_counts != module["counts"]:
        sys.exit(f"{scene} {method} {size}: the module counts {module['counts']}, the program {program_counts}")
    calls, renderer = module["call_ms"], module["renderer_ms"]
    row = {"scene": scene, "size": size, "method": method, "repeat_count": repeats}
    row |= spread("call_ms", calls) | spread("renderer_ms", renderer)
    row |= spread("call_over_renderer", [call / inner for call, inner in zip(calls, renderer)])
    print("{scene} {method} {size}: {call_over_renderer:.4f} ({call_over_renderer_min:.4f} to {call_over_renderer_max:.4f})".format(**row),
          flush=True)
    return row, program["provenance"]


def asset_row(build, scene, repeats):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "asset.svdag"
        words = python(build, SAVE, scene, path)
        row = {"scene": scene, "repeat_count": repeats, "word_count": words, "asset_bytes": path.stat().st_size}
        runs = [python(build, ASSET, path) for _ in range(repeats)]
    for key in runs[0]:
        row |= spread(key, [run[key] for run in runs])
    print("{scene}: opened and traced in {open_ms:.1f} ms ({open_ms_min:.1f} to {open_ms_max:.1f})".format(**row), flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("-o", dest="output", type=pathlib.Path, required=True)
    parser.add_argument("--repeats", type=int, default=20)
    options = parser.parse_args()
    build = options.build.resolve()
    assets = [asset_row(build, scene, options.repeats) for scene in SCENES]
    frames, provenance = [], {}
    for scene in SCENES:
        for size in ("640x360", "1920x1080"):
            for method in METHODS:
                row, provenance = frame_row(build, scene, size, method, options.repeats)
                frames.append(row)
    options.output.write_text(json.dumps({"bench": "module", "assets": assets, "frames": frames, "provenance": provenance}, indent=1) + "\n")


if __name__ == "__main__":
    main()
