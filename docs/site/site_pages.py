# SPDX-License-Identifier: Apache-2.0
"""A Sphinx extension: pages whose content stands in code, and pages of the source files that documents link to.

A page of docs/site has a head in Markdown; what is generated follows it. Generated are the options of the program, the
settings of frames and the Python module, from the build folder that SHADOWDAG_BUILD names.
"""
import ast
import html
import inspect
import json
import os
import pathlib
import re
import sys

from docutils import nodes
from markdown_it import MarkdownIt
from sphinx import addnodes
from sphinx.util.osutil import relative_uri

from help_text import commands_of

TABLE = "| {} | {} | {} |\n"
RULE = TABLE.format("---", "---", "---")
SOURCES = "source/"  # the folder of the pages of source files
LARGEST_OF_FOLDER = 30000  # bytes of a file that has a page because its folder has one
LARGEST_LINKED = 200000  # bytes of a file that a link names; larger ones are downloaded, as results are
PICTURES = (".png", ".svg")  # stay files
LANGUAGES = {".h": "cpp", ".cpp": "cpp", ".cu": "cpp", ".py": "python", ".pyi": "python", ".json": "json",
             ".ipynb": "a notebook", ".txt": "text", ".cmake": "cmake"}


def cell(text):
    """Returns a text as a cell of a Markdown table: literally, without markup."""
    for character in "\\`*_{}[]<>|$":
        text = text.replace(character, "\\" + character)
    return text


def code(text):
    return "`" + text.replace("|", "\\|") + "`" if text else ""


def options_page(build):
    """Returns a section for each subcommand, with a table for each heading of its --help."""
    text = ""
    for command in commands_of(str(build / "tools/shadowdag")):
        text += f"\n## {command.name or 'shadowdag'}\n\n{command.summary}\n\n    {command.usage}\n"
        for heading, options in command.groups:
            text += f"\n### {heading}\n\n" + TABLE.format("option", "value", "what it does") + RULE
            for option in options:
                marks = " (required)" if option.is_required else ""
                text += TABLE.format(", ".join(map(code, option.names)), code(option.value), cell(option.help) + marks)
    return text


def module_of(build):
    """Returns the built Python module."""
    sys.path.insert(0, str(build / "python"))
    import shadowdag
    return shadowdag


def settings_page(build):
    """Returns the table of the settings of frames."""
    text = TABLE.format("key", "default", "what it is") + RULE
    for row in module_of(build).frame_settings():
        text += TABLE.format(code(row["key"]), code(row["default"]), cell(row["help"]))
    return text


def docstring(item):
    """Returns a docstring as Markdown, without the signature that pybind11 puts before it; code stays indented."""
    text = inspect.getdoc(item) or ""
    name = getattr(item, "__name__", "")
    if name and text.startswith(name + "("):
        text = text.partition("\n")[2]
    return text.strip()


def described(kind, signature, text):
    """Returns a directive of the Python domain, with a docstring inside."""
    return f"\n````{{py:{kind}}} {signature}\n{text}\n````\n"


def signature_of(node, skip):
    """Returns name, parameters and result of a function of the stubs, without the first `skip` parameters."""
    positional = node.args.posonlyargs or node.args.args
    del positional[:skip]
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({ast.unparse(node.args)}){returns}"


def class_of(name, item, members):
    """Returns a class with its members, [(kind, signature, docstring)]."""
    inner = "".join(described(kind, signature, text) for kind, signature, text in members)
    return f"\n## {name}\n\n`````{{py:class}} {name}\n{docstring(item)}\n{inner}`````\n"


def members_of(node, item):
    """Returns the members of a class of the stubs or of a source file."""
    members = []
    for member in node.body:
        if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
            text = docstring(getattr(item, member.name))
            if any(ast.unparse(decorator) == "property" for decorator in member.decorator_list):
                members.append(("property", f"{member.name}\n:type: {ast.unparse(member.returns)}\n" if member.returns
                                else member.name, text))
            else:
                members.append(("method", signature_of(member, 1), text))
    return members


def python_page(build):
    """Returns what `import shadowdag` gives: signatures from the stubs and sources, docstrings from the module."""
    module = module_of(build)
    folder = pathlib.Path(module.__file__).parent
    definitions = {}
    for file in [folder / "_native.pyi"] + sorted(folder.glob("*.py")):
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
                definitions.setdefault(node.name, node)
    names = [name for name in module.__all__ if name in definitions]
    classes = [name for name in names if isinstance(definitions[name], ast.ClassDef)]
    errors = [name for name in classes if issubclass(getattr(module, name), Exception)]
    text = "\n```{py:module} shadowdag\n```\n\n## Functions\n"
    text += "".join(described("function", signature_of(definitions[name], 0), docstring(getattr(module, name)))
                    for name in names if name not in classes)
    for name in classes:
        if name not in errors:
            item = getattr(module, name)
            text += class_of(name, item, members_of(definitions[name], item))
    text += "\n## Exceptions\n"
    return text + "".join(described("exception", name, docstring(getattr(module, name))) for name in errors)


