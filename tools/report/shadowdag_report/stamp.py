# SPDX-License-Identifier: Apache-2.0
"""The stamp of a chart: a hash of the data that it was drawn from, with the command and the version of its drawing. It
stands in the metadata of the SVG and in a text chunk of the PNG, so that a chart that is older than its data is found.
"""
import hashlib
import os
import re
import struct
import zlib

KEYWORD = "shadowdag-data"
# Raise the number of a command when its drawing changes: charts of earlier drawings are then stale.
VERSIONS = {"charts": 4, "figures": 2, "stability-charts": 1, "mechanisms-chart": 2, "regret": 2, "bias": 1, "layouts": 1,
            "frame": 3, "main": 3, "scale-chart": 1}
PNG_HEAD = b"\x89PNG\r\n\x1a\n"


def stamp_of(command, paths):
    """Returns the stamp of the charts that a command draws from files: the command, its version, 16 digits of a hash."""
    digest = hashlib.sha256()
    for path in paths:
        with open(path, "rb") as file:
            content = file.read()
        digest.update(f"{len(content)}:".encode() + content)
    return f"{command} {VERSIONS.get(command, 0)} {digest.hexdigest()[:16]}"


def stamp_of_arguments(command, arguments):
    """The same for those arguments of a command that are files."""
    return stamp_of(command, [a for a in arguments if os.path.isfile(a)])


def metadata(kind, stamp):
    """Returns the metadata of savefig. kind: svg or png; stamp: "" for none"""
    if kind == "svg":
        return {"Date": None} | ({"Description": f"{KEYWORD}: {stamp}"} if stamp else {})
    return {KEYWORD: stamp} if stamp else {}


def stamp_in(path):
    """Returns the stamp of a chart, None for a file without one."""
    with open(path, "rb") as file:
        content = file.read()
    if content.startswith(PNG_HEAD):
        at = len(PNG_HEAD)
        while at + 12 <= len(content):
            length, kind = struct.unpack(">I4s", content[at:at + 8])
            body = content[at + 8:at + 8 + length]
            if kind == b"tEXt" and body.split(b"\0")[0] == KEYWORD.encode():
                return body.split(b"\0", 1)[1].decode("latin-1")
            if kind == b"zTXt" and body.split(b"\0")[0] == KEYWORD.encode():
                return zlib.decompress(body.split(b"\0", 1)[1][1:]).decode("latin-1")
            at += 12 + length
        return None
    found = re.search(KEYWORD.encode() + rb": ([^<]*)", content)
    return found and found.group(1).decode()
