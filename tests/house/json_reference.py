# SPDX-License-Identifier: Apache-2.0
"""Checks docs/json_reference.md: every key of the committed results, and of what small commands write
(json_outputs.py), is in the table of its kind with its type, and every key of a table occurs in one of them.

    json_reference.py SOURCE_DIR              checks the committed results, after checking itself on planted pages
    json_reference.py SOURCE_DIR PROGRAM      runs commands as well, and checks that no table has a key too many
"""
import fnmatch
import json
import pathlib
import re
import sys

from sources import expect, report

PAGE = "docs/json_reference.md"
RESULTS = "tests/bench/results"
SETTINGS = "tools/settings/settings_table.cpp"
FRAME_SETTINGS = "site/frame_settings.md"  # a link to it stands for the settings of frames
# Keys that neither a committed result nor a command on any machine has, by table.
UNSEEN = {
    "needs OpenGL (--backend gl)": {
        "provenance": ["left_out"],
        "study failures": ["left_out[].failure", "left_out[].method", "left_out[].why"]},
    "needs a device (--backend cuda)": {
        "bench": ["backend", "traced_bytes", "nanovdb_difference_count"]},
    "needs a build with assertions (study mutants)": {
        "messages": ["fault_count", "noticed_count"]},
    "an error of maps without a name is a defect": {
        "study real": ["cells[].unnamed[].face_texels"]},
}
# Keys that depend on times: they may occur or not.
UNCERTAIN = {
    "a row by oracle that is slower than another one": {
        "run": ["shown_as.label", "shown_as.model", "shown_as.why"]},
    "a frame that one threshold serves faster than the cheaper method of each map": {
        "costs": ["costs[].whole_frame"]},
}

TABLE_ROW = re.compile(r"^\|(.+)\|$", re.MULTILINE)
HEADING = re.compile(r"##+ (.+)")
LINK = re.compile(r"\[[^]]+\]\(([^)]+)\)")
CODE = re.compile(r"`([^`]+)`")
# A setting of a frame: its key in experiments, and its name among the parameters of a run.
SETTING = re.compile(r'\.key = "(\w+)"(?:(?!\.key).)*?\.parameter = "(\w+)"', re.DOTALL)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def is_integer(value):
    return isinstance(value, int) and not isinstance(value, bool)


def is_count(value):
    return is_integer(value) and value >= 0


# The words of the second column, as tests of a value. An object is tested by its keys.
TYPES = {"any": lambda value: True, "object": lambda value: False, "null": lambda value: value is None,
         "boolean": lambda value: isinstance(value, bool), "text": lambda value: isinstance(value, str),
         "integer": is_integer, "count": is_count, "bytes": is_count,
         "share": lambda value: is_number(value) and 0 <= value <= 1,
         "number": is_number, "ms": is_number, "s": is_number, "ns": is_number}
ENDS = {"interval": ("_low", "_high", "_confidence"), "range": ("_min", "_max")}


class Node:
    """What a table says of a value: its types, keys and items, and the tables that describe it as well."""

    def __init__(self):
        self.keys, self.item = {}, None
        self.types, self.item_types, self.tables = set(), set(), []
        self.is_open = False  # what it contains is described elsewhere
        self.path = ""  # of a row's key
        self.is_seen = False

    def at(self, path):
        """Returns the node of a path below this one, as 'a.b[].c'."""
        node = self
        for part in path.split("."):
            node = node.keys.setdefault(part.rstrip("[]"), Node())
            for _ in range(part.count("[]")):
                node.item = node.item or Node()
                node = node.item
        return node

    def below(self):
        """Returns the nodes of all keys and items."""
        for child in [*self.keys.values(), *([self.item] if self.item else [])]:
            yield child
            yield from child.below()

    def set_type(self, text, table):
        """Adds the type that the second column states. Returns what is wrong with it, "" for nothing."""
        words, *more = [word.strip() for word in text.split(",")]
        is_list = words.startswith("list of ")
        for word in words.removeprefix("list of ").split(" or "):
            link = LINK.fullmatch(word)
            target = self
            if is_list and link:
                target = self.item = self.item or Node()
            if link and link[1].startswith("#"):
                target.tables.append(link[1][1:])
            elif link:
                target.is_open = True
            elif word in TYPES:
                (self.item_types if is_list else self.types).add(word)
                self.is_open |= word == "any"
            else:
                return f"'{word}' is no type"
        for word in more:
            if word not in ENDS:
                return f"'{word}' is no type"
            for end in ENDS[word]:
                beside = table.at(self.path + end)
                beside.path, beside.types = self.path + end, {"number", "null"}
        return ""


