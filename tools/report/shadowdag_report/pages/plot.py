# SPDX-License-Identifier: Apache-2.0
"""The interactive chart of a page: places of points, lines and ticks for the macro `plot`, which draws inline SVG.

Of the libraries that Debian 12 packages none fits: Plotly and Vega are megabytes in every page, libjs-d3 is of 2016,
Chart.js and Flot draw on a canvas, whose points take neither focus nor alternative text, uPlot is not packaged. What a
page needs (logarithmic axes, units, a legend, points that are links) is less text than binding one of them; it is
there without scripts, prints, and takes the page's colours. templates/plot.js only adds what follows pointer and keys.
"""
import math
from dataclasses import dataclass, field

from ..palette import BLACK
from ..scales import log_ticks, plain

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 66, 18, 32, 52  # margins
SHAPES = {  # within six units of the middle
    "circle": "M5 0A5 5 0 1 1-5 0A5 5 0 1 1 5 0Z", "square": "M-4.6-4.6H4.6V4.6H-4.6Z",
    "diamond": "M0-6.2L6.2 0L0 6.2L-6.2 0Z",
    "up": "M0-6L5.6 4.6H-5.6Z", "down": "M0 6L5.6-4.6H-5.6Z", "pentagon": "M0-6L5.7-1.9L3.5 4.9H-3.5L-5.7-1.9Z",
    "star": "M0-7L1.7-2.3L6.7-2.2L2.7.9L4.1 5.7L0 2.9L-4.1 5.7L-2.7.9L-6.7-2.2L-1.7-2.3Z",
    "cross": "M-5-3L-3-5L0-2L3-5L5-3L2 0L5 3L3 5L0 2L-3 5L-5 3L-2 0Z", "plus": "M-2-6H2V-2H6V2H2V6H-2V2H-6V-2H-2Z",
}


class LogAxis:
    """A logarithmic axis from one place to another. It has no zero: values of 0 are placed at its beginning, marked 0.
    """

    def __init__(self, title, values, begin, end, margin=1.3):
        positive = [v for v in values if v > 0] or [1.0]
        self.title, self.begin, self.end = title, begin, end
        self.low, self.high = min(positive) / margin, max(positive) * margin
        self.has_zero = any(v <= 0 for v in values)
        self.first = begin + (0.09 * (end - begin) if self.has_zero else 0)

    def place(self, value):
        if value <= 0:
            return self.begin
        return self.first + (self.end - self.first) * math.log(value / self.low) / math.log(self.high / self.low)

    def ticks(self):
        """Returns (place, text) in order."""
        zero = [(self.begin, "0")] if self.has_zero else []
        return zero + [(self.place(v), plain(v)) for v in log_ticks(self.low, self.high)]


class NameAxis:
    """An axis of names, one line each."""

    def __init__(self, title, names, begin, end):
        self.title, self.names = title, list(dict.fromkeys(names))
        step = (end - begin) / max(1, len(self.names))
        self.places = {name: begin + step * (i + 0.5) for i, name in enumerate(self.names)}

    def place(self, name):
        return self.places[name]

    def ticks(self):
        return [(self.places[name], name) for name in self.names]


@dataclass
class Series:
    """Points of one look. line: rows that a line joins, in order; is_hollow: of all its points"""
    name: str
    color: str
    shape: str
    rows: list
    line: list = field(default_factory=list)
    dash: str = ""
    is_hollow: bool = False


def shown_color(color):
    """Black is the colour of the page's text, so that it is seen in the dark as well."""
    return "var(--ink)" if color == BLACK else color


def plot(name, title, caption, series, axes, at, row_id, text, span=None, hollow=(), ringed=(), front=(), guide=None,
         height=HEIGHT, left=LEFT):
    """Returns what the macro `plot` draws.

    name: unique in the page; axes: x from `left` to WIDTH - RIGHT, y from height - BOTTOM to TOP; at(row): (x, y) of a
    row; row_id(row): the id of its line in a table; text(row): it in words; span(row): (least, greatest) x of its
    interval; hollow, ringed: rows with these marks; front: rows of the front, ascending in x; guide: (y, text) of a
    horizontal line
    """
    x_axis, y_axis = axes

    def placed(row):
        x, y = at(row)
        return round(x_axis.place(x), 1), round(y_axis.place(y), 1)

    def joined(rows):
        return " ".join(f"{x},{y}" for x, y in map(placed, rows))

    points = []
    for number, one in enumerate(series):
        for row in one.rows:
            x, y = placed(row)
            low, high = (round(x_axis.place(v), 1) for v in (span(row) if span else (at(row)[0],) * 2))
            points.append({"id": "point-" + row_id(row), "row": row_id(row), "x": x, "y": y, "low": low, "high": high,
                           "series": number, "shape": SHAPES[one.shape], "color": shown_color(one.color),
                           "text": text(row), "is_hollow": one.is_hollow or row in hollow, "is_ringed": row in ringed})
    steps = []  # of the front: right, then down
    for x, y in map(placed, front):
        steps += [(x, steps[-1][1])] if steps else []
        steps.append((x, y))
    return {"name": name, "title": title, "caption": caption, "width": WIDTH, "height": height, "left": left,
            "right": WIDTH - RIGHT, "top": TOP, "bottom": height - BOTTOM,
            "x_title": x_axis.title, "y_title": y_axis.title, "x_ticks": x_axis.ticks(), "y_ticks": y_axis.ticks(),
            "series": [{"name": s.name, "color": shown_color(s.color), "shape": SHAPES[s.shape], "dash": s.dash,
                        "is_hollow": s.is_hollow, "line": joined(s.line) if len(s.line) > 1 else ""} for s in series],
            "points": sorted(points, key=lambda p: (p["x"], p["y"])),
            "front": " ".join(f"{x},{y}" for x, y in steps) if len(front) > 1 else "",
            "guide": guide and {"y": round(y_axis.place(guide[0]), 1), "text": guide[1]}}


def x_axis_of(title, values, left=LEFT):
    return LogAxis(title, values, left, WIDTH - RIGHT)


def y_axis_of(title, values, height=HEIGHT):
    return LogAxis(title, values, height - BOTTOM, TOP)
