# SPDX-License-Identifier: Apache-2.0
"""Draws the figures of the paper's evaluation from a sequence measured by `compare --sequence`.

Source of the figures: Olsson, Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual Shadow Maps for Many Lights,
TVCG 2015, sec. VII. Each figure is written as .svg and .png, its data as .csv and .json, its caption, with a table of
the paper's statements and the measurements, as .txt; charts.json lists them. A variant looks the same in all of
them. Figures without data are omitted and listed on standard error and in charts.json ("left_out"). After new
figures are written, older ones of the directory are removed.
"""
import sys

from ..files import WRONG_CONTENT, Refused, expecting
from ..style import plt
from .amounts import figure_15, figure_16, figure_17
from .culling import figure_13, figure_14
from .output import Figures
from .sequence import Missing, Sequence, load
from .temporal import figure_18
from .times import figure_10, figure_11, figure_12

FIGURES = {10: figure_10, 11: figure_11, 12: figure_12, 13: figure_13, 14: figure_14, 15: figure_15, 16: figure_16,
           17: figure_17, 18: figure_18}


def draw(paths, directory, numbers=None, mixed=False):
    """Draws figures of all sequences. numbers: only these, which must be there"""
    scenes, provenance, experiment, summaries = load(paths, mixed)
    figures = Figures(directory, provenance, experiment)
    left_out = []
    figures.charts.expect(len(scenes) * len(set(numbers or FIGURES)))
    for scene, rows in scenes.items():
        sequence = Sequence(scene, rows, summaries)
        for number in sorted(set(numbers or FIGURES)):
            try:
                missing = FIGURES[number](figures, sequence)
            except Missing as what:
                plt.close("all")
                missing = str(what)
            figures.charts.step()
            if missing and numbers:
                raise Refused(f"figure {number} of {scene} needs {missing}, which the results lack; measure them with "
                              "compare --sequence --variants")
            if missing:
                left_out.append({"figure": number, "scene": scene, "needs": missing})
                print(f"figures: figure {number} of {scene} is omitted: it needs {missing}", file=sys.stderr)
    figures.finish(left_out)


def declare(parser):
    parser.add_argument("results", nargs="+", help="results.json files of compare --sequence")
    parser.add_argument("-o", "--output", required=True, help="directory of the figures")
    parser.add_argument("--figure", type=int, action="append", choices=sorted(FIGURES), help="only this one")
    parser.add_argument("--mixed-commits", action="store_true", help="accept lines of different commits")


def run(arguments):
    with expecting(", ".join(arguments.results), "results of compare --sequence", WRONG_CONTENT):
        draw(arguments.results, arguments.output, arguments.figure, arguments.mixed_commits)