def other_than(value, types):
    return f"{json.dumps(value)[:40]}, not {' or '.join(sorted(types - {'object'})) or 'an object or a list'}"


def expand(text):
    """Returns the keys that a text with braces stands for."""
    found = re.search(r"\{([^{}]*)\}", text)
    if not found:
        return [text]
    head, tail = text[:found.start()], text[found.end():]
    return [key for choice in found[1].split(",") for key in expand(head + choice + tail)]


def read_table(rows, frame_settings):
    """Returns the root of a table, and what is wrong with its rows."""
    root, wrong = Node(), []
    above = []  # the objects that rows with a leading dot continue
    for keys, types, meaning in rows:
        link = LINK.search(keys)
        if link and link[1] == FRAME_SETTINGS:
            for name in frame_settings:
                root.keys.setdefault(name, Node()).is_open = True
        elif link:
            root.tables.append(link[1].removeprefix("#"))
        if link:
            continue
        groups = [[before + key for key in expand(text) for before in (above if key.startswith(".") else [""])]
                  for text in CODE.findall(keys)]
        types = [part.strip() for part in types.split(";")]
        if not groups or not groups[0] or len(types) not in (1, len(groups)) or not meaning:
            wrong.append(f"row {keys} needs keys, a meaning, and one type or one for each key")
            continue
        if not CODE.search(keys)[1].startswith("."):
            above = groups[0]
        for group, text in zip(groups, types if len(types) > 1 else types * len(groups)):
            for path in group:
                node = root.at(path)
                node.path = path
                problem = node.set_type(text, root)
                wrong += [f"`{path}`: {problem}"] if problem else []
    return root, wrong


