# SPDX-License-Identifier: Apache-2.0
"""The charts of one directory: each saved as SVG and PNG, listed in charts.json with title and caption.

A chart is designed for a printed width: up to WIDEST_FOR_ONE for one column of a paper (ONE_COLUMN), wider for two
(TWO_COLUMNS). There its smallest text has LEAST_POINTS at least, which `committed` checks.
"""
import os

from .files import write_json, written
from .stamp import metadata
from .style import plt

ONE_COLUMN, TWO_COLUMNS, WIDEST_FOR_ONE = 8.5, 17.8, 9.0  # cm
LEAST_POINTS = 5.0
STAMP = ""  # of the charts that are drawn: the command line sets it before a command runs
ONLY = None  # {name: kinds} of the charts to save, such as {"frame": "svg png"}; None: all in both kinds
SMALLEST = None  # {name: points} of the charts that are saved, by smallest_text; None: not measured


def smallest_text(figure, is_tight=False):
    """Returns the size, in points, of a figure's smallest text, printed at the width that the figure is designed for. A figure is
    scaled down to that width but never up. is_tight: it is saved with bbox_inches="tight", which changes its width
    """
    figure.canvas.draw()  # only now is all text in its place
    width = figure.get_size_inches()[0]
    if is_tight:
        width = figure.get_tightbbox(figure.canvas.get_renderer()).width + 2 * plt.rcParams["savefig.pad_inches"]
    shown = [axes for axes in figure.axes if axes.get_visible()]
    texts = {text for part in (figure.texts, figure.legends, shown) for each in part for text in each.findobj(plt.Text)}
    sizes = [text.get_fontsize() for text in texts if text.get_visible() and text.get_text().strip()]
    printed = ONE_COLUMN if 2.54 * width <= WIDEST_FOR_ONE else TWO_COLUMNS
    return min(sizes, default=LEAST_POINTS) * min(1.0, printed / (2.54 * width))


def save_figure(figure, base, **options):
    """Saves a figure as base.svg and base.png, or as ONLY says, and closes it. options: as savefig has them"""
    os.makedirs(os.path.dirname(base) or ".", exist_ok=True)
    kinds = ("svg", "png") if ONLY is None else ONLY.get(os.path.basename(base), "").split()
    for kind in kinds:
        with written(f"{base}.{kind}") as part:
            figure.savefig(part, format=kind, metadata=metadata(kind, STAMP), **options)
    if SMALLEST is not None:  # after saving: drawn once more, a layout may move
        SMALLEST[os.path.basename(base)] = smallest_text(figure, options.get("bbox_inches") == "tight")
    plt.close(figure)


class Charts:
    """Collects the charts of a directory; finish() lists them."""

    def __init__(self, directory, **options):
        """options: as savefig has them, of all charts"""
        self.directory, self.options = directory, options
        self.entries = []
        self.done = self.total = 0
        os.makedirs(directory, exist_ok=True)

    def expect(self, count):
        """Says how many steps there are; each is ended by step()."""
        self.done, self.total = -1, count
        self.step()

    def step(self):
        """Tells the program that started this how far it is, if it asks for that."""
        self.done += 1
        if os.environ.get("SHADOWDAG_PROGRESS"):
            print(f"\x1e{self.done / max(1, self.total):.4f}", flush=True)

    def save(self, figure, name, title, caption, **more):
        """more: further keys of the entry in charts.json"""
        save_figure(figure, os.path.join(self.directory, name), **self.options)
        self.entries.append({"file": name, "title": title, "caption": caption} | more)

    def finish(self, more=None):
        """more: further keys of charts.json"""
        write_json(os.path.join(self.directory, "charts.json"), {"charts": self.entries} | (more or {}))
