# SPDX-License-Identifier: Apache-2.0
# Sphinx: the site is made of the Markdown files where they stand; the root of the repository is its source. README.md
# is the front page. site_pages.py generates what stands in code. Built by docs/site/build.py.
import os
import pathlib
import re
import sys

here = pathlib.Path(__file__).resolve().parent
root = here.parents[1]
sys.path[:0] = [str(here), str(root / "tools/manual")]

project = "ShadowDAG"
version = re.search(r"project\(ShadowDAG VERSION ([\d.]+)", (root / "CMakeLists.txt").read_text())[1]
copyright = "the ShadowDAG developers"
extensions = ["myst_parser", "breathe", "site_pages"]
exclude_patterns = ["build", "report", "install", ".git", "**/__pycache__", "**.rst", "**.txt"]
source_suffix = {".md": "markdown"}
root_doc = "README"
# A Markdown file that no list contains is an error, as is a link to what does not exist.
contents = {
    "Tutorial": ["docs/tutorial"],
    "Tasks": ["docs/user_guide", "docs/python", "docs/studies", "docs/rays", "workflow/README"],
    "Reference": ["docs/site/options", "docs/site/frame_settings", "docs/site/python_api", "docs/site/cpp_api",
                  "docs/scene_formats", "docs/file_formats", "docs/json_reference", "docs/promises", "docs/limits"],
    "Method": ["docs/method", "hybrid/routing/RESOLUTION", "voxel/LAYOUT", "voxel/BUILDS", "shadowmap/FILTERS",
               "shadowmap/PAGES", "shadowmap/CULLING", "shadowmap/POLYGON_LOD", "scenes/BATCHES", "docs/adjudicator"],
    "Glossary": ["docs/glossary"],
    "Gallery": ["docs/gallery"],
    "Results": ["docs/results", "docs/mutants", "docs/cuda_host"],
    "How to add things": ["docs/developing"],
}

myst_heading_anchors = 6
smartquotes = False  # "--option" and quoted words stay as they are
highlight_language = "text"
nitpicky = True
# Types of other libraries, and C++ names that the chosen headers use and do not declare, have no page here.
nitpick_ignore_regex = [("cpp:.*", ".*"), ("py:.*", r"(os|numpy|np|pandas|matplotlib|typing|pathlib)(\.\w+)+|\w+")]

breathe_projects = {"ShadowDAG": os.environ.get("SHADOWDAG_DOXYGEN", "")}
breathe_default_project = "ShadowDAG"
breathe_default_members = ("members", "undoc-members")
breathe_show_include = False

html_theme = "furo"
html_title = f"ShadowDAG {version}"
html_copy_source = False
html_show_sphinx = False
