# SPDX-License-Identifier: Apache-2.0
"""Checks rules for every file: the licence line, #pragma once, no dead code, no path of one machine, and one
package list. Also that no expression draws twice from a random sequence, because compilers evaluate operands and
arguments in different orders.

    conventions.py SOURCE_DIR      checks the tree, after checking itself on planted violations
"""
import pathlib
import re
import sys
import tempfile

from sources import CODE_SUFFIXES, expect, project_files, read, report

SPDX = "SPDX-License-Identifier: Apache-2.0"
SPDX_SUFFIXES = CODE_SUFFIXES + (".py", ".cmake", ".sh")
PACKAGE_LIST = "packages.txt"
# Folders that exist on one machine only. Assembled, so that this file does not break its own rule.
MACHINE_FOLDERS = ("home", "root", "work", "Users", "workspace", "mnt")
MACHINE_PATH = re.compile(r"(?<![\w.$}~/:*-])/(?:" + "|".join(MACHINE_FOLDERS) +
                          r")(?:/[\w.-]|\b(?![\w/.-]))|\b[A-Z]:\\\\?[Uu]sers")
DEAD_CODE = re.compile(r"^\s*#\s*if\s+0\b")
TO_DO = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X)\b(?!\()")
# A literal package after apt's install; git and its certificates are needed to fetch this list.
APT_INSTALL = re.compile(r"\bapt(?:-get)?\s+(?:-\S+\s+)*install\s+(?:-\S+\s+)*(?!git\b|ca-certificates\b)([a-z][a-z0-9.+-]+)")

# At least one of these is in every text that MACHINE_PATH or APT_INSTALL finds something in.
LINE_WORDS = tuple("/" + folder for folder in MACHINE_FOLDERS) + ("sers", "apt")


# A number drawn from a sequence, or the sequence given to a function that draws.
DRAW = re.compile(r"\brandom\.(?:unit|between|below|bits|next)\(|[(,]\s*random\s*[,)]")


def expressions_of(text):
    """Returns (line, expression) of C++ code: what stands between ; { } and commas outside of parentheses, which are
    ordered; braces inside of parentheses are expressions of their own."""
    found = []
    open_ones = [["", 1, 0]]  # text, line, depth of parentheses; one per brace that is open

    def end(line):
        found.append((open_ones[-1][1], open_ones[-1][0]))
        open_ones[-1][:2] = "", line
    line = 1
    for match in re.finditer(r"//[^\n]*|[(){};,\n]|[^(){};,\n/]+|/", text):
        part, last = match[0], open_ones[-1]
        if part == "\n":
            line += 1
        elif part == ";" or part == "," and last[2] == 0:
            end(line)
        elif part == "{":
            if last[2] == 0:
                end(line)
            open_ones.append(["", line, 0])
        elif part == "}":
            end(line)
            if len(open_ones) > 1:
                open_ones.pop()
        elif not part.startswith("//"):
            last[0] += part
            last[1] = last[1] if last[0].strip() != part.strip() else line
            last[2] += (part == "(") - (part == ")")
    return found


def packages_of(text):
    """Returns the package names of a package list."""
    return [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]


def check_text(path, text, packages):
    """Returns the violations of one file."""
    violations = []
    lines = text.splitlines()
    if path.suffix in SPDX_SUFFIXES or path.name == "CMakeLists.txt":
        head = lines[:2] if lines and lines[0].startswith("#!") else lines[:1]
        if not any(SPDX in line for line in head):
            violations.append(f"{path}:1: the first line must hold '{SPDX}'")
    if path.suffix == ".h" and "#pragma once" not in lines:
        violations.append(f"{path}:1: no #pragma once")
    if path.suffix in CODE_SUFFIXES and path.parts[0] != "tests" and "random" in text:
        for number, expression in expressions_of(text):
            if len(DRAW.findall(expression)) > 1:
                violations.append(f"{path}:{number}: draws twice in one expression; name the first number")
    # Most files, committed results above all, contain no word of the lines' rules; a search for words is fast.
    may_have_lines = path.suffix in SPDX_SUFFIXES or any(word in text for word in LINE_WORDS)
    for number, line in enumerate(lines if may_have_lines else [], 1):
        where = f"{path}:{number}:"
        if path.suffix in CODE_SUFFIXES:
            if DEAD_CODE.search(line):
                violations.append(f"{where} dead code under #if; delete it, git remembers")
        if path.suffix in SPDX_SUFFIXES and TO_DO.search(line):
            violations.append(f"{where} a task without an owner: write it as an issue, or name the owner in brackets")
        match = MACHINE_PATH.search(line)
        if match:
            violations.append(f"{where} '{match[0]}' is a path of one machine")
        match = APT_INSTALL.search(line)
        if match and path.name != PACKAGE_LIST and path.suffix not in CODE_SUFFIXES: # an error may name a remedy
            violations.append(f"{where} installs '{match[1]}'; {PACKAGE_LIST} is the only package list")
    if str(path) != PACKAGE_LIST and path.suffix not in CODE_SUFFIXES:
        named = sorted({p for p in packages if p.endswith("-dev") and p in text and re.search(rf"(?<![\w-]){re.escape(p)}(?![\w-])", text)})
        if len(named) >= 3:
            violations.append(f"{path}:1: names {', '.join(named)}; {PACKAGE_LIST} is the only package list")
    return violations


def check_packages(packages):
    """Returns the violations of the package list itself."""
    violations = [f"{PACKAGE_LIST}: '{p}' stands there twice" for p in sorted({p for p in packages if packages.count(p) > 1})]
    violations += [f"{PACKAGE_LIST}: '{p}' is no package name" for p in packages if not re.fullmatch(r"[a-z0-9][a-z0-9.+-]+", p)]
    return violations


def check(root):
    """Returns the violations of the tree, and the number of files checked."""
    files = project_files(root)
    packages = packages_of(read(root, PACKAGE_LIST))
    violations = check_packages(packages)
    for path in files:
        violations += check_text(path, read(root, path), packages)
    return violations, len(files)


def self_test():
    """Self-test: plants one violation of each kind and clean files, and verifies the result."""
    home, work = "/" + "home", "/" + "work"
    spdx = f"// {SPDX}\n"
    planted = {
        "packages.txt": ("# list\ng++\nliba-dev\nlibb-dev\nlibc-dev\nliba-dev\nBad Name\n", ["twice", "no package name"]),
        "a.h": (spdx + "#pragma once\n// the house/work of a URL: https://example.org" + home + "/x\n", []),
        "b.h": (spdx, ["no #pragma once"]),
        "c.cpp": ("int x;\n", ["first line"]),
        "d.cpp": (spdx + "#if 0\n#endif\n", ["dead code"]),
        "e.cpp": (spdx + "// " + "TO" + "DO later\n// " + "TO" + "DO(someone): named\n", ["task without an owner"]),
        "f.cpp": (spdx + f'const char* path = "{home}/someone/scene.glb";\n', ["path of one machine"]),
        "g.md": (f"Run it in {work}/main.\n", ["path of one machine"]),
        "h.json": ('{"file": "' + "/" + "root" + '/x"}\n', ["path of one machine"]),
        "i.md": ("apt-get " + "install -y cmake\n", ["installs 'cmake'"]),
        "j.md": ("sudo apt install git\nYou need liba-dev and libb-dev.\n", []),
        "k.md": ("liba-dev libb-dev libc-dev\n", ["only package list"]),
        "m.cpp": (spdx + "void f(Random& random) {\n    g(random.unit(), random.unit());\n    h(random) * random.below(3);\n}\n",
                  ["draws twice", "draws twice"]),
        "n.cpp": (spdx + "void f(Random& random) {\n    const double x = random.unit(), y = random.unit(); // random.unit()\n"
                  "    g({random.unit(), random.unit()}, random.between(0.0, 1.0));\n}\n", []),
        "o.cpp": (spdx + "void f(Random& random) {\n    g({random.unit(), 1}, random.unit(),\n      random.between(0.0, 1.0));\n}\n",
                  ["draws twice"]),
        "l.sh": (f'#!/bin/sh\n# {SPDX}\napt-get install -y "$missing"\ncp /usr/share/x ./y /tmp\n', []),
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, (text, _) in planted.items():
            (root / name).write_text(text)
        violations, checked = check(root)
        expect(checked == len(planted), f"{checked} files seen")
        for name, (_, expected) in planted.items():
            found = [v for v in violations if v.startswith(f"{name}:")]
            expect(len(found) == len(expected) and all(e in f for e, f in zip(expected, found)),
                   f"{name}: wanted {expected}, got {found}")


if __name__ == "__main__":
    self_test()
    sys.exit(report("conventions", *check(sys.argv[1])))
