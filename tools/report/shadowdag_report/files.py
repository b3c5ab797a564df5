# SPDX-License-Identifier: Apache-2.0
"""Reads results and writes complete files; errors name the file."""
import contextlib
import errno
import fcntl
import glob
import json
import os
import re
import struct


class Refused(Exception):
    """The data are insufficient; the text states the error and the remedy."""


WRONG_CONTENT = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)


@contextlib.contextmanager
def expecting(path, what, errors=(OSError, *WRONG_CONTENT)):
    """Turns any error of reading a file and its content into a refusal that names the file.

    what: as in "a results file of compare"; errors: WRONG_CONTENT where files are written, too
    """
    try:
        yield
    except errors as error:
        raise Refused(f"{path}: not {what}: {fault_of(error)}; make it again") from error


def fault_of(error):
    """Returns what is wrong with a file, in few words, by the error of reading it or of what uses its content."""
    if isinstance(error, OSError):
        return f"cannot be read: {error.strerror or error}"
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is not UTF-8"
    if isinstance(error, json.JSONDecodeError):
        return f"no JSON at line {error.lineno}, column {error.colno}: {error.msg}"
    if isinstance(error, RecursionError):
        return "nests too deep"
    if isinstance(error, KeyError):
        return f"lacks {str(error)[:80]}"
    return f"a value of the wrong kind ({str(error)[:80]})"


def read_json(path):
    with open(path, encoding="utf-8-sig") as file:
        return json.load(file)


MARK = ".tmp-"  # then the process, '-' and a number
ACCESS_LIST = "system.posix_acl_access"


def remove_abandoned(path):
    """Removes the unfinished files of an output whose processes are gone and that nobody has locked."""
    for name in glob.glob(glob.escape(path + MARK) + "*"):
        match = re.fullmatch(r"([1-9][0-9]*)-[0-9]+", name[len(path + MARK):])
        with contextlib.suppress(OSError, OverflowError):
            if match and not is_running(int(match[1])):
                with open(name, "rb") as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    os.remove(name)


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def attributes_of(path):
    """Returns mode, owner, group and access list of a file as scenes/file_attributes.cpp does; None if there is none."""
    try:
        status = os.stat(path)
    except FileNotFoundError:
        return None
    access_list = None
    with contextlib.suppress(OSError):
        access_list = os.getxattr(path, ACCESS_LIST)
    return status.st_mode & 0o777, status.st_uid, status.st_gid, access_list


def give_attributes(path, mode, owner, group, access_list):
    """Gives them to another file, by the same rules: nobody but this user gets more rights than before."""
    has_group = is_done(os.chown, path, owner, group) or is_done(os.chown, path, -1, group)
    is_listed = has_group and access_list is not None and is_done(os.setxattr, path, ACCESS_LIST, access_list)
    if not is_listed:
        is_done(os.removexattr, path, ACCESS_LIST)
    if not has_group or not (is_listed or access_list is None):
        rights = rights_of_all(mode, access_list or b"")
        mode = mode & 0o700 | rights << 3 | rights
    os.chmod(path, mode)


def rights_of_all(mode, access_list):
    """Returns the rights, 0 to 7, that the owner, the group, all others and every entry of a list have."""
    rights = mode >> 6 & mode >> 3 & mode & 7
    for entry in struct.iter_unpack("<HHI", access_list[4:]):  # the kind, the rights, whose; after the version
        rights &= entry[1]
    return rights


def is_done(call, *arguments):
    """Calls a function of the system; returns whether it succeeded."""
    try:
        call(*arguments)
    except OSError:
        return False
    return True


@contextlib.contextmanager
def written(path):
    """Returns the name of a file beside `path` to write; replaces `path` by it, with the attributes of `path`, or
    removes it after any error. Errors of the system are raised as OSError that names `path`. The name is of the form
    that the program's own unfinished files have (scenes/output_file.cpp), so two writers have two, and the same rule
    removes dead ones."""
    remove_abandoned(path)
    part = f"{path}{MARK}{os.getpid()}-0"
    old = attributes_of(path)
    if old is not None and not old[0] & 0o222:
        raise PermissionError(errno.EACCES, "it is read-only", path)
    if old is not None and not os.access(path, os.W_OK, effective_ids=True):
        raise PermissionError(errno.EACCES, "this user may not write it", path)
    try:
        with open(part, "wb", opener=lambda name, flags: os.open(name, flags, 0o666 if old is None else 0o600)) as file:
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield part
        old = attributes_of(path) or old
        if old is not None:
            give_attributes(part, *old)
        os.replace(part, path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            os.remove(part)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), path) from error
        raise


def write_text(path, text):
    with written(path) as part, open(part, "w", encoding="utf-8") as file:
        file.write(text)


def replace_marked(document, markers, text, is_check, what):
    """Replaces what stands between two marker lines of a file; with `is_check` the file is refused when it differs.

    what: names the text in the refusal, with its remedy
    """
    begin, end = markers
    with expecting(document, "a text file"), open(document, encoding="utf-8") as file:
        before = file.read()
    if before.count(begin) != 1 or before.count(end) != 1:
        raise Refused(f"{document}: needs exactly one line '{begin}' and one '{end}'")
    updated = before.split(begin)[0] + begin + "\n" + text + "\n" + end + before.split(end)[1]
    if is_check and updated != before:
        raise Refused(f"{document}: differs from {what}")
    if not is_check:
        write_text(document, updated)


def write_json(path, data, indent=2):
    write_text(path, json.dumps(data, indent=indent) + "\n")
