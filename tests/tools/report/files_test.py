# SPDX-License-Identifier: Apache-2.0
"""What files of the reports' package keep of those that they replace, by the rules of scenes/file_attributes.cpp. Parts
that need root or access lists are left out without them, and said.

    files_test.py SOURCE_DIR
"""
import os
import pathlib
import struct
import sys
import tempfile

SOURCE = pathlib.Path(sys.argv[1])
sys.path.insert(0, str(SOURCE / "tools/report"))
sys.dont_write_bytecode = True

from shadowdag_report import files  # noqa: E402

NOBODY = 65534
OWNER, USER, GROUP, MASK, OTHERS = 1, 2, 4, 16, 32  # kinds of entries of a list


def equal(is_, should_be):
    if is_ != should_be:
        sys.exit(f"{is_!r} instead of {should_be!r}")


def list_of(*entries):
    """Returns an access list as the system stores it, of (kind, rights) and of (kind, rights, whose)."""
    return struct.pack("<I", 2) + b"".join(struct.pack("<HHI", *entry, *[0xffffffff][len(entry) - 2:]) for entry in entries)


def mode_of(path):
    return oct(os.stat(path).st_mode & 0o7777)


def as_nobody(call, real=NOBODY):
    """Calls a function in a process of the user nobody; returns whether it raised nothing."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.setgroups([])
            os.setgid(NOBODY)
            os.setresuid(real, NOBODY, real)
            call()
            status = 0
        except OSError:
            status = 2
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_a_group_that_cannot_be_kept(path):
    for before, after in ((0o606, 0o600), (0o604, None), (0o662, 0o622), (0o666, 0o666)):
        os.chown(path, 0, 65533)
        os.chmod(path, before)
        equal(as_nobody(lambda: files.write_text(path, "new")), after is not None)  # nobody may not write 0604
        equal(mode_of(path), oct(before if after is None else after))


def test_a_list_of_a_group_that_cannot_be_kept(path):
    os.chown(path, 0, 65533)
    denying = list_of((OWNER, 6), (USER, 0, 4711), (GROUP, 6), (MASK, 6), (OTHERS, 6))
    try:
        os.setxattr(path, files.ACCESS_LIST, denying)
    except OSError as error:
        print(f"  skipped: {error}")
        return
    equal(as_nobody(lambda: files.write_text(path, "new")), True)
    equal(mode_of(path), "0o600")


def test_the_effective_user_is_asked_for(path):
    os.chown(path, 0, 0)
    os.chmod(path, 0o644)
    equal(as_nobody(lambda: files.write_text(path, "new"), real=0), False)


def test_a_list_that_the_system_refuses(path):
    refused = list_of((OWNER, 6), (USER, 4, 4711), (GROUP, 6), (OTHERS, 6))  # a named user without a mask
    files.give_attributes(path, 0o666, os.geteuid(), os.getegid(), refused)
    equal(mode_of(path), "0o644")


for test in [value for name, value in list(globals().items()) if name.startswith("test_")]:
    if os.geteuid() != 0 and test is not test_a_list_that_the_system_refuses:
        print(f"{test.__name__}: skipped, only root can be another user")
        continue
    with tempfile.TemporaryDirectory() as name:
        os.chmod(name, 0o777)
        file = os.path.join(name, "a")
        files.write_text(file, "old")
        test(file)
    print(f"{test.__name__}: ok")
