# SPDX-License-Identifier: Apache-2.0
"""Draws the charts of docs/ from the committed results, or checks that none is older than its data or its drawing.

    committed SOURCE_DIR [--only NAME...] [--check]

With --check every chart is drawn into a temporary directory and its stamp (stamp.py) compared with that of the committed
file; nothing is written. A chart whose smallest text is too small in print (collection.py) is refused. A new chart is a row of
CHARTS; a picture that no results are drawn into is one of OTHER_PICTURES.
"""
import contextlib
import importlib
import io
import os
import shutil
import tempfile

from . import collection
from .files import Refused, expecting
from .stamp import MODULES, stamp_in, stamp_of

RESULTS, DOCS = "tests/bench/results", "docs"
TRACED = ("crytek_sponza_half", "conference", "bitterli_house", "lost_empire_torches", "kaykit_dungeon", "atrium", "houses", "necropolis")
BELIEVED = ("builtin_houses", "builtin_necropolis", "crytek_sponza_half_glb", "kaykit_dungeon_glb", "lost_empire_torches_glb",
            "lq_e1m1_glb", "lq_e2m3_glb")
# command, its data, {name as drawn: name in docs with the kinds that are committed}
CHARTS = (
    ("charts", ("compare-atrium.json",), {"speed_accuracy_builtin_atrium": ("speed_accuracy", "png")}),
    ("charts", ("compare-believe.json",), {"believe_builtin_atrium": ("believe", "png")} |
     {f"believe_{scene}": (f"believe_{scene.removeprefix('builtin_').removesuffix('_glb')}", "png") for scene in BELIEVED}),
    ("main", ("main_placed.json", "main.json") + tuple(f"tracers-{scene}.json" for scene in TRACED), {"main": ("main", "svg png")}),
    ("main", ("main_placed_1080p.json", "main_1080p.json"), {"main": ("main_1080p", "svg png")}),
    ("main", ("main_placed_gpu.json", "main_gpu.json"), {"main": ("main_gpu", "svg png")}),
    ("main", ("compare-beams_placed.json", "compare-beams.json"), {"main": ("beams", "svg png")}),
    ("main", ("compare-beams_placed_1080p.json", "compare-beams_1080p.json"), {"main": ("beams_1080p", "svg png")}),
    ("charts", ("compare-lod.json",), {"lod_builtin_atrium": ("lod", "png")}),
    ("figures", ("figures_atrium.json",), {f"figure_{n}_builtin_atrium": (f"figure_{n}", "svg png") for n in (15, 16)}),
    ("figures", ("figures_houses.json",), {f"figure_{n}_builtin_houses": (f"figure_{n}_houses", "svg png") for n in (15, 16)}),
    ("figures", ("figures_necropolis.json",), {f"figure_{n}_builtin_necropolis": (f"figure_{n}_necropolis", "svg png")
                                               for n in (15, 16)}),
    ("figures", ("figure_10.json",), {"figure_10_builtin_atrium": ("figure_10", "svg png"),
                                      "figure_10_builtin_houses": ("figure_10_houses", "svg png"),
                                      "figure_10_builtin_necropolis": ("figure_10_necropolis", "svg png")}),
    ("figures", ("slow_camera.json",), {f"figure_{n}_builtin_atrium": (f"figure_{n}", "svg png") for n in (17, 18)}),
    ("figures", ("figure_11_sparse.json",), {"figure_11_builtin_houses": ("figure_11_sparse", "png")}),
    ("stability-charts", ("stability.json",), {f"stability_{p}": (f"stability_{p}", "png") for p in ("time", "perturbation", "resolution")}),
    ("mechanisms-chart", ("mechanisms.json",), {"mechanisms": ("mechanisms", "svg png")}),
    ("regret", ("regret.json",), {"regret": ("regret", "svg png")}),
    ("bias", ("filters.json",), {"bias": ("bias", "svg png")}),
    ("layouts", ("layouts.json",), {"layouts": ("layouts", "svg png")}),
    ("frame", ("bench-voxel-atrium-4096.json", "bench-voxel-sponza-4096.json"), {"frame": ("frame", "svg png")}),
)
FIGURES_ONLY = {"figures_atrium.json": (15, 16), "figures_houses.json": (15, 16), "figures_necropolis.json": (15, 16),
                "figure_10.json": (10,), "slow_camera.json": (17, 18), "figure_11_sparse.json": (11,)}
