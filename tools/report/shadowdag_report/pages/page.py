# SPDX-License-Identifier: Apache-2.0
"""Shared by all pages: the templates, which escape all values, cells of tables, and numbers as text."""
import dataclasses
import importlib
import json
import os

import jinja2
from markupsafe import Markup

from ..files import expecting, read_json, write_text
from ..series import label_of

MEBI = 1024.0 * 1024.0  # bytes
TEMPLATES = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "templates")


@dataclasses.dataclass
class Cell:
    """A cell of a table. value: what it is sorted by; title: shown over it; is_wide: a sentence, which wraps"""
    shown: str
    value: float = None
    title: str = ""
    is_wide: bool = False

    @property
    def sorts_by(self):
        return "" if self.value is None else f"{self.value:.9f}"


def text(value):
    """Returns a JSON value as text: texts as they are, all else as JSON writes it."""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def grouped(value):
    """Returns a count with thin spaces between thousands."""
    return Markup(f"{value:,.0f}".replace(",", "&#8239;"))


def number(value, decimals):
    return f"{value:.{decimals}f}"


def cubed(label):
    """Returns a run's label with the cube of its resolution raised."""
    return label.replace("^3", "³")


def count(value):
    return Cell(grouped(value), value)


def counted(shown):
    """Returns a cell of a text, which sorts as the count that it is with its digits grouped, if it is one."""
    digits = "".join(shown.split())
    return Cell(shown, int(digits) if digits.isdigit() else None)


def decimal(value, decimals):
    return Cell(number(value, decimals), value)


def share_cell(value):
    """Returns a share as percent; empty for None."""
    return words("") if value is None else Cell(number(100 * value, 1), 100 * value)


def words(value):
    return Cell(text(value))


def wide(value):
    return Cell(text(value), is_wide=True)


def marked(value, is_marked):
    """Returns a cell whose text is bold where is_marked."""
    return Cell(Markup("<b>{}</b>").format(text(value)) if is_marked else text(value))


def to_point(row, cell):
    """Returns a row's first cell as the link to the row's point in the page's chart. row: the id of the row"""
    return dataclasses.replace(cell, shown=Markup('<a href="#point-{}">{}</a>').format(row, cell.shown))


def bounds_cell(cell):
    """Returns whether a study's cell keeps its bounds, or which it exceeds; that it has none, if so."""
    if cell["broken"]:
        return Cell(Markup("<b>broken:</b> {}").format(" ".join(map(text, cell["broken"]))))
    return Cell("hold" if cell.get("bounds", True) else "none")


def slack_text(study):
    """Returns what a study grants beyond a recorded count, as text; a study that does not say has the program's default."""
    slack = {"share": 0.05, "count": 3, **study.get("slack", {})}
    return Markup("{} % of it and {} more").format(number(100 * slack["share"], 1), grouped(slack["count"]))


def percent(row, key):
    """Returns a count of a row as a share of its pairs, in percent."""
    return 100 * row[key] / max(1, row["pair_count"])


def row_of(study, name):
    """Returns the study's row of a name in the results, which on a scene of the user's is ROW-SCENE."""
    rows = [r for r in study["rows"] if name == r["name"] or name.startswith(r["name"] + "-")]
    return max(rows, key=lambda r: len(r["name"]))


def key_rows(values):
    """Returns the rows of a table of keys and values."""
    return [[words(key), wide(value)] for key, value in values.items()]


def environment():
    made = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, undefined=jinja2.StrictUndefined,
                              trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    made.filters |= {"grouped": grouped, "number": number, "text": text, "cubed": cubed}
    made.globals |= {"percent": percent, "label_of": label_of}
    return made


def read_results(directory, name, what):
    """Returns a directory's file of results. what: as in "a results file of compare" """
    path = os.path.join(directory, name)
    with expecting(path, what):
        results = read_json(path)
        results["provenance"].items()
        return results


def read_charts(directory):
    """Returns the charts that the directory's charts.json lists."""
    return read_json(os.path.join(directory, "charts", "charts.json"))["charts"]


def drawn_charts(arguments, module, path):
    """Draws the charts of a page's data and returns them; nothing with --no-charts. module: of the package's charts, loaded
    when it is needed, as matplotlib takes its time"""
    if arguments.no_charts:
        return []
    importlib.import_module(f"..charts.{module}", __package__).draw(path, os.path.join(arguments.directory, "charts"))
    return read_charts(arguments.directory)


def write_page_file(page, template, path, what, content):
    """Writes a page from a template. path, what: the data it is made of, for a refusal; content(): what the template
    shows"""
    with expecting(path, what):
        try:
            html = environment().get_template(template).render(content())
        except jinja2.UndefinedError as error:
            raise KeyError(str(error)) from error
    write_text(page, html)


def write_page(directory, *arguments):
    """Writes a directory's index.html, as write_page_file does."""
    write_page_file(os.path.join(directory, "index.html"), *arguments)


def declare(parser):
    """Declares the arguments of every command that writes a page."""
    parser.add_argument("directory", help="the directory that holds the data and gets index.html")
    parser.add_argument("--no-charts", action="store_true", help="leave out charts, which need matplotlib")