GENERATED = {"docs/site/options": options_page, "docs/site/frame_settings": settings_page,
             "docs/site/python_api": python_page}


def label_headers(text):
    """Returns the page of headers with a target before each heading: docstrings that name a file link to it."""
    for file in pathlib.Path(os.environ["SHADOWDAG_DOXYGEN"]).glob("*_8h.xml"):
        name = re.search(r'<location file="([^"]+)"/>\s*</compounddef>', file.read_text())[1]
        text = text.replace(f"\n## {name}\n", f"\n({file.stem})=\n## {name}\n")
    return text


def contents(config):
    """Returns the lists of pages, which the front page carries hidden."""
    form = "\n```{{toctree}}\n:hidden:\n:caption: {}\n\n{}\n```\n"
    return "".join(form.format(caption, "\n".join("/" + page for page in pages))
                   for caption, pages in config.contents.items())


def add_generated(app, page, source):
    """Appends what is generated to the head of a page."""
    if page == app.config.root_doc:
        source[0] += contents(app.config)
    elif page == "docs/site/cpp_api":
        source[0] = label_headers(source[0])
    elif page in GENERATED:
        source[0] += "\n" + GENERATED[page](pathlib.Path(os.environ["SHADOWDAG_BUILD"]))


def link_sources(app, document):
    """Lets links to source files lead to pages of them, instead of downloads, and notes these files."""
    page = app.env.docname
    for node in list(document.findall(addnodes.download_reference)):
        file = (pathlib.Path(app.srcdir) / page).parent.joinpath(node["reftarget"]).resolve()
        if file.suffix not in PICTURES and file.stat().st_size < LARGEST_LINKED:
            replace_by_source(app, page, node, file)
    for node in list(document.findall(addnodes.pending_xref)):
        target = (pathlib.Path(app.srcdir) / page).parent.joinpath(node["reftarget"]).resolve()
        if node.get("reftype") == "myst" and target.is_dir():
            replace_by_source(app, page, node, target)


def replace_by_source(app, page, node, file):
    """Replaces a link of a page by one to the page of a source file or folder."""
    name = str(file.relative_to(app.srcdir))
    children = [child for child in file.glob("*") if child.suffix in LANGUAGES]
    named = [file] + [child for child in children if child.stat().st_size < LARGEST_OF_FOLDER]
    app.env.shadowdag_sources.setdefault(page, set()).update(str(path.relative_to(app.srcdir)) for path in named)
    uri = relative_uri(app.builder.get_target_uri(page), SOURCES + name + ".html")
    node.replace_self(nodes.reference("", "", *node.children, internal=True, refuri=uri))


def notebook(text, highlighter):
    """Returns the cells of a notebook as HTML."""
    cells = ((cell["cell_type"], "".join(cell["source"])) for cell in json.loads(text)["cells"])
    return "".join(highlighter.highlight_block(source, "python") if kind == "code" else MarkdownIt().render(source)
                   for kind, source in cells)


def source_pages(app):
    """Yields the pages of the files and folders that documents link to."""
    names = set().union(*app.env.shadowdag_sources.values())
    for name in sorted(names):
        path = pathlib.Path(app.srcdir) / name
        if path.is_dir():
            rows = [f"<li><code>{html.escape(child.name)}</code></li>" if f"{name}/{child.name}" not in names else
                    f'<li><a href="{path.name}/{child.name}.html"><code>{html.escape(child.name)}</code></a></li>'
                    for child in sorted(path.iterdir()) if child.name != "__pycache__"]
            body = "<ul>" + "\n".join(rows) + "</ul>"
        elif path.suffix == ".ipynb":
            body = notebook(path.read_text(), app.builder.highlighter)
        else:
            language = LANGUAGES.get(path.suffix, "text")
            body = app.builder.highlighter.highlight_block(path.read_text(), language, force=True)
        yield SOURCES + name, {"title": name, "body": f"<h1>{html.escape(name)}</h1>{body}"}, "page.html"


def begin(app):
    if not hasattr(app.env, "shadowdag_sources"):
        app.env.shadowdag_sources = {}


def forget(app, env, page):
    env.shadowdag_sources.pop(page, None)


def setup(app):
    app.add_config_value("contents", {}, "env")
    app.connect("builder-inited", begin)
    app.connect("env-purge-doc", forget)
    app.connect("source-read", add_generated)
    app.connect("doctree-read", link_sources, priority=100)  # before Sphinx collects downloads
    app.connect("html-collect-pages", source_pages)
    return {"parallel_read_safe": False}
