# SPDX-License-Identifier: Apache-2.0
"""Verifies that every file includes what it needs to compile by itself, as it must where files are not compiled together.

    reachable.py SOURCE_DIR      checks the tree, after checking itself on planted violations

A name that one header of the project declares outside of classes (a type, a constant, a function), and no other, may be used only by files
whose includes lead to that header. Names that a file declares itself, names behind `.`, `->` and `::`, and libraries' names are not checked.
"""
import functools
import pathlib
import re
import sys
import tempfile

from include_order import MAY_INCLUDE
from sources import code_files, expect, read, report

STAND_INS = "tests/cuda/host/include/"  # for headers of CUDA
INCLUDE = re.compile(r'^#include ["<]([^">]+)[">]', re.MULTILINE)
# Declarations outside of classes begin in the first column.
TYPE = re.compile(r"^(?:struct|class|enum class|union)\s+(?:alignas\([^)]*\)\s*)?([A-Z]\w+)\b(?!\s*[;<])|^using\s+([A-Z]\w+)\s*=", re.MULTILINE)
CONSTANT = re.compile(r"^(?:inline |static |SDAG_\w+ )*constexpr\b[^;]*;", re.MULTILINE)
FUNCTION = re.compile(r"^(?:[A-Za-z_][\w:<>,&*\s]*?[\s&*])([a-z]\w{3,})\(", re.MULTILINE)
FORWARD = re.compile(r"^\s*(?:struct|class|enum class|union)\s+(\w+)\s*(?::[^;{]*)?;", re.MULTILINE)
SUITE = re.compile(r"\b(?:TEST|TEST_F|TEST_P|INSTANTIATE_TEST_SUITE_P|BENCHMARK)\([^)]*\)")
MEMBER = re.compile(r"^[ \t]+(?:[A-Za-z_][\w:<>,&*\s]*?[\s&*])([a-z]\w{3,})\(", re.MULTILINE)
INNER_TYPE = re.compile(r"^[ \t]+(?:using\s+([A-Z]\w*)\s*=|(?:struct|class|enum class|union)\s+([A-Z]\w*)\b)", re.MULTILINE)
KEYWORDS = {"alignas", "decltype", "sizeof", "static_assert", "return"}
NAMED = re.compile(r"\b(k[A-Z]\w*)\s*(?:\[[^\]]*\]\s*)*(?:=|\{)")
STRIPPED = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.DOTALL)


def code_of(text):
    """Returns the text without comments and the content of literals; includes stay."""
    kept = "\n".join(line if line.startswith("#include") else "" for line in text.splitlines())
    return kept + "\n" + SUITE.sub("", STRIPPED.sub(lambda match: '""' if match[0][0] in "\"'" else " ", text))


def declared(code):
    """Returns the names that a header declares outside of classes."""
    names = {name for match in TYPE.finditer(code) for name in match.groups() if name}
    names.update(name for match in CONSTANT.finditer(code) for name in NAMED.findall(match[0]))
    names.update(FUNCTION.findall(code))
    return names - KEYWORDS


def declares_itself(code, name):
    """Returns whether a file has a declaration of its own of such a name: a variable, a parameter, a forward declaration, a macro."""
    if name[0].isupper():
        return re.search(rf"\b(?:struct|class|enum class|union|typename|class|using|enum)(?:\.\.\.)?\s+{name}\b", code) is not None
    if re.match(r"k[A-Z]", name):
        return re.search(rf"\b{name}\s*(?:\[[^\]]*\]\s*)*(?:=|\{{)|\b{name},|\b{name}\n", code) is not None
    return re.search(rf"(?:[\w>&*\]]\s+|[&*]|#define )(?<!return )(?<!else ){name}\b\s*(?:\(|=|;|,|\)|\{{|:)", code) is not None


def violations(root):
    files = {path.as_posix(): code_of(read(root, path)) for path in code_files(root)}
    # By the path from the root, or from the file's own folder.
    includes = {name: {path for inner in INCLUDE.findall(code)
                       for path in (inner, f"{name.rpartition('/')[0]}/{inner}", STAND_INS + inner) if path in files}
                for name, code in files.items()}
    forward = {name: set(FORWARD.findall(code)) for name, code in files.items()}

    @functools.cache
    def reached(name):
        seen, left = set(), [name]
        while left:
            at = left.pop()
            if at not in seen:
                seen.add(at)
                left += includes[at]
        return seen

    headers, members = {}, set()
    for name, code in files.items():
        if name.endswith(".h"):
            for declaration in declared(code):
                headers.setdefault(declaration, set()).add(name)
            members.update(MEMBER.findall(code))
            members.update(inner for match in INNER_TYPE.finditer(code) for inner in match.groups() if inner)
    single = {declaration: next(iter(of)) for declaration, of in headers.items() if len(of) == 1 and declaration not in members}
    found = []
    for name, code in files.items():
        used = set(re.findall(r"(?<![\w.:>])[A-Za-z_]\w+", code))
        called = set(re.findall(r"(?<![\w.:>])([a-z]\w+)\(", code))
        folders = MAY_INCLUDE.get(name.partition("/")[0], ())
        for declaration in sorted(used & single.keys()):
            header = single[declaration]
            is_function = re.match(r"(?!k[A-Z])[a-z]", declaration) is not None
            if header in reached(name) or header.partition("/")[0] not in folders or header.startswith(STAND_INS):
                continue
            if is_function and declaration not in called:
                continue
            if not declares_itself(code, declaration) and all(declaration not in forward[path] for path in reached(name)):
                found.append(f"{name}: uses {declaration} of {header}, to which its includes do not lead")
    return found, len(files)


def self_test():
    planted = {
        "voxel/size.h": "constexpr int kSize = 4,\n              kOther = 2;\nstruct Grid {\n    int size;\n};\nint gridSize(const Grid& grid);\n",
        "voxel/direct.cpp": '#include "voxel/size.h"\nint a = kSize + gridSize(Grid{});\n',
        "voxel/through.h": '#include "voxel/size.h"\n',
        "voxel/through.cpp": '#include "voxel/through.h"\nint a = kOther;\n',
        "voxel/constant.cpp": "int a = kOther;\n",
        "voxel/type.cpp": "// of Grid\nGrid* grid;\n",
        "voxel/function.cpp": "int b = gridSize({});\n",
        "voxel/own.cpp": 'constexpr int kSize = 3;\nstruct Grid;\nint a = kSize; // "gridSize(" is a text\nGrid* grid = list.gridSize(2);\n',
        "shadowmap/other.cpp": "int a = kOther;\n"}  # may not include voxel's headers: another name
    with tempfile.TemporaryDirectory() as folder:
        for name, text in planted.items():
            path = pathlib.Path(folder, name)
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        found, _ = violations(pathlib.Path(folder))
    expected = ["voxel/constant.cpp: uses kOther ", "voxel/function.cpp: uses gridSize ", "voxel/type.cpp: uses Grid "]
    expect(len(found) == len(expected) and all(line.startswith(start) for line, start in zip(sorted(found), expected)), f"found {found}")


def main(root):
    self_test()
    found, count = violations(pathlib.Path(root))
    return report("reachable names", found, count)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