class Page:
    """The tables by the anchors of their headings, and what the first table, which has none, says of files."""

    def __init__(self, text, frame_settings):
        self.tables, self.names = {}, {}
        self.patterns = []  # (name of committed results, anchors of their tables: none if another page has them)
        self.kinds = []  # anchors
        self.violations = []
        for section in re.split(r"^(?=##+ )", text, flags=re.MULTILINE):
            rows = [[cell.strip() for cell in row.split("|")] for row in TABLE_ROW.findall(section)][2:]
            heading = HEADING.match(section)
            if heading and rows:
                self.add_table(heading[1], rows, frame_settings)
            elif not heading:
                for _, _, described, examples in rows:
                    anchors = [target[1:] for target in LINK.findall(described) if target.startswith("#")]
                    self.patterns += [(pattern, anchors) for pattern in CODE.findall(examples)]
                    self.kinds += anchors
        named = {name for root in self.tables.values() for node in (root, *root.below()) for name in node.tables}
        named |= set(self.kinds)
        self.violations += [f"{PAGE}: a row names the table '{name}', which is not there"
                            for name in sorted(named - set(self.tables))]
        self.violations += [f"{PAGE}: no row names the table '{name}'" for name in sorted(set(self.tables) - named)]

    def add_table(self, name, rows, frame_settings):
        anchor = re.sub(r"[^\w\- ]", "", name.lower()).replace(" ", "-")
        wrong = [f"{row[0]} has not three columns" for row in rows if len(row) != 3]
        if anchor in self.tables:
            wrong.append("it is there twice")
        if not wrong:
            self.names[anchor] = name
            self.tables[anchor], wrong = read_table(rows, frame_settings)
        self.violations += [f"{PAGE}, table '{name}': {problem}" for problem in wrong]

    def with_tables(self, nodes):
        """Returns nodes and the tables that describe them as well."""
        found, todo = [], list(nodes)
        while todo:
            node = todo.pop()
            if node not in found:
                found.append(node)
                todo += [self.tables[name] for name in node.tables if name in self.tables]
        return found

    def check(self, value, kind, file):
        """Marks the keys of a value as seen. Returns those that the tables lack or describe otherwise."""
        problems = {}  # by path, each once
        self.visit(value, [self.tables[kind]], "", problems)
        return [f"{file}: key '{path}' of the table '{self.names[kind]}' in {PAGE} {problem}"
                for path, problem in problems.items()]

    def visit(self, value, nodes, path, problems):
        nodes = self.with_tables(nodes)
        for node in nodes:
            node.is_seen = True
        if any(node.is_open for node in nodes):
            return
        types = set().union(*(node.types for node in nodes))
        if isinstance(value, dict):
            if not any(node.keys for node in nodes):
                problems.setdefault(path, "is an object in this file")
                return
            for key, inner in value.items():
                below = ([node.keys[key] for node in nodes if key in node.keys]
                         or [node.keys["*"] for node in nodes if "*" in node.keys])
                inner_path = f"{path}.{key}".lstrip(".")
                if below:
                    self.visit(inner, below, inner_path, problems)
                else:
                    problems.setdefault(inner_path, "is not listed")
        elif isinstance(value, list):
            items = [node.item for node in nodes if node.item]
            types = set().union(*(node.item_types for node in nodes))
            if not items and not types:
                problems.setdefault(path, "is a list in this file")
            for inner in value:
                if items and isinstance(inner, (dict, list)):
                    self.visit(inner, items, path + "[]", problems)
                elif not any(TYPES[word](inner) for word in types):
                    problems.setdefault(path, f"has an item that is {other_than(inner, types)}")
        elif not any(TYPES[word](value) for word in types):
            problems.setdefault(path, f"is {other_than(value, types)}")

    def unseen(self, exceptions, uncertain):
        """Returns the keys of tables that occurred nowhere, and the exceptions that occurred or are not listed."""
        def keys_of(reasons, name):
            return {key for tables in reasons.values() for key in tables.get(name, [])}
        violations = []
        for anchor, root in self.tables.items():
            name = self.names[anchor]
            unseen = {node.path for node in root.below() if node.path and not node.is_seen}
            allowed = keys_of(exceptions, name)
            violations += [f"{PAGE}: key '{key}' of the table '{name}' occurs in no committed result and no output"
                           for key in sorted(unseen - allowed - keys_of(uncertain, name))]
            violations += [f"{PAGE}: key '{key}' of the table '{name}' is excepted from this check, and occurs or is "
                           "not listed" for key in sorted(allowed - unseen)]
        return violations


def check_committed(page, folder):
    """Checks the committed results. Returns the violations and the number of files."""
    violations, files = [], sorted(folder.glob("*.json"))
    for pattern, _ in page.patterns:
        if not any(fnmatch.fnmatch(file.stem, pattern) for file in files):
            violations.append(f"{PAGE}: no committed result is named {pattern}")
    for file in files:
        kinds = [anchors for pattern, anchors in page.patterns if fnmatch.fnmatch(file.stem, pattern)]
        if len(kinds) != 1:
            violations.append(f"{file.name}: the first table of {PAGE} names it {len(kinds)} times; it must once")
        elif kinds[0]:
            violations += page.check(json.loads(file.read_text()), kinds[0][0], file.name)
    return violations, len(files)


def check_outputs(page, outputs):
    """Checks (command, table, value) of commands, then that every key was seen. Returns the violations, and the number
    of outputs."""
    violations, kinds = [], []
    for command, kind, value in outputs:
        violations += page.check(value, kind, command)
        kinds.append(kind)
    seen = set(kinds).union(*(anchors for _, anchors in page.patterns))
    violations += [f"{PAGE}: no committed result and no output has the table '{page.names[kind]}'"
                   for kind in page.kinds if kind in page.names and kind not in seen]
    return violations + page.unseen(UNSEEN, UNCERTAIN), len(kinds)


