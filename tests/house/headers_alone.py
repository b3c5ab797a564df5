# SPDX-License-Identifier: Apache-2.0
"""Compiles every header alone: each includes what it uses.

    headers_alone.py SOURCE_DIR FOLDER [--built | --without-own] [--cuda-include DIR] [--without FOLDER] -- COMPILER [FLAG...]

A header that another one includes before anything else is compiled alone there: nothing stands before it. So only the
others are given to the compiler. With --built, the build also compiles sources one by one, and a header that its own
x.cpp includes first is proven there; --without-own leaves the same headers to other builds, unless
SDAG_ALL_HEADERS is 1 in the environment, as `./do check` sets it. Headers that include the CUDA runtime are skipped, by name, if no toolkit is
given, and so are those of the folder of --without, whose library is missing.

A header that includes all headers of one of BASES, directly or not, is compiled behind them, precompiled: what it includes
anyway does not help it. A compiler cache would read each header twice. FOLDER: for what is written meanwhile.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from sources import code_files, expect, read, report

# Read once rather than hundreds of times: sets of headers, those that take the longest first. Loading what is precompiled takes
# a second per 150 MB, so that larger sets gain nothing.
PYBIND, JSON = "pybind11/pybind11.h", "nlohmann/json.hpp"
BASES = ((PYBIND,), ("tools/workspace/cost_file.h",), ("hybrid/rays/shadow_rays.h", JSON), ("scenes/scene.h", JSON), (JSON,),
         ("gtest/gtest.h",), ("hybrid/rays/shadow_rays.h",), ("scenes/batches.h",), ("scenes/scene.h",),
         ("glm/glm.hpp", "string", "vector"), ("glm/glm.hpp",), ("string", "vector", "functional"), ("string", "vector"), ("string",),
         ("vector",))


def needs_cuda(root, header):
    """Returns whether a header includes the CUDA runtime directly, outside of any condition on the compiler."""
    return "#include <cuda_runtime" in read(root, header)


def first_include(root, path):
    """Returns the header of the project that a file includes before any other code or directive, or None."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", read(root, path), flags=re.DOTALL)
    found = re.match(r'\s*(?:#pragma once\s+)?#include "([^"]+)"', text)
    return pathlib.Path(found.group(1)) if found else None


def includes(root, path):
    """Returns what a file includes under no condition."""
    depth, names = 0, []
    for line in read(root, path).splitlines():
        directive = re.match(r'\s*#\s*(if|endif|include)\w*\s*(?:["<]([^">]+)[">])?', line)
        if directive:
            depth += {"if": 1, "endif": -1}.get(directive[1], 0)
            if directive[1] == "include" and depth == 0:
                names.append(directive[2])
    return names


def all_included(root, headers):
    """Returns for each header by name the names of what it includes, directly or not."""
    result = {}

    def visit(name):
        if name not in result:
            result[name] = set()
            for other in includes(root, name):
                result[name] |= {other} | (visit(other) if other in names else set())
        return result[name]
    names = {str(header) for header in headers}
    return {name: visit(name) for name in names}


def choose(root, headers, built, bases):
    """Returns those of `headers` that prove all, each with the base before it or (): what a chosen one, or one of
    `built`, includes first, and what that does, has nothing before it but a base that it includes, too."""
    included = all_included(root, headers + built)
    chosen, proven = [], set()
    for header in built + sorted(headers, key=lambda h: (-len(included[str(h)]), h)):
        if header in proven:
            continue
        base = ()
        if header not in built:
            base = next((base for base in bases if included[str(header)].issuperset(base)), ())
            chosen.append((header, base))
        while str(header) in included and header not in proven and included[str(header)].issuperset(base):
            proven.add(header)
            header = first_include(root, header)
    return chosen


def proven_by_build(root, header):
    """Returns whether the header's own source includes it first."""
    source = header.with_suffix(".cpp")
    return (pathlib.Path(root) / source).is_file() and first_include(root, source) == header


def compile_alone(root, headers, command, folder):
    """Returns the compiler's message about a source with only these includes, or an empty string."""
    stem = str(headers[-1]).replace("/", "_")
    source = pathlib.Path(folder) / f"{stem}.cpp"
    source.write_text("".join(f'#include "{header}"\n' for header in headers))
    result = subprocess.run([*command, "-I", str(root), "-fsyntax-only", str(source)],
                            capture_output=True, text=True, cwd=root)
    lines = (result.stdout + result.stderr).strip().splitlines()
    return "\n".join(lines[:8]) if result.returncode else ""


def precompile(root, base, command, folder):
    """Returns the name of a header that includes a base and is precompiled, if that succeeds."""
    header = pathlib.Path(folder) / ("base_" + "_and_".join(base).replace("/", "_"))
    header.write_text("".join(f'#include "{name}"\n' for name in base))
    subprocess.run([*command, "-I", str(root), "-x", "c++-header", str(header), "-o", f"{header}.gch"],
                   capture_output=True, cwd=root, check=False)
    return header


