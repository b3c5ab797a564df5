# SPDX-License-Identifier: Apache-2.0
"""Checks what nvcc makes of every kernel: its PTX contains no operation whose result another processor would not give,
and its registers, stack and code stay within committed bounds.

    kernels.py SOURCE_DIR BUILD_DIR BOUNDS.json            compiles the kernels for one architecture, and compares
    kernels.py SOURCE_DIR BUILD_DIR BOUNDS.json --record   writes the bounds anew: those of this source and nvcc
    kernels.py --self-test

Nothing is run on a device, and none is needed. Where there is no nvcc it says so and exits with 77, which ctest takes for
skipped. Bounds hold for one release of nvcc; another's kernels are checked for their operations only. The kernels of CUB
are not ours, and are left out. Compiled texts are kept in BUILD_DIR, by the hash of what they are made of.
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import struct
import subprocess
import sys

SKIPPED = 77
COMPUTE = "90"
# Operations that are not correctly rounded, that flush small numbers to zero, or that ptxas may join into one.
INEXACT = re.compile(r"^\s*(?:@\S+\s+)?((?:add|sub|mul|mad)\.f(?:32|64)|mad\.\S*f(?:32|64)|(?:div|sqrt|rcp|rsqrt|sin|cos|ex2|lg2|tanh)\.(?:approx|full)\S*"
                     r"|\S+\.ftz\S*)\s", re.MULTILINE)
FUSED = re.compile(r"^\s*(?:@\S+\s+)?fma\.rn\.f(?:32|64)\s", re.MULTILINE)
FUNCTION = re.compile(r"^(?:\.\w+ )*\.(entry|func)\s+(?:\(.*?\)\s*)?(\w+)", re.MULTILINE)
USED = re.compile(r"Compiling entry function '(\w+)'.*?(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads"
                  r".*?Used (\d+) registers", re.DOTALL)
COUNTS = ("registers", "stack_bytes", "spill_bytes", "code_bytes")


def find_nvcc():
    """Returns nvcc, or ends as skipped."""
    found = shutil.which("nvcc", path=os.environ.get("PATH", "") + ":/usr/local/cuda/bin")
    if not found:
        print("kernels: skipped: there is no nvcc here, so nothing is known of the kernels")
        sys.exit(SKIPPED)
    return pathlib.Path(found)


def release_of(nvcc):
    return re.search(r"release ([\d.]+)", subprocess.run([nvcc, "--version"], check=True, capture_output=True, text=True).stdout)[1]


def commands(source, build):
    """Returns the compiler's commands for our CUDA sources, as the preset nvcc has them: (source, command, folder)."""
    folder = build / "nvcc"
    done = subprocess.run(["cmake", "--preset", "nvcc", "-B", str(folder)], cwd=source, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"kernels: the preset nvcc does not configure:\n{done.stderr}")
    entries = json.loads((folder / "compile_commands.json").read_text())
    return [(entry["file"], shlex.split(entry["command"]), entry["directory"]) for entry in entries
            if entry["file"].endswith(".cu")]


def compile_one(nvcc, file, command, folder, kept):
    """Returns the PTX of a source, ptxas's report, and the sizes of its code by function."""
    options, skip = [], False
    for word in command[command.index(next(w for w in command if pathlib.Path(w).name == "nvcc")) + 1:]:
        if skip or word in ("-c", "-dc", "-MD", file) or word.startswith(("--generate-code", "-gencode", "-arch")):
            skip = False
        elif word in ("-o", "-MT", "-MF", "-x"):
            skip = True
        else:
            options.append(word)
    base = [str(nvcc), *options, "-x", "cu", f"-arch=compute_{COMPUTE}", file]
    text = subprocess.run([*base, "-E"], cwd=folder, check=True, capture_output=True).stdout
    name = hashlib.sha256(b"\0".join([shlex.join(options).encode(), release_of(nvcc).encode(), text])).hexdigest()[:24]
    ptx, cubin, report = (kept / f"{name}.{end}" for end in ("ptx", "cubin", "txt"))
    if not report.exists():
        part = kept / f"{name}.part"
        subprocess.run([*base, "-ptx", "-o", str(part)], cwd=folder, check=True)
        part.replace(ptx)
        said = subprocess.run([str(nvcc.with_name("ptxas")), "-v", f"-arch=sm_{COMPUTE}", str(ptx), "-o", str(cubin)],
                              check=True, capture_output=True, text=True)
        part.write_text(said.stdout + said.stderr)
        part.replace(report)
    return ptx.read_text(), report.read_text(), code_sizes(cubin.read_bytes())


def code_sizes(elf):
    """Returns {function: bytes of code} of a cubin, an ELF file of 64 bits."""
    start, = struct.unpack_from("<Q", elf, 0x28)
    size, count, names = struct.unpack_from("<HHH", elf, 0x3a)
    sections = [struct.unpack_from("<IIQQQQ", elf, start + i * size) for i in range(count)]
    text = sections[names][4]
    found = {}
    for name, _, _, _, _, length in sections:
        label = elf[text + name:elf.index(b"\0", text + name)].decode()
        if label.startswith(".text."):
            found[label.removeprefix(".text.")] = length
    return found


def functions_of(ptx):
    """Returns {function: its text} of PTX."""
    starts = [(match.start(), match[2]) for match in FUNCTION.finditer(ptx)]
    ends = [start for start, _ in starts[1:]] + [len(ptx)]
    found = {}
    for (start, name), end in zip(starts, ends):
        found[name] = found.get(name, "") + ptx[start:end]
    return found


