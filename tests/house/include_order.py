# SPDX-License-Identifier: Apache-2.0
"""Enforces the include table: folders include only those to their left, third-party headers are included only in
their library's folders, and every file's includes come in the order own, project, third-party, std.

    include_order.py SOURCE_DIR      checks the tree, after checking itself on planted violations

The orders that docs/method.md states must be these, too.
"""
import pathlib
import re
import sys
import tempfile

from sources import code_files, expect, read, report

# cuda <- gl <- scenes <- { voxel, shadowmap } <- hybrid <- tools <- { examples, python } <- tests
MAY_INCLUDE = {
    "cuda": {"cuda"},
    "gl": {"cuda", "gl"},
    "scenes": {"cuda", "gl", "scenes"},
    "voxel": {"cuda", "gl", "scenes", "voxel"},
    "shadowmap": {"cuda", "gl", "scenes", "shadowmap"},
    "hybrid": {"cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid"},
    "tools": {"cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid", "tools"},
    "examples": {"cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid", "tools", "examples"},
    "python": {"cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid", "tools", "python"},
    "tests": {"cuda", "gl", "scenes", "voxel", "shadowmap", "hybrid", "tools", "examples", "python", "tests"},
}

# Rooms of a folder, each with the rooms that it may include. Files beside the rooms belong to the room given for ".".
# A folder that is not listed has no internal order yet.
ROOMS = {
    # gbuffer <- rays <- clusters <- routing <- frame <- { gl, judge }
    "hybrid": {
        "gbuffer": {"gbuffer"},
        "rays": {"gbuffer", "rays"},
        "clusters": {"gbuffer", "rays", "clusters"},
        "routing": {"gbuffer", "rays", "clusters", "routing"},
        "frame": {"gbuffer", "rays", "clusters", "routing", "frame"},
        "gl": {"gbuffer", "rays", "clusters", "routing", "frame", "gl"},
        "judge": {"gbuffer", "rays", "clusters", "routing", "frame", "judge"},
    },
    # settings <- workspace <- report <- studies; bench and window beside studies; commands after all
    "tools": {
        "settings": {"settings"},
        "workspace": {"settings", "workspace"},
        "report": {"settings", "workspace", "report"},
        "studies": {"settings", "workspace", "report", "studies"},
        "bench": {"settings", "workspace", "bench"},
        "window": {"settings", "workspace", "window"},
        "commands": {"settings", "workspace", "report", "studies", "bench", "window", "commands"},
    },
}
ROOM_OF_LOOSE_FILES = {"hybrid": "frame"}  # hybrid/frame.h is the frame for other folders

# Header pattern -> folders that may include it. Tests may include all; GLM is the vocabulary everywhere.
THIRD_PARTY = {
    r"glm/.*": set(MAY_INCLUDE),
    r"cuda_runtime(_api)?\.h|cuda/.*|cub/.*|thrust/.*|cooperative_groups.*": {"cuda"},
    r"oneapi/tbb.*|tbb/.*": {"cuda"},
    r"tiny_gltf\.h|meshoptimizer\.h|xxhash\.h|draco/.*|assimp/.*|jpeglib\.h|jerror\.h": {"scenes"},
    r"stb/?.*|stb_.*\.h": {"scenes", "tools"},
    r"openvdb/.*|nanovdb/.*|zstd.*\.h|hwy/.*": {"voxel"},
    r"muParser.*\.h": {"hybrid"},
    r"embree\d/.*": {"hybrid", "examples"},
    r"BulletCollision/.*": {"examples"},
    r"nlohmann/.*": {"tools", "python"},
    r"CLI/.*|OpenEXR/.*|Imf.*\.h|Imath/.*|half\.h|GLFW/.*|X11/.*|imgui.*\.h|backends/imgui.*": {"tools"},
    r"epoxy/.*": {"gl", "tools"},
    r"pybind11/.*": {"python"},
    r"zlib\.h|sanitizer/.*": set(),
    r"gtest/.*|gmock/.*|benchmark/.*|boost/.*": set(),
}
# Header pattern -> the one file that includes it, for tests too, because it knows what versions differ in.
ONE_FILE = {r"embree\d/.*": "hybrid/rays/embree_version.h"}
# A standard header has neither dot nor slash; these are the C and POSIX headers of the system.
SYSTEM = re.compile(r"[a-z0-9_]+|(sys|linux|arpa|netinet)/\w+\.h|"
                    r"(unistd|grp|fcntl|dirent|dlfcn|errno|signal|time|stdio|stdio_ext|stddef|stdlib|string|math|stdint|"
                    r"(x|p|e|t|s|n|w|i|a)mmintrin|immintrin|cpuid|xmmintrin|termios|pthread|sched|malloc|execinfo|spawn|poll|glob|ftw|ucontext|cxxabi)\.h")
