# SPDX-License-Identifier: Apache-2.0
"""Small sizes for the commands of documents: other values of options, experiments and studies of few frames and rows, and
a small scene in place of the large ones."""
import json
import re

from sources import expect

SCENE = "builtin:fail-lantern"
LARGE = re.compile(r"builtin:(?:atrium|houses|necropolis)\b")
SIZE = "48x27"
# Values that replace those of a command.
SMALL = {"--size": SIZE, "--frame-size": SIZE, "--resolution": "64", "--nanovdb-limit": "64", "--repeats": "1",
         "--warmups": "0", "--frames": "0:1", "--laps": "2"}
# Words that are added to a command, by its first words; an option of SMALL comes with its value, unless the command has it.
ADDED = {
    ("render",): ["--size"], ("validate",): ["--size"], ("rays",): ["--size"], ("voxelize",): ["--resolution"],
    ("compare",): ["--size", "--resolution", "--repeats", "--warmups"],
    ("bench",): ["--size", "--repeats"], ("bench", "voxel"): ["--resolution"],
    ("bench", "raster"): ["--maps", "2", "--face", "64"],
    ("fit",): ["--size", "--resolution", "--frames", "--taps", "1", "--maps-per-light", "1", "--undersample", "1",
               "--thresholds", "16"],
    ("calibrate",): ["--quick", SCENE, "builtin:fail-contact"]}
# Nothing is added to commands whose sizes a file has.
SIZED = re.compile(r"--experiment |--join |^rays \S+\.npz|--help$")
# Keys of studies by kind, and of their rows.
STUDIES = {
    "stability": {"width": 64, "frames": 2, "finest_voxels": 256, "undersample": [1], "perturbations": [], "known": []},
    "real": {"settings": "resolution=64 hybrid_believe=none", "frames": 1},
    "ablation": {"scenes": [SCENE], "size": SIZE, "resolution": 64, "sequence_frames": 2, "repeats": 1,
                 "cost_terms": False},
    "mutants": {"judges": ["contact"], "frames": []},
    "adjudication": {"disputed_size": "16x9", "pairs_of_given_scenes": 50},
    "scale": {"size": SIZE, "repeats": 1}}
ROWS = {"adjudication": {"pairs": 50}, "scale": {"triangles": [1, 3000], "resolutions": [64]}}
# Expressions of Python code, and what replaces them.
PYTHON = [(LARGE, SCENE), (re.compile(r"\b\d+x\d+\b"), SIZE), (re.compile(r"voxelize\(\d+\)"), "voxelize(64)"),
          (re.compile(r"repeats=\d+"), "repeats=1"),
          (re.compile(r"experiment=\{"),
           f'experiment={{"size": "{SIZE}", "resolutions": [64], "repeats": 1, "warmups": 0, ')]


def value_of(words, option):
    """Returns the value of an option in a command, or an empty text."""
    return words[words.index(option) + 1] if option in words[:-1] else ""


def small_words(words):
    """Returns the words of a command of the program at small size."""
    small = [LARGE.sub(SCENE, word) for word in words]
    for option, value in SMALL.items():
        if option in small:
            small[small.index(option) + 1] = value
    if SIZED.search(" ".join(words)):
        return small
    for first, added in ADDED.items():
        if tuple(words[:len(first)]) == first:
            for word in added:
                small += [] if word in words else [word, SMALL[word]] if word in SMALL else [word]
    return small


def small_experiment(experiment):
    """Returns an experiment of one scene, and of two frames if it is of a sequence, else one."""
    small = experiment | {"size": SIZE, "frames": "0:1" if experiment.get("sequence") else "0", "resolutions": [64],
                          "repeats": 1, "warmups": 0}
    for key, value in (("scenes", [SCENE]), ("dag_resolutions", [32]), ("flicker_points", 100)):
        if small.get(key):
            small[key] = value
    return small


def small_study(study, only):
    """Returns a study of those of its rows that are named, or of its first row."""
    small = study | STUDIES.get(study["kind"], {})
    rows = [row for row in study["rows"] if row["name"] in only] or study["rows"][:1]
    small["rows"] = [row | ROWS.get(study["kind"], {}) for row in rows]
    if "cases" in small:
        small["cases"] = small["cases"][:1]
    return json.loads(LARGE.sub(SCENE, json.dumps(small)))


def small_python(code):
    """Returns Python code with small sizes."""
    for expression, value in PYTHON:
        code = expression.sub(value, code)
    return code


def self_test():
    """Self-test of what is replaced and added."""
    expect(small_words("bench voxel builtin:atrium --size 1x1".split())
           == f"bench voxel {SCENE} --size {SIZE} --repeats 1 --resolution 64".split(), "values and scenes")
    expect(small_words("rays a.npz --answer b".split()) == "rays a.npz --answer b".split(), "a set has its size")
    small = small_study({"kind": "real", "frames": 4, "rows": [{"name": "a"}, {"name": "b", "scene": "builtin:houses"}]}, ["b"])
    expect(small["rows"] == [{"name": "b", "scene": SCENE}] and small["frames"] == 1, f"a small study {small}")
    small = small_experiment({"scenes": [], "sequence": True, "taps": [9]})
    expect(small["frames"] == "0:1" and small["scenes"] == [] and small["taps"] == [9], f"a small experiment {small}")
    expect(small_python('f("builtin:atrium", size="160x90", repeats=3)') == f'f("{SCENE}", size="{SIZE}", repeats=1)', "code")
