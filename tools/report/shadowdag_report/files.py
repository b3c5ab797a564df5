# SPDX-License-Identifier: Apache-2.0
"""Reads results and writes complete files; errors name the file."""
import contextlib
import json
import os


class Refused(Exception):
    """The data are insufficient; the text states the error and the remedy."""


@contextlib.contextmanager
def expecting(path, what):
    """Turns any error of reading a file and its content into a refusal that names the file.

    what: as in "a results file of compare"
    """
    try:
        yield
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise Refused(f"{path}: not {what}: {error!r}") from error


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


@contextlib.contextmanager
def written(path):
    """Returns the name of a file beside `path` to write; replaces `path` by it, or removes it after any error.
    Errors of the system are raised as OSError that names `path`."""
    part = path + ".part"
    try:
        yield part
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


def write_json(path, data, indent=2):
    write_text(path, json.dumps(data, indent=indent) + "\n")