# Written into the build folder by the folder's CMakeLists.txt.
GENERATED = {"tools/provenance_values.h", "tools/studies/shipped_studies.h"}
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)')
CONDITIONAL = re.compile(r"^\s*#\s*(if|ifdef|ifndef|endif)\b")
OWN, PROJECT, THIRD, STD = range(4)
GROUP_NAMES = ("own", "project", "third-party", "std")


def own_header(path):
    """Returns the header that a source implements, or None. tests/a/b_test.cpp tests a/b.h."""
    if path.suffix == ".h":
        return None
    name = re.sub(r"_(test|fuzz|bench)$", "", path.stem)
    parts = path.parts[1:-1] if path.parts[0] == "tests" else path.parts[:-1]
    return "/".join((*parts, name + ".h"))


def room_of(folder, parts):
    """Returns the room that a path, split at its slashes, stands in: of a folder with rooms."""
    return parts[1] if len(parts) > 2 else ROOM_OF_LOOSE_FILES.get(folder)


def room_violation(folder, path, header):
    """Returns why a file may not include a header of its own folder, or None."""
    rooms = ROOMS.get(folder)
    if header in GENERATED:
        return None
    if rooms is None:
        return None
    room, target = room_of(folder, path.parts), room_of(folder, header.split("/"))
    for name in (room, target):
        if name not in rooms:
            return f'{folder}/ has no room "{name}" in tests/house/include_order.py'
    if target not in rooms[room]:
        return f'{folder}/{room}/ may not include "{header}": {folder}/{target}/ does not stand before it'
    return None


def third_party_folders(header):
    """Returns the folders that may include a third-party header, or None when the table lacks it."""
    for pattern, folders in THIRD_PARTY.items():
        if re.fullmatch(pattern, header):
            return folders
    return None


def check_file(root, path):
    """Returns the violations of one file."""
    folder = path.parts[0]
    violations = []
    last, depth = OWN, 0
    for number, line in enumerate(read(root, path).splitlines(), 1):
        conditional = CONDITIONAL.match(line)
        if conditional:
            depth += -1 if conditional[1] == "endif" else 1
        match = INCLUDE.match(line)
        if not match:
            continue
        where = f"{path}:{number}:"
        quoted, angled = match[1], match[2]
        if quoted:
            target = quoted.split("/")[0]
            if quoted not in GENERATED and not (pathlib.Path(root) / quoted).is_file():
                violations.append(f'{where} "{quoted}" is no path from the root; third-party headers take <>')
            elif target not in MAY_INCLUDE.get(folder, set()):
                violations.append(f'{where} {folder}/ may not include "{quoted}": {target}/ does not stand before it')
            elif target == folder and (reason := room_violation(folder, path, quoted)):
                violations.append(f"{where} {reason}")
            group = OWN if quoted == own_header(path) else PROJECT
        elif SYSTEM.fullmatch(angled):
            group = STD
        else:
            group = THIRD
            folders = third_party_folders(angled)
            if folders is None:
                violations.append(f"{where} <{angled}> is in no row of the table in tests/house/include_order.py")
            elif (one := next((one for pattern, one in ONE_FILE.items() if re.fullmatch(pattern, angled)), None)) \
                    not in (None, path.as_posix()) and folder != "examples":
                violations.append(f'{where} <{angled}> is included by "{one}" alone; include that')
            elif folder not in folders and folder != "tests":
                violations.append(f"{where} {folder}/ may not include <{angled}>: "
                                  f"it is at home in {', '.join(sorted(folders)) or 'tests'}")
        if depth == 0 and path.suffix != ".cu":
            if group < last:
                violations.append(f"{where} {GROUP_NAMES[group]} include after {GROUP_NAMES[last]}; "
                                  "the order is own, project, third-party, std")
            last = max(last, group)
    return violations


def order_of(chains):
    """Returns {name: those that it may include} of lines such as "a <- { b, c } <- d": all to the left, and itself."""
    allowed = {}
    for chain in chains:
        before = set()
        for step in chain.split("<-"):
            names = set(re.findall(r"\w+", step))
            for name in names:
                allowed.setdefault(name, {name}).update(before)
            before |= {of for name in names for of in allowed[name]}
    return allowed


