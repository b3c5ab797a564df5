# SPDX-License-Identifier: Apache-2.0
"""Compiles every header alone: each includes what it uses.

    headers_alone.py SOURCE_DIR [--built] [--cuda-include DIR] [--without FOLDER] -- COMPILER [FLAG...]

A header that another one includes before anything else is compiled alone there: nothing stands before it. So only the
others are given to the compiler. With --built, the build also compiles sources one by one, and a header that its own
x.cpp includes first is proven there. Headers that include the CUDA runtime are skipped, by name, if no toolkit is
given, and so are those of the folder of --without, whose library is missing. A compiler cache in front of COMPILER
makes the second run fast; for that objects are written and -fsyntax-only is not used.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from sources import code_files, expect, read, report


def needs_cuda(root, header):
    """Returns whether a header includes the CUDA runtime directly, outside of any condition on the compiler."""
    return "#include <cuda_runtime" in read(root, header)


def first_include(root, path):
    """Returns the header of the project that a file includes before any other code or directive, or None."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", read(root, path), flags=re.DOTALL)
    found = re.match(r'\s*(?:#pragma once\s+)?#include "([^"]+)"', text)
    return pathlib.Path(found.group(1)) if found else None


def proven_by_build(root, header):
    """Returns whether the header's own source includes it first."""
    source = header.with_suffix(".cpp")
    return (pathlib.Path(root) / source).is_file() and first_include(root, source) == header


def compile_alone(root, header, command, folder):
    """Returns the compiler's message about a source with only this include, or an empty string."""
    stem = str(header).replace("/", "_")
    source = pathlib.Path(folder) / f"{stem}.cpp"
    source.write_text(f'#include "{header}"\n')
    result = subprocess.run([*command, "-I", str(root), "-c", str(source), "-o", f"{source}.o"],
                            capture_output=True, text=True, cwd=root)
    lines = (result.stdout + result.stderr).strip().splitlines()
    return "\n".join(lines[:8]) if result.returncode else ""


def check(root, command, cuda_include, folder, is_built, without=None):
    """Returns the violations, the number of headers checked, those skipped, and how many the build compiles."""
    every = [path for path in code_files(root) if path.suffix == ".h"]
    headers = [path for path in every if not (is_built and proven_by_build(root, path))]
    skipped = [h for h in headers if h.parts[0] == without or not cuda_include and needs_cuda(root, h)]
    included = {first_include(root, h) for h in every if h not in skipped}
    chosen = [h for h in headers if h not in skipped and h not in included]
    if cuda_include:
        command = [*command, "-isystem", cuda_include]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = pool.map(lambda h: compile_alone(root, h, command, folder), chosen)
        violations = [f"{h} does not compile alone:\n{c}" for h, c in zip(chosen, complaints) if c]
    violations += [f"{h} has no #pragma once" for h in every if "#pragma once" not in read(root, h).splitlines()]
    return violations, len(headers) - len(skipped), skipped, len(every) - len(headers)


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
        for is_built, count, broken in ((True, 6, ["late.h", "leaning.h", "outer.h", "twice.h"]),
                                        (False, 7, ["late.h", "leaning.h", "outer.h", "proven.h", "twice.h"])):
            violations, checked, skipped, proven = check(root, command, None, folder, is_built)
            expect(checked == count and proven == 7 - count and not skipped, f"{checked} headers seen")
            expect([v.split()[0] for v in violations] == broken, f"got {violations}")


if __name__ == "__main__":
    own, compiler = sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1:]
    absent = own[own.index("--without") + 1] if "--without" in own else None
    cuda = own[own.index("--cuda-include") + 1] if "--cuda-include" in own else None
    with tempfile.TemporaryDirectory() as objects:
        self_test(compiler, objects)
        found, count, left_out, left_to_build = check(pathlib.Path(own[0]).resolve(), compiler, cuda, objects,
                                                      "--built" in own, absent)
    for name in left_out:
        print(f"skipped: {name} needs " + (f"what {absent}/ is built with" if name.parts[0] == absent else "the CUDA toolkit"))
    if left_to_build:
        print(f"skipped: {left_to_build} headers that their own sources include first: the build compiles them")
    sys.exit(report("headers alone", found, count))
