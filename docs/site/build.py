# SPDX-License-Identifier: Apache-2.0
"""Builds the documentation site: doxygen reads the public headers, then Sphinx writes DIR/html. Warnings are errors, as
are links between pages that lead nowhere.

    build.py BUILD DIR [--source DIR]    BUILD is a finished build with the program and the Python module

Exits with 77 where Sphinx, its extensions or doxygen are not installed.
"""
import argparse
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
MISSING_STATUS = 77
PARTS = ("sphinx", "myst_parser", "breathe", "furo")
# All names are in one namespace, which is left out of theirs: each header would declare it anew.
DOXYGEN = """
PROJECT_NAME = ShadowDAG
INPUT = {headers}
STRIP_FROM_PATH = {root}
OUTPUT_DIRECTORY = {output}
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = __cplusplus SDAG_HD= SDAG_LEAF_BEGIN= SDAG_LEAF_END= SDAG_LEAF= SDAG_EXACT= SDAG_CONST=const "SDAG_IN(type)=const type&"
EXCLUDE_SYMBOLS = detail detail::*
INPUT_FILTER = "sed -e '/^namespace shadowdag {{$/d' -e '/^}} .. namespace shadowdag$/d'"
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
WARN_IF_DOC_ERROR = NO
WARN_NO_PARAMDOC = NO
WARN_IF_INCOMPLETE_DOC = NO
"""


def missing():
    """Returns which modules and programs are not installed."""
    return ([part for part in PARTS if importlib.util.find_spec(part) is None]
            + [program for program in ("doxygen",) if not shutil.which(program)])


def broken_links(site):
    """Returns the links of the pages to files of the site that it does not have."""
    broken = []
    for page in sorted(site.rglob("*.html")):
        for link in set(re.findall(r'(?:href|src)="([^"#]+)', page.read_text())):
            target = page.parent / urllib.parse.unquote(link.partition("?")[0])
            if not re.match(r"[a-z]+:", link) and not target.exists():
                broken.append(f"{page.relative_to(site)}: links to '{link}', which the site does not have")
    return broken


def build(build_folder, output, source):
    """Builds the site and returns the exit status."""
    headers = re.findall(r"^```\{doxygenfile\} (\S+)", (source / "docs/site/cpp_api.md").read_text(), re.MULTILINE)
    output.mkdir(parents=True, exist_ok=True)
    inputs = " ".join(str(source / header) for header in headers)
    configuration = DOXYGEN.format(headers=inputs, root=source, output=output)
    subprocess.run(["doxygen", "-"], input=configuration, text=True, check=True)
    environment = dict(os.environ, SHADOWDAG_DOXYGEN=str(output / "xml"), SHADOWDAG_BUILD=str(build_folder))
    command = [sys.executable, "-B", "-m", "sphinx", "-b", "html", "-q", "-W", "--keep-going",
               "-c", source / "docs/site", "-d", output / "doctrees", source, output / "html"]
    status = subprocess.run([str(word) for word in command], env=environment).returncode
    if status:
        return status
    shutil.copy(output / "html/README.html", output / "html/index.html")  # the name that servers look for
    broken = broken_links(output / "html")
    print("\n".join(broken + [f"the documentation begins at {output / 'html/index.html'}"]))
    return 1 if broken else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--source", type=pathlib.Path, default=ROOT)
    arguments = parser.parse_args()
    absent = missing()
    if absent:
        print(f"not installed: {', '.join(absent)}; './do packages dev' installs them", file=sys.stderr)
        sys.exit(MISSING_STATUS)
    sys.exit(build(arguments.build.resolve(), arguments.output.resolve(), arguments.source.resolve()))