def check(root, command, cuda_include, folder, is_built, without=None, bases=BASES):
    """Returns the violations, the number of headers checked, those skipped, and how many the build compiles."""
    every = [path for path in code_files(root) if path.suffix == ".h"]
    built = [path for path in every if is_built and proven_by_build(root, path)]
    headers = [path for path in every if path not in built]
    skipped = [h for h in headers if h.parts[0] == without or not cuda_include and needs_cuda(root, h)]
    chosen = choose(root, [h for h in headers if h not in skipped], built, bases)
    if cuda_include:
        command = [*command, "-isystem", cuda_include]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        used = [base for base in bases if any(base == other for _, other in chosen)]
        files = dict(zip(used, pool.map(lambda base: precompile(root, base, command, folder), used)))
        texts = [[files[base], header] if base else [header] for header, base in chosen]
        complaints = pool.map(lambda text: compile_alone(root, text, command, folder), texts)
        violations = [f"{h} does not compile alone:\n{c}" for (h, _), c in zip(chosen, complaints) if c]
    for file in files.values():
        pathlib.Path(f"{file}.gch").unlink(missing_ok=True)  # a hundred MB each
    violations += [f"{h} has no #pragma once" for h in every if "#pragma once" not in read(root, h).splitlines()]
    return violations, len(headers) - len(skipped), skipped, len(built)


def self_test(command, folder):
    """Self-test: plants headers that lean on another's includes, one without #pragma once, and ones that are clean or proven."""
    with tempfile.TemporaryDirectory() as planted:
        root = pathlib.Path(planted)
        (root / "alone.h").write_text("#pragma once\n#include <string>\ninline std::string a() { return {}; }\n")
        (root / "leaning.h").write_text("#pragma once\ninline std::vector<int> b() { return {}; }\n")
        (root / "twice.h").write_text("struct Twice {};\n")
        (root / "inner.h").write_text("#pragma once\ninline std::vector<int> e() { return {}; }\n")
        (root / "outer.h").write_text('// Its first is not clean.\n#pragma once\n#include "inner.h"\n#include <vector>\n')
        (root / "proven.h").write_text("#pragma once\ninline std::vector<int> c() { return {}; }\n")
        (root / "proven.cpp").write_text('// The build compiles it.\n#include "proven.h"\n')
        (root / "late.h").write_text("#pragma once\ninline std::vector<int> d() { return {}; }\n")
        (root / "late.cpp").write_text('#include <vector>\n#include "late.h"\n')
        (root / "base.h").write_text("#pragma once\n#include <vector>\n")
        (root / "behind.h").write_text('#pragma once\n#include "base.h"\ninline std::vector<int> f() { return {}; }\n')
        (root / "first.h").write_text("#pragma once\ninline std::vector<int> g() { return {}; }\n")
        (root / "hides.h").write_text('// Its first is not clean.\n#pragma once\n#include "first.h"\n#include "base.h"\n')
        (root / "never.h").write_text("#pragma once\n#if 1 - 1\n#include \"base.h\"\n#endif\n"
                                      "inline std::vector<int> h() { return {}; }\n")
        for is_built in (True, False):
            for bases, leaning in (((), "hides.h"), ((("base.h",),), "first.h")):
                broken = ["late.h", "leaning.h", "never.h", "outer.h", "twice.h", leaning] + ["proven.h"] * (not is_built)
                violations, checked, skipped, proven = check(root, command, None, folder, is_built, bases=bases)
                expect(checked == 12 - is_built and proven == is_built and not skipped, f"{checked} headers seen")
                expect(sorted(v.split()[0] for v in violations) == sorted(broken), f"got {violations}")


if __name__ == "__main__":
    own, compiler = sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1:]
    absent = own[own.index("--without") + 1] if "--without" in own else None
    cuda = own[own.index("--cuda-include") + 1] if "--cuda-include" in own else None
    os.makedirs(own[1], exist_ok=True)
    with tempfile.TemporaryDirectory() as objects:
        self_test(compiler, objects)
    is_left = "--built" in own or "--without-own" in own and os.environ.get("SDAG_ALL_HEADERS") != "1"
    found, count, left_out, left_to_build = check(pathlib.Path(own[0]).resolve(), compiler, cuda, own[1], is_left, absent)
    for name in left_out:
        print(f"skipped: {name} needs " + (f"what {absent}/ is built with" if name.parts[0] == absent else "the CUDA toolkit"))
    if left_to_build:
        print(f"skipped: {left_to_build} headers that their own sources include first: "
              + ("the build compiles them" if "--built" in own else "left to builds without SDAG_UNITY"))
    sys.exit(report("headers alone", found, count))