def check_document(text):
    """Returns the orders of docs/method.md that are not those enforced here."""
    chains = re.findall(r"^ {4,}(\w+ <- .*)$", text, re.MULTILINE)
    violations = []
    for what, table in (("of the folders", MAY_INCLUDE), *((f"inside {folder}/", ROOMS[folder]) for folder in ROOMS)):
        stated = order_of(chain for chain in chains if set(re.findall(r"\w+", chain)) <= set(table))
        if stated != table:
            wrong = sorted(name for name in table if stated.get(name) != table[name])
            violations.append(f"docs/method.md: the order {what} is another than here, for {', '.join(wrong)}")
    return violations


def check(root):
    """Returns the violations of the tree, and the number of files checked."""
    files = [path for path in code_files(root) if path.parts[0] in MAY_INCLUDE]
    strangers = [f"{path}: sources live in {', '.join(MAY_INCLUDE)}" for path in code_files(root)
                 if path.parts[0] not in MAY_INCLUDE]
    return strangers + [v for path in files for v in check_file(root, path)], len(files)


def self_test():
    """Self-test: plants one violation of each kind and clean files, and verifies the result."""
    planted = {
        "cuda/a.h": ('#include "scenes/b.h"\n', "does not stand before"),
        "scenes/b.h": ('#include <glm/vec3.hpp>\n#include <vector>\n', None),
        "voxel/c.h": ('#include "shadowmap/d.h"\n', "does not stand before"),
        "shadowmap/d.h": ('#include <zstd.h>\n', "at home in voxel"),
        "shadowmap/e.cpp": ('#include "voxel/c.h"\n', "does not stand before"),
        "hybrid/judge/f.cpp": ('#include <openvdb/openvdb.h>\n', "at home in voxel"),
        "hybrid/rays/embree_version.h": ('#include <embree3/rtcore.h>\n#include <sys/mman.h>\n', None),
        "hybrid/judge/g.cpp": ('#include <embree4/rtcore.h>\n', 'by "hybrid/rays/embree_version.h" alone'),
        "scenes/h.cpp": ('#include "b.h"\n', "no path from the root"),
        "scenes/i.cpp": ('#include <vector>\n#include "scenes/b.h"\n', "project include after std"),
        "scenes/j.cpp": ('#include <surprise/all.hpp>\n', "in no row"),
        "scenes/b.cpp": ('#include "cuda/a.h"\n#include "scenes/b.h"\n', "own include after project"),
        "tools/k.cpp": ('#include <tbb/parallel_for.h>\n', "at home in cuda"),
        "tools/l.cpp": ('#include <gtest/gtest.h>\n', "at home in tests"),
        "tests/voxel/m_test.cpp": ('#include "hybrid/g.h"\n#include <openvdb/openvdb.h>\n', "no path"),
        "tests/voxel/c_test.cpp": ('#include "voxel/c.h"\n#include "cuda/a.h"\n#include <openvdb/openvdb.h>\n', None),
        "tests/voxel/t_test.cpp": ('#include <embree3/rtcore.h>\n', "alone"),
        "examples/u.cpp": ('#include <embree3/rtcore.h>\n', None),
        "extra/n.cpp": ("", "sources live in"),
        "hybrid/frame/o.h": ('#include "hybrid/gl/p.h"\n', "hybrid/gl/ does not stand before it"),
        "hybrid/gl/p.h": ('#include "hybrid/frame.h"\n#include "hybrid/frame/o.h"\n', None),
        "hybrid/frame.h": ('#include "hybrid/routing/q.h"\n', None),
        "hybrid/routing/q.h": ('#include "hybrid/frame.h"\n', "hybrid/frame/ does not stand before it"),
        "hybrid/judge/r.cpp": ('#include "hybrid/gl/p.h"\n', "hybrid/gl/ does not stand before it"),
        "hybrid/attic/s.h": ('#include "hybrid/routing/q.h"\n', 'no room "attic"'),
    }
    expect(order_of(["a <- { b, c } <- d", "a <- e"]) ==
           {"a": {"a"}, "b": {"a", "b"}, "c": {"a", "c"}, "d": {"a", "b", "c", "d"}, "e": {"a", "e"}}, "an order")
    expect(len(check_document("    gl <- cuda\n")) == 1 + len(ROOMS), "orders that are not stated")
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, (text, _) in planted.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        violations, checked = check(root)
        expect(checked == len(planted) - 1, f"{checked} files seen")
        for name, (_, expected) in planted.items():
            found = [v for v in violations if v.startswith((f"{name}:",))]
            if expected is None:
                expect(not found, f"{name} is clean, but: {found}")
            else:
                expect(len(found) == 1 and expected in found[0], f"{name}: wanted '{expected}', got {found}")


if __name__ == "__main__":
    self_test()
    found, count = check(sys.argv[1])
    sys.exit(report("include order", found + check_document(read(sys.argv[1], "docs/method.md")), count))
