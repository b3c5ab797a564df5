# SPDX-License-Identifier: Apache-2.0
"""Compiles every header alone: each includes what it uses. A header that its own x.cpp includes before all else has
been compiled alone by the build; the rest is compiled here.

    headers_alone.py SOURCE_DIR [--cuda-include DIR] -- COMPILER [FLAG...]

Headers that include the CUDA runtime are skipped, by name, where no toolkit is given. A compiler cache in front of
COMPILER makes the second run cheap, which is why objects are written and -fsyntax-only is not used.
"""
import concurrent.futures
import os
import pathlib
import subprocess
import sys
import tempfile

from sources import code_files, expect, read, report


def needs_cuda(root, header):
    """Returns whether a header includes the CUDA runtime directly, outside of any condition on the compiler."""
    return "#include <cuda_runtime" in read(root, header)


def proven_by_build(root, header):
    """Returns whether the header's own source includes it first."""
    source = header.with_suffix(".cpp")
    if not (pathlib.Path(root) / source).is_file():
        return False
    includes = [line for line in read(root, source).splitlines() if line.lstrip().startswith("#")]
    return includes[:1] == [f'#include "{header}"']


def compile_alone(root, header, command, folder):
    """Returns the compiler's complaint about a source that holds nothing but this include, or an empty string."""
    stem = str(header).replace("/", "_")
    source = pathlib.Path(folder) / f"{stem}.cpp"
    source.write_text(f'#include "{header}"\n#include "{header}"\n')
    result = subprocess.run([*command, "-I", str(root), "-c", str(source), "-o", f"{source}.o"],
                            capture_output=True, text=True, cwd=root)
    lines = (result.stdout + result.stderr).strip().splitlines()
    return "\n".join(lines[:8]) if result.returncode else ""


def check(root, command, cuda_include, folder):
    """Returns the violations, the number of headers compiled, and those skipped."""
    headers = [path for path in code_files(root) if path.suffix == ".h" and not proven_by_build(root, path)]
    skipped = [h for h in headers if not cuda_include and needs_cuda(root, h)]
    chosen = [h for h in headers if h not in skipped]
    if cuda_include:
        command = [*command, "-isystem", cuda_include]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = pool.map(lambda h: compile_alone(root, h, command, folder), chosen)
        violations = [f"{h} does not compile alone:\n{c}" for h, c in zip(chosen, complaints) if c]
    return violations, len(chosen), skipped


def self_test(command, folder):
    """Plants headers that lean on another's includes, one without #pragma once, and ones that are clean or proven."""
    with tempfile.TemporaryDirectory() as planted:
        root = pathlib.Path(planted)
        (root / "alone.h").write_text("#pragma once\n#include <string>\ninline std::string a() { return {}; }\n")
        (root / "leaning.h").write_text("#pragma once\ninline std::vector<int> b() { return {}; }\n")
        (root / "twice.h").write_text("struct Twice {};\n")
        (root / "proven.h").write_text("#pragma once\ninline std::vector<int> c() { return {}; }\n")
        (root / "proven.cpp").write_text('// The build compiles it.\n#include "proven.h"\n')
        (root / "late.h").write_text("#pragma once\ninline std::vector<int> d() { return {}; }\n")
        (root / "late.cpp").write_text('#include <vector>\n#include "late.h"\n')
        violations, checked, skipped = check(root, command, None, folder)
        expect(checked == 4 and not skipped, f"{checked} headers seen")
        expect([v.split()[0] for v in violations] == ["late.h", "leaning.h", "twice.h"], f"got {violations}")


if __name__ == "__main__":
    own, compiler = sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1:]
    cuda = own[own.index("--cuda-include") + 1] if "--cuda-include" in own else None
    with tempfile.TemporaryDirectory() as objects:
        self_test(compiler, objects)
        found, count, left_out = check(pathlib.Path(own[0]).resolve(), compiler, cuda, objects)
    for name in left_out:
        print(f"skipped: {name} needs the CUDA toolkit")
    sys.exit(report("headers alone", found, count))
