# SPDX-License-Identifier: Apache-2.0
"""Checks that shaders and C++ share their texts: a constant or a function that both need is in a leaf header
(gl/leaf.h), or reaches the shader as a definition that the program prints (glslConstant of gl/program.h). No text for shaders writes a component of a vector by an index: NVIDIA's compiler fails on it.

    shared_texts.py SOURCE_DIR      checks the tree, after checking itself on planted violations
"""
import pathlib
import re
import sys
import tempfile

from sources import CODE_SUFFIXES, expect, project_files, read, report

SHADER_SUFFIXES = (".glsl", ".comp", ".vert", ".frag")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
STRING = re.compile(r'"(?:\\.|[^"\\\n])*"')
# A number that is more than a small count or a half: it has an exponent, a fraction beside .0 and .5, or four digits.
NUMBER = re.compile(r"(?<![\w.])(?:0[xX][0-9a-fA-F]+|\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)(?:[uUfF]|[lL][fF])?(?![\w.])")
PLAIN = re.compile(r"\d{1,3}|\d{1,3}\.[05]?|0[xX][fF]{2,4}|\.5")
NAME = re.compile(r"\bk[A-Z]\w*")
SHADER_CONSTANT = re.compile(r"\b(k[A-Z]\w*)\s*=\s*([^,;]+)")
VECTOR = re.compile(r"\b[diu]?vec[234] (\w+(?:\s*,\s*\w+)*)\s*[=;)]")
FUNCTION = re.compile(r"^(?:SDAG_LEAF |SDAG_HD |inline |static |constexpr |template <[^>]*> )*"
                      r"(?:glm::)?[A-Za-z_]\w*(?:::\w+)?[&*]? (\w+)\([^;{]*\)\s*(?:const\s*)?\{", re.M)
# The same on both sides of a buffer, not a copy: shaders read what C++ keeps in views, textures or other structs.
OWN_OF_SHADERS = {
    "main",
    # Access to buffers that C++ hides in views.
    "vertexWorld", "pageTableIndex", "faceLayer", "voxelFromWorld",
    # Traversals and loops over those buffers: any order gives the same bits, which the shaders' parity tests verify.
    "occluded", "occludedInLeaf", "childHits", "childCorner", "shadowSegment", "lookupVisibility", "truthPairRay",
    "blocksTruthRay", "isDarkByRays", "isDarkByMovers", "mayShadow", "nearDepth", "lightFromWorld", "windowFromWorld",
    "isCut", "isOpaque", "isOpaqueOnFace", "rayEnd",
    # The CPU's arithmetic, which GLSL has to reproduce.
    "fusedMultiplyAdd", "quotient", "dotInOrder", "crossInOrder",
}


def code_of(text):
    """Returns a text without comments and strings."""
    return STRING.sub('""', COMMENT.sub("", text))


def functions_of(code):
    """Returns the names of the functions that a text defines."""
    return {match[1] for match in FUNCTION.finditer(code)} - {"if", "for", "while", "switch", "return"}


def is_leaf(path):
    return path.name.endswith("_leaf.h")


def written_by_index(path, text):
    """Returns the violations of a text in which a component of a vector is written by an index."""
    violations, vectors = [], set()
    for number, line in enumerate(COMMENT.sub(lambda m: "\n" * m[0].count("\n"), text).splitlines(), 1):
        for names in VECTOR.findall(line):
            vectors.update(re.split(r"\s*,\s*", names))
        for name in re.findall(r"(\w+)\[(?!\d+u?\])[^\]]+\]\s*[-+*/]?=(?!=)", line):
            if name in vectors:
                violations.append(f"{path}:{number}: {name} is a vector, and a component is written by an index; write the components")
    return violations


def check_shader(path, text, cpp_names, cpp_functions):
    """Returns the violations of one shader. @param cpp_names constants of C++ @param cpp_functions name -> header"""
    violations = []
    for number, line in enumerate(COMMENT.sub(lambda m: "\n" * m[0].count("\n"), text).splitlines(), 1):
        where = f"{path}:{number}:"
        if line.startswith("#"):
            continue
        for match in NUMBER.finditer(line):
            digits = re.sub(r"(?i)(?<!x)(lf|u|f)$" if not match[0].lower().startswith("0x") else r"[uU]$", "", match[0])
            if not PLAIN.fullmatch(digits):
                violations.append(f"{where} the number {match[0]}; name it in a leaf header, or let C++ define it")
        for name, value in SHADER_CONSTANT.findall(line):
            if "const" in line and re.fullmatch(r"[-\d.xXa-fA-FuU]+(LF)?", value.strip()) and name in cpp_names:
                violations.append(f"{where} {name} stands in C++ as well; use a leaf header or a definition")
    for name in sorted(functions_of(code_of(text)) - OWN_OF_SHADERS):
        if name in cpp_functions:
            violations.append(f"{path}:1: {name}() stands in {cpp_functions[name]} as well; make it a leaf text")
    return violations


