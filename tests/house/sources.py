# SPDX-License-Identifier: Apache-2.0
"""Lists the files for the checks of this folder, and reports their results. Standard library only."""
import pathlib
import subprocess
import sys

CODE_SUFFIXES = (".h", ".cpp", ".cu")


def project_files(root):
    """Returns the paths, relative to root, of everything that is or could be committed."""
    root = pathlib.Path(root)
    try:
        listed = subprocess.run(
            ["git", "-c", f"safe.directory={root.resolve()}", "-C", str(root), "ls-files", "-z", "-co",
             "--exclude-standard"],
            check=True, capture_output=True).stdout.decode().split("\0")
        files = [pathlib.Path(name) for name in listed if name]
    except (OSError, subprocess.CalledProcessError):
        # An unpacked archive: everything except builds and outputs.
        files = [path.relative_to(root) for path in root.rglob("*")
                 if path.relative_to(root).parts[0] not in (".git", "build", "report", "install")]
    return sorted(path for path in files
                  if (root / path).is_file() and not (root / path).is_symlink() and path.parts[0] != "build")


def code_files(root):
    """Returns the C++ and CUDA sources among project_files."""
    return [path for path in project_files(root) if path.suffix in CODE_SUFFIXES]


def read(root, path):
    """Returns a file's text; bytes that are not UTF-8 become marks."""
    return (pathlib.Path(root) / path).read_bytes().decode("utf-8", errors="replace")


def report(what, violations, checked):
    """Prints the violations and returns the exit status."""
    for violation in violations:
        print(violation)
    print(f"{what}: {checked} files, {len(violations)} violations")
    if not checked:
        print("nothing was checked: is the source directory right?")
    return 1 if violations or not checked else 0


def expect(condition, message):
    """A self-test's assertion; active with any flags of the interpreter."""
    if not condition:
        sys.exit(f"self-test failed: {message}")