def short_names(mangled):
    """Returns {mangled: what a reader calls the kernel}, its pass or its own name, without those of CUB."""
    names = subprocess.run(["c++filt"], input="\n".join(mangled), check=True, capture_output=True, text=True).stdout.splitlines()
    short = {}
    for name, long in zip(mangled, names):
        if re.search(r"\b(cub|thrust)::", long):
            continue
        of_pass = re.search(r"(\w+)Kernel<shadowdag::CudaTag, shadowdag::(.+?)>\(", long)
        own = re.search(r"(\w+)(<.*>)?\(", long)
        short[name] = (f"{of_pass[2]}{' by parts' if of_pass[1] == 'shareParts' else ''}" if of_pass else
                       own[1] + re.sub(r"(?<=\d)ul\b", "", own[2] or "") if own else long)
    return short


def kernels_of(ptx, report, sizes):
    """Returns ({kernel: its counts}, violations)."""
    bodies = functions_of(ptx)
    used = {name: dict(zip(COUNTS, (int(registers), int(stack), int(stores) + int(loads), sizes[name])))
            for name, stack, stores, loads, registers in USED.findall(report)}
    short = short_names(sorted(bodies))
    violations = []
    for name in short:
        inexact = sorted(set(INEXACT.findall(bodies[name])))
        if inexact:
            violations.append(f"{short[name]}: {', '.join(inexact)}: other processors give other bits")
    found = {short[name]: {**counts, "fused_count": len(FUSED.findall(bodies[name]))} for name, counts in used.items() if name in short}
    return found, violations


def compare(bounds, found):
    """Returns what exceeds the bounds."""
    violations = [f"{name}: there are no bounds for it; record them" for name in sorted(found.keys() - bounds.keys())]
    violations += [f"{name}: there is no such kernel any more; record the bounds" for name in sorted(bounds.keys() - found.keys())]
    for name in sorted(bounds.keys() & found.keys()):
        for count in COUNTS:
            if found[name][count] > bounds[name][count]:
                violations.append(f"{name}: {found[name][count]} {count}, at most {bounds[name][count]} are allowed")
        if found[name]["fused_count"] != bounds[name]["fused_count"]:
            violations.append(f'{name}: {found[name]["fused_count"]} fused multiply-adds instead of {bounds[name]["fused_count"]}, '
                              "which the source asks for")
    return violations


def self_test():
    """Self-test: plants PTX with every kind of violation."""
    ptx = ".visible .entry _Z5cleanv()\n{\n\tadd.rn.f32 \t%f1, %f2;\n\tfma.rn.f32 \t%f1;\n\tdiv.rn.f32 %f1;\n\tadd.s32 %r1;\n}\n"
    for line in ("add.f32 \t%f1;", "mul.f64 %f1;", "@%p1 sub.f32 %f1;", "div.approx.f32 %f1;", "sqrt.approx.ftz.f32 %f1;", "add.rn.ftz.f32 %f1;",
                 "div.full.f32 %f1;"):
        _, violations = kernels_of(ptx + f".visible .entry _Z3badv()\n{{\n\t{line}\n}}\n", "", {})
        if len(violations) != 1 or "bad" not in violations[0]:
            sys.exit(f"self-test failed: {line}: {violations}")
        _, violations = kernels_of(ptx + f".visible .entry _ZN3cub3badEv()\n{{\n\t{line}\n}}\n", "", {})
        if violations:
            sys.exit(f"self-test failed: {violations}")
    report = ("Compiling entry function '_Z5cleanv' for 'sm_90'\n 8 bytes stack frame, 4 bytes spill stores, 2 bytes spill loads\n"
              "ptxas info : Used 20 registers, used 0 barriers\n")
    found, violations = kernels_of(ptx, report, {"_Z5cleanv": 320})
    clean = {"clean": dict(zip((*COUNTS, "fused_count"), (20, 8, 6, 320, 1)))}
    if found != clean or violations or compare(clean, clean):
        sys.exit(f"self-test failed: {found}, {violations}")
    for count in clean["clean"]:
        if len(compare(clean, {"clean": {**clean["clean"], count: clean["clean"][count] + 1}})) != 1:
            sys.exit(f"self-test failed: a rise of {count} is not noticed")
    if len(compare(clean, {})) != 1 or len(compare({}, clean)) != 1:
        sys.exit("self-test failed: other kernels are not noticed")


def main(source, build, bounds_file, is_recording):
    nvcc = find_nvcc()
    kept = build / "kernels"
    kept.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda entry: kernels_of(*compile_one(nvcc, *entry, kept)), commands(source, build)))
    found = {name: counts for kernels, _ in results for name, counts in kernels.items()}
    violations = [violation for _, of_file in results for violation in of_file]
    release = release_of(nvcc)
    if is_recording and not violations:
        part = bounds_file.with_suffix(".part")
        part.write_text(json.dumps({"nvcc": release, "architecture": f"sm_{COMPUTE}", "kernels": found}, indent=1, sort_keys=True) + "\n")
        part.replace(bounds_file)
    bounds = json.loads(bounds_file.read_text())
    if bounds["nvcc"] == release:
        violations += compare(bounds["kernels"], found)
    else:
        print(f'kernels: the bounds are those of nvcc {bounds["nvcc"]}; this is {release}, so only operations were checked')
    for violation in violations:
        print(violation)
    print(f"kernels: {len(found)} kernels, compiled for sm_{COMPUTE}, not run; {len(violations)} violations")
    return 1 if violations or not found else 0


if __name__ == "__main__":
    self_test()
    if sys.argv[1:] != ["--self-test"]:
        given = [argument for argument in sys.argv[1:] if argument != "--record"]
        if len(given) != 3:
            sys.exit(__doc__)
        sys.exit(main(pathlib.Path(given[0]).resolve(), pathlib.Path(given[1]).resolve(), pathlib.Path(given[2]), "--record" in sys.argv))
