# SPDX-License-Identifier: Apache-2.0
"""Checks that every pass (cuda/pass.h) is registered once, in a file that is compiled for both processors, and that
a kernel for one processor has a counterpart for the other.

    passes.py SOURCE_DIR [LIBRARY...]      checks the tree, after checking itself on planted violations

With the libraries of a build with CUDA, it also checks their symbols: both launchers of every pass must be defined.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

from sources import code_files, expect, project_files, read, report

# Passes for one processor only, with the reason.
ONE_PROCESSOR = {"RasterizeBatches": "a GPU draws by slots"}
REGISTRATION = re.compile(r"^\s*SDAG(_CPU|_CUDA)?_PASS\((\w+)\)", re.M)
RUN = re.compile(r"\brunPass\(\s*[^,;]+,\s*(\w+)\{")
OWN_LAUNCHER = re.compile(r"\bvoid launchPass\((Cpu|Cuda)Tag(?: \w+)?, const (\w+)&(?: \w+)?\) \{")
ADDED = re.compile(r"\b(sdag_add_passes|sdag_add_cuda_sources)\(\s*\w+\s+([^)]*)\)")
BOTH = {"Cpu", "Cuda"}


def added_files(root):
    """Returns which files are given to sdag_add_passes and to sdag_add_cuda_sources."""
    added = {"sdag_add_passes": set(), "sdag_add_cuda_sources": set()}
    for path in project_files(root):
        if path.name == "CMakeLists.txt":
            for function, names in ADDED.findall(read(root, path)):
                added[function] |= {path.parent / name for name in names.split()}
    return added


def check(root):
    """Returns the violations of the tree, the number of files checked, and the registered passes."""
    added = added_files(root)
    files = [path for path in code_files(root) if path.name not in ("pass.h", "pass_launch.h")]
    violations, registered, own, run = [], {}, {}, {}
    for path in files:
        text = read(root, path)
        if path.suffix == ".cpp":
            for which, name in REGISTRATION.findall(text):
                if path not in added["sdag_add_passes"]:
                    violations.append(f"{path}: registers {name}, but no CMakeLists.txt gives it to sdag_add_passes")
                processors = BOTH if not which else {"Cpu" if which == "_CPU" else "Cuda"}
                if name in registered:
                    violations.append(f"{path}: registers {name} again")
                registered[name] = (processors, path)
        for processor, name in OWN_LAUNCHER.findall(text):
            if processor == "Cuda" and path not in added["sdag_add_cuda_sources"]:
                violations.append(f"{path}: has the kernel of {name}, but no CMakeLists.txt gives it to "
                                  "sdag_add_cuda_sources")
            own.setdefault(name, set()).add(processor)
        for name in RUN.findall(text):
            run.setdefault(name, path)
    for name, (processors, path) in registered.items():
        missing = BOTH - processors - own.get(name, set())
        if missing and name not in ONE_PROCESSOR:
            violations.append(f"{path}: {name} is not compiled for {missing.pop().upper()}: register it by SDAG_PASS, "
                              "or define a launchPass of its own")
        for processor in processors & own.get(name, set()):
            violations.append(f"{path}: registers {name} for {processor.upper()}, which has a launchPass of its own")
    violations += [f"{path}: runs {name}, which no passes.cpp registers" for name, path in run.items()
                   if name not in registered and own.get(name) != BOTH]
    return violations, len(files), registered


def check_libraries(registered, libraries):
    """Returns the passes whose launchers the libraries lack."""
    symbols = subprocess.run(["nm", "-C", "--defined-only", *libraries], check=True, capture_output=True,
                             text=True).stdout
    defined = set(re.findall(r"launchPass(?:<[\w:]+>)?\(shadowdag::(Cpu|Cuda)Tag, shadowdag::(\w+) const&\)", symbols))
    return [f"{name}: the libraries have no launcher for {processor.upper()}"
            for name, (_, path) in registered.items() if path.parts[0] != "tests" and name not in ONE_PROCESSOR
            for processor in sorted(BOTH) if (processor, name) not in defined]


def self_test():
    """Self-test: plants one violation of each kind and clean passes, and verifies the result."""
    planted = {
        "a/CMakeLists.txt": "sdag_add_passes(lib passes.cpp)\nsdag_add_cuda_sources(lib warp_cuda.cu\n  other.cu)\n",
        "a/passes.cpp": "SDAG_PASS(Both)\nSDAG_CPU_PASS(Warp)\nSDAG_CUDA_PASS(Stream)\nSDAG_CPU_PASS(Lost)\n"
                        "SDAG_PASS(Double)\nSDAG_PASS(Double)\nSDAG_PASS(Doubled)\n",
        "a/warp_cuda.cu": "void launchPass(CudaTag, const Warp& work) {\n}\nvoid launchPass(CudaTag, const Own& work) {\n}\n",
        "a/left_out.cu": "void launchPass(CudaTag, const Both& work) {\n}\n",
        "a/stream_cpu.cpp": "void launchPass(CpuTag, const Stream& work) {\n}\n"
                            "void launchPass(CpuTag tag, const Doubled& work) {\n}\n"
                            "void launchPass(CpuTag, const Own& work) {\n}\n",
        "b/passes.cpp": "SDAG_PASS(Forgotten)\n",
        "b/run.cpp": "runPass(backend, Both{a});\nrunPass(backend, Own{a});\nrunPass(backend,\n        Unknown{a, b});\nrunPass(backend, work);\n",
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in planted.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        violations, _, registered = check(root)
        wanted = ["registers Double again", "has the kernel of Both, but no", "registers Forgotten, but no",
                  "Lost is not compiled for CUDA", "registers Both for CUDA, which has",
                  "registers Doubled for CPU, which has", "runs Unknown, which no"]
        for text in wanted:
            expect(sum(text in v for v in violations) == 1, f"'{text}' is not among {violations}")
        expect(len(violations) == len(wanted), f"more than planted: {violations}")
        expect(len(registered) == 7, f"registered: {sorted(registered)}")


if __name__ == "__main__":
    self_test()
    found, count, passes = check(pathlib.Path(sys.argv[1]))
    if sys.argv[2:]:
        found += check_libraries(passes, sys.argv[2:])
    print(f"passes: {len(passes)} registered")
    sys.exit(report("passes", found if passes else ["no pass was found: is the pattern right?"], count))
