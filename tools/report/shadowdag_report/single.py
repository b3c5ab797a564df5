# SPDX-License-Identifier: Apache-2.0
"""Writes a page of a report as one file, to send or to publish: its pictures and charts stand in it.

    single DIR/index.html -o FILE.html

Links to the data beside the page, and to pictures as files, are left out.
"""
import base64
import html as html_text
import os
import re
import urllib.parse

from .files import expecting, write_text

TYPES = {".png": "image/png", ".svg": "image/svg+xml"}
SOURCE = re.compile(r'src="((?:images|charts)/[^"]+)"')
LINK = re.compile(r' href="(?!#)[^"]*"')


def embedded(html, directory):
    """Returns a page with its pictures in it. Throws OSError for one that is missing."""
    def data(match):
        path = urllib.parse.unquote(html_text.unescape(match[1]))
        with open(os.path.join(directory, path), "rb") as file:
            content = base64.b64encode(file.read()).decode()
        return f'src="data:{TYPES[os.path.splitext(path)[1]]};base64,{content}"'
    return LINK.sub("", SOURCE.sub(data, html))


def declare(parser):
    parser.add_argument("page", help="the page of a report, with its pictures beside it")
    parser.add_argument("-o", dest="output", required=True, help="the file to write")


def run(arguments):
    with expecting(arguments.page, "a page with its pictures"):
        with open(arguments.page, encoding="utf-8") as file:
            html = embedded(file.read(), os.path.dirname(os.path.abspath(arguments.page)))
    write_text(arguments.output, html)