def self_test():
    """Self-test: plants a page, results, and one violation of each kind."""
    first = ("| by | file | table | examples |\n|---|---|---|---|\n| `run` | f | [run](#run) | `a*` |\n"
             "| `x` | f | [p](p.md) | `other` |\n")
    head = "| key | type | meaning |\n|---|---|---|\n"
    run = ("## run\n" + head + "| `n_count`, `name` | count; text or null | x |\n| [more](#more) | | x |\n"
           "| `of.*` | ms | x |\n| `rows[]` | object | x |\n| `.{a,b}` | list of ms | x |\n"
           "| `t_ms` | ms, interval | x |\n| `file` | [study](s.md) | x |\n")
    more = ("### more\n" + head + "| `gone`, `self` | text; [run](#run) | x |\n"
            "| [settings](site/frame_settings.md) | | x |\n")

    def plant(text):
        return Page(text, {"taps"})
    right = {"n_count": 1, "name": None, "of": {"x y": 1.5}, "rows": [{"a": [1], "b": []}], "t_ms": 1, "t_ms_low": 1,
             "file": {"any": [{}]}, "self": {"name": "x", "gone": ""}, "taps": [4]}
    page = plant(first + run + more)
    found = page.violations + page.check(right, "run", "a.json")
    expect(not found and page.patterns == [("a*", ["run"]), ("other", [])], f"a right page: {found}, {page.patterns}")
    found = page.unseen({}, {"why": {"run": ["name"]}})
    expect([v.split("'")[1] for v in found] == ["t_ms_confidence", "t_ms_high"], f"unseen {found}")
    found = page.unseen({"why": {"run": ["t_ms_high", "name"]}}, {"why": {"run": ["t_ms_confidence"]}})
    expect(len(found) == 1 and "'name'" in found[0], f"exceptions {found}")
    for change, path in (({"new": 1}, "new"), ({"n_count": -1}, "n_count"), ({"name": 2}, "name"),
                         ({"of": {"x": "1"}}, "of.x"), ({"rows": [{"c": 1}]}, "rows[].c"),
                         ({"self": {"new": 1}}, "self.new"), ({"rows": [{"a": [""]}]}, "rows[].a"),
                         ({"n_count": {}}, "n_count"), ({"name": []}, "name")):
        found = page.check(right | change, "run", "a.json")
        expect(len(found) == 1 and found[0].startswith(f"a.json: key '{path}' of the table 'run'"),
               f"{change}: {found}")
    for text, part in ((run.replace("count;", "cuont;") + more, "'cuont'"), (run + run + more, "twice"),
                       (run.replace("; text", "; text; text") + more, "one type"), (run, "'more', which is not there"),
                       (run + more + more.replace("more", "less"), "no row names the table 'less'")):
        found = plant(first + text).violations
        expect(any(part in violation for violation in found), f"wanted {part}, got {found}")
    expect(expand("{,a_}{x,y}.*") == ["x.*", "y.*", "a_x.*", "a_y.*"], f"braces {expand('{,a_}{x,y}.*')}")


def main(source, program=None):
    settings = SETTING.findall((source / SETTINGS).read_text())
    expect(len(settings) > 10, f"only {len(settings)} settings of frames were found in {SETTINGS}")
    page = Page((source / PAGE).read_text(), {name for pair in settings for name in pair})
    if page.violations:
        return report("JSON reference", page.violations, 1)
    violations, count = check_committed(page, source / RESULTS)
    if program:
        from json_outputs import outputs_of
        found, more = check_outputs(page, outputs_of(program))
        violations, count = violations + found, count + more
    return report("JSON reference", violations, count)


if __name__ == "__main__":
    self_test()
    sys.exit(main(*(pathlib.Path(argument).resolve() for argument in sys.argv[1:])))
