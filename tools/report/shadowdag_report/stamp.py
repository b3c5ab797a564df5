# SPDX-License-Identifier: Apache-2.0
"""The stamp of a chart: the command that draws it, a hash of the modules that do, and one of the data. It stands in the
metadata of the SVG and in a text chunk of the PNG, so that a chart that is older than its data or its drawing is found.
"""
import ast
import functools
import hashlib
import os
import re
import struct
import zlib

KEYWORD = "shadowdag-data"
# The commands that draw charts, and the module of each, below this package.
MODULES = {"charts": "charts", "figures": "figures", "stability-charts": "charts.stability", "mechanisms-chart": "charts.mechanisms",
           "regret": "charts.regret", "bias": "charts.bias", "layouts": "charts.layouts", "frame": "charts.frame",
           "main": "charts.main", "scale-chart": "charts.scale"}
WITHOUT_DRAWING = {"files", "collection", "stamp"}  # they read and write files
PACKAGE = os.path.dirname(os.path.abspath(__file__))
PNG_HEAD = b"\x89PNG\r\n\x1a\n"


def file_of(module, package=PACKAGE):
    """Returns the file of a module below the package, None if it is none."""
    path = os.path.join(package, *module.split("."))
    return next((file for file in (f"{path}.py", os.path.join(path, "__init__.py")) if os.path.exists(file)), None)


def imports_of(module, package=PACKAGE):
    """Returns the modules of the package that a module imports."""
    path = file_of(module, package)
    is_folder = os.path.basename(path) == "__init__.py"
    found = set()
    with open(path, encoding="utf-8") as file:
        tree = ast.parse(file.read())
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            parts = module.split(".") + [""] * is_folder
            base = parts[:len(parts) - node.level] + (node.module or "").split(".") * bool(node.module)
            for name in [base] + [base + [alias.name] for alias in node.names]:
                if name and file_of(".".join(name), package):
                    found.add(".".join(name))
    return found


def code_of(path):
    """Returns the lines of a module without docstrings, comments of their own and empty lines."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    left_out = set()
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            left_out.update(range(body[0].lineno, body[0].end_lineno + 1))
    return [line for number, line in enumerate(text.splitlines(), 1)
            if number not in left_out and line.strip() and not line.lstrip().startswith("#")]


def hash_of(contents):
    """Returns 16 digits of a hash of texts in bytes, in their order."""
    digest = hashlib.sha256()
    for content in contents:
        digest.update(f"{len(content)}:".encode() + content)
    return digest.hexdigest()[:16]


@functools.lru_cache(maxsize=None)
def drawing_of(command, package=PACKAGE):
    """Returns a hash of the code that draws the charts of a command: of its module and all of the package that these import,
    but for what only reads and writes files."""
    modules, open_ones = set(), {MODULES[command]}
    while open_ones:
        module = open_ones.pop()
        modules.add(module)
        open_ones |= imports_of(module, package) - modules - WITHOUT_DRAWING
    return hash_of(f"{module}\n".encode() + "\n".join(code_of(file_of(module, package))).encode() for module in sorted(modules))


def stamp_of(command, paths):
    """Returns the stamp of the charts that a command draws from files: the command, a hash of its drawing, one of its data."""
    def content(path):
        with open(path, "rb") as file:
            return file.read()
    return f"{command} {drawing_of(command)} {hash_of(map(content, paths))}"


def stamp_of_arguments(command, arguments):
    """The same for those arguments of a command that are files."""
    return stamp_of(command, [a for a in arguments if os.path.isfile(a)])


def metadata(kind, stamp):
    """Returns the metadata of savefig. kind: svg or png; stamp: "" for none"""
    if kind == "svg":
        return {"Date": None} | ({"Description": f"{KEYWORD}: {stamp}"} if stamp else {})
    return {KEYWORD: stamp} if stamp else {}


def stamp_in(path):
    """Returns the stamp of a chart, None for a file without one."""
    with open(path, "rb") as file:
        content = file.read()
    if content.startswith(PNG_HEAD):
        at = len(PNG_HEAD)
        while at + 12 <= len(content):
            length, kind = struct.unpack(">I4s", content[at:at + 8])
            body = content[at + 8:at + 8 + length]
            if kind == b"tEXt" and body.split(b"\0")[0] == KEYWORD.encode():
                return body.split(b"\0", 1)[1].decode("latin-1")
            if kind == b"zTXt" and body.split(b"\0")[0] == KEYWORD.encode():
                return zlib.decompress(body.split(b"\0", 1)[1][1:]).decode("latin-1")
            at += 12 + length
        return None
    found = re.search(KEYWORD.encode() + rb": ([^<]*)", content)
    return found and found.group(1).decode()
