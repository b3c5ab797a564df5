# SPDX-License-Identifier: Apache-2.0
"""What notebooks show of frames, scenes and voxels."""
import html
import struct
import zlib

import numpy as np

from . import _native


def png(picture):
    """Returns a picture in [0, 1], (height, width, 3), as the bytes of a PNG, rounded as the program's are."""
    pixels = (np.clip(picture, 0, 1) * np.float32(255) + np.float32(0.5)).astype(np.uint8)
    height, width = pixels.shape[:2]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, width * 3)], axis=1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b""))


def table(rows):
    """Returns pairs of a name and a value as an HTML table."""
    return "<table>" + "".join(f"<tr><th>{html.escape(str(name))}</th><td>{html.escape(str(value))}</td></tr>"
                               for name, value in rows) + "</table>"


def scene_rows(scene):
    return [("scene", scene.name), ("triangles", len(scene.triangles)), ("lights", len(scene.lights["kind"])),
            ("cameras", ", ".join(scene.cameras) or "automatic"), ("hash", scene.hash)]


def dag_rows(dag):
    info = dag.info()
    return [("resolution", f"{dag.resolution}³"), ("voxel", f"{dag.voxel_size:g} world units"),
            ("voxels", info["voxel_count"]), ("4³ leaves", info["leaf_count"]),
            ("traced bytes", info["traced_bytes"])]


def frame_text(frame):
    return f"<Frame {frame.label}, {frame.size[0]}x{frame.size[1]}, {frame.time_ms:.1f} ms>"


def attach():
    """Gives the classes of the extension their displays."""
    _native.Frame._repr_png_ = lambda self: png(self.picture())
    _native.Frame.__repr__ = frame_text
    for made, rows in ((_native.Scene, scene_rows), (_native.Dag, dag_rows)):
        made._repr_html_ = lambda self, rows=rows: table(rows(self))
        made.__repr__ = lambda self, rows=rows: "<" + ", ".join(f"{n} {v}" for n, v in rows(self)) + ">"