def check(root):
    """Returns the violations of the tree, and the number of shaders and leaf headers checked."""
    files = project_files(root)
    shaders = [path for path in files if path.suffix in SHADER_SUFFIXES]
    leaves = [path for path in files if is_leaf(path)]
    functions = {}
    names = set()
    for path in files:
        if path.suffix in CODE_SUFFIXES and path.parts[0] not in ("tests", "tools"):
            code = code_of(read(root, path))
            names.update(NAME.findall(code))
            if path.suffix == ".h":
                functions.update({name: path for name in functions_of(code)})
    violations = []
    if (pathlib.Path(root) / "gl").is_dir():
        known = set().union(*(functions_of(code_of(read(root, path))) for path in shaders), {"main"})
        violations += [f"tests/house/shared_texts.py: no shader has {name}() any more" for name in sorted(OWN_OF_SHADERS - known)]
    for path in shaders:
        violations += check_shader(path, read(root, path), names, functions)
    for path in shaders + leaves:
        violations += written_by_index(path, read(root, path))
    defined = {}
    for path in leaves:
        text = read(root, path)
        for other in files:
            if other.name == "CMakeLists.txt" and path.name in read(root, other):
                break
        else:
            violations.append(f"{path}:1: no CMakeLists.txt embeds this leaf header for shaders")
        for name, value in re.findall(r"\bSDAG_CONST \w+ (k[A-Z]\w*) = ([^,;]+)", code_of(text)):
            defined[name] = path
    # A leaf header's constant has no second definition.
    for path in files:
        if path.suffix in CODE_SUFFIXES + SHADER_SUFFIXES and path.parts[0] not in ("tests", "tools"):
            for name in re.findall(r"\b(?:constexpr|const) (?:\w+ )+(k[A-Z]\w*)\s*=", code_of(read(root, path))):
                if name in defined:
                    violations.append(f"{path}:1: {name} is defined in {defined[name]}")
    return violations, len(shaders) + len(leaves)


def self_test():
    """Self-test: plants one violation of each kind and clean files, and verifies the result."""
    planted = {
        "CMakeLists.txt": ("sdag_embed_glsl(a glsl a_leaf.h c.comp)\n", []),
        "a.h": ("constexpr float kOwn = 7.0f;\ninline float weigh(float x) {\n    return x;\n}\n"
                "inline uint32_t faceOf(const glm::vec3& d) {\n    return 0;\n}\n", []),
        "a_leaf.h": ("SDAG_CONST float kTiny = 1e-4f;\nSDAG_LEAF uint both(SDAG_IN(vec3) d) {\n    return 1u;\n}\n", []),
        "b_leaf.h": ("SDAG_CONST float kLost = 1.0f;\n", ["no CMakeLists.txt"]),
        "c.comp": ("layout(local_size_x = 64) in; // 1e-9\nuint own(vec3 d) {\n    return 0xffu & uint(0.5 * d.x + 2.0LF);\n}\n", []),
        "d.glsl": ("float margin(float s) { return s * 9.5367431640625e-7; }\n", ["number 9.5367431640625e-7"]),
        "e.vert": ("const float kOwn = 7.0;\n", ["kOwn stands in C++"]),
        "f.frag": ("uint faceOf(vec3 d) {\n    return 0u;\n}\n", ["faceOf() stands in a.h"]),
        "g.glsl": ("uint both(vec3 d) {\n    return 1u;\n}\n", ["both() stands in a_leaf.h"]),
        "h.cpp": ("constexpr float kTiny = 1e-4f;\n", ["kTiny is defined in a_leaf.h"]),
        "i.glsl": ("const uint kNothing = 0xffffffffu;\nfloat f() { return 0.99; }\n", ["number 0xffffffffu", "number 0.99"]),
        "j.frag": ("void main() {\n    dvec3 p[3];\n    vec3 w = vec3(1.0);\n    for (int i = 0; i < 3; ++i) {\n        p[i] = q;\n"
                   "        w[i] = 2.0;\n        w[0] += w[i];\n    }\n}\n", ["j.frag:6: w is a vector"]),
        "k.glsl": ("struct Slabs {\n    vec3 inv, cNear;\n};\nvoid set(inout Slabs r) {\n    r.cNear[2 + 0 * a] = 1.0;\n}\n",
                   ["k.glsl:5: cNear is a vector"]),
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, (text, _) in planted.items():
            (root / name).write_text(text)
        violations, checked = check(root)
        expect(checked == 10, f"{checked} files seen")
        for name, (_, expected) in planted.items():
            found = [v for v in violations if v.startswith(f"{name}:")]
            expect(len(found) == len(expected) and all(e in f for e, f in zip(expected, found)),
                   f"{name}: wanted {expected}, got {found}")


if __name__ == "__main__":
    self_test()
    sys.exit(report("shared texts", *check(sys.argv[1])))