# Pictures of docs/ without a stamp, and why they have none.
OTHER_PICTURES = {
    "atrium.png": "a frame of the program: shadowdag render builtin:atrium; it shows no number, and to draw it needs the program",
    "view.png": "a screenshot of the window, which needs a display and a person; it shows no number of a result",
    "rooms.svg": "drawn by hand: the folders and what they may include, which include_order.py checks in the sources",
    "dag_node.svg": "drawn by hand: the layout of a node, which static_asserts hold",
    "svdag_layout.svg": "drawn by hand: the bytes of a file, which tests of its reader hold"}


def arguments_of(command, data, directory):
    """Returns the arguments with which a command draws its charts into a directory."""
    arguments = list(data) + ["-o", os.path.join(directory, "frame.png") if command == "frame" else directory]
    for number in FIGURES_ONLY.get(os.path.basename(data[0]), ()):
        arguments += ["--figure", str(number)]
    return arguments


def draw(command, data, directory, charts):
    """Draws charts of one command, stamped with their data; the others that it draws are not saved."""
    import argparse
    module = importlib.import_module("shadowdag_report." + MODULES[command])
    parser = argparse.ArgumentParser(prog=command)
    module.declare(parser)
    collection.STAMP = stamp_of(command, data)
    collection.ONLY = {name: kinds for name, (_, kinds) in charts.items()}
    collection.SMALLEST = {}
    with contextlib.redirect_stdout(io.StringIO()):
        module.run(parser.parse_args(arguments_of(command, data, directory)))


def compare(drawn, committed):
    """Returns what is wrong with a committed chart, "" if nothing."""
    if not os.path.exists(committed):
        return f"{committed}: does not exist"
    is_there, should_be = stamp_in(committed), stamp_in(drawn)
    return "" if is_there == should_be else (f"{committed}: was drawn from other data or by an earlier drawing ({is_there}), not from the "
                                             f"committed results ({should_be})")


def unlisted(docs):
    """Returns the pictures of a folder that are neither listed as charts nor as others, and the listed ones that it lacks."""
    listed = {f"{target}.{kind}" for _, _, charts in CHARTS for target, kinds in charts.values() for kind in kinds.split()}
    there = {name for name in os.listdir(docs) if name.endswith((".png", ".svg"))}
    return ([f"{name}: is listed neither in CHARTS nor in OTHER_PICTURES" for name in sorted(there - listed - set(OTHER_PICTURES))]
            + [f"{name}: is listed and does not exist" for name in sorted((listed | set(OTHER_PICTURES)) - there)])


def declare(parser):
    parser.add_argument("source", help="the directory of the project's source")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="only these charts, as they are named in docs")
    parser.add_argument("--check", action="store_true", help="write nothing; only compare")


def run(arguments):
    wrong = unlisted(os.path.join(arguments.source, DOCS)) if arguments.check else []
    for command, files, charts in CHARTS:
        kept = {name: target for name, target in charts.items() if not arguments.only or target[0] in arguments.only}
        if not kept:
            continue
        data = [os.path.join(arguments.source, RESULTS, name) for name in files]
        with expecting(data[0], "a committed result"), tempfile.TemporaryDirectory() as directory:
            draw(command, data, directory, kept)
            for name, (target, kinds) in kept.items():
                points = collection.SMALLEST[name]
                if points < collection.LEAST_POINTS:
                    wrong.append(f"{target}: its smallest text has {points:.1f} points in print; {collection.LEAST_POINTS:g} at least")
                for kind in kinds.split():
                    drawn = os.path.join(directory, f"{name}.{kind}")
                    committed = os.path.join(arguments.source, DOCS, f"{target}.{kind}")
                    if arguments.check:
                        wrong.append(compare(drawn, committed))
                    else:
                        shutil.copyfile(drawn, committed)
    wrong = [text for text in wrong if text]
    if wrong:
        raise Refused("; ".join(wrong) + "; draw them anew with the command committed")
