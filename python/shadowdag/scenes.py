# SPDX-License-Identifier: Apache-2.0
"""Scenes from numpy arrays."""
import os

import numpy as np

from . import _native
from ._native import UsageError

KINDS = {"point": 0, "spot": 1, "directional": 2}
COLUMNS = 13  # position, direction, intensity, range, kind, inner and outer cone angle


def lights(position, intensity=1.0, direction=(0.0, -1.0, 0.0), range=0.0, kind="point", inner=0.0, outer=0.7853982):
    """Returns rows of lights for scene(), float64, (n, 13). Every argument is one value for all lights or one a light.

    position: (n, 3) or (3,), world units. intensity: candela (lux of directional lights), a number or RGB,
    finite and at least 0.
    direction: of spot and directional lights, of any length. range: world units, beyond which the light is zero;
    0: where it falls below 0.05 lux. kind: point, spot or directional. inner, outer: cone angles of spots, radians.
    """
    position = np.atleast_2d(np.asarray(position, np.float64))
    count = len(position)
    rows = np.zeros((count, COLUMNS))
    rows[:, 0:3] = position
    rows[:, 3:6] = direction
    intensity = np.asarray(intensity, np.float64)
    rows[:, 6:9] = intensity[:, None] if intensity.ndim == 1 and len(intensity) == count != 3 else intensity
    rows[:, 9] = range
    kinds = [kind] * count if isinstance(kind, str) else list(kind)
    unknown = [k for k in kinds if k not in KINDS]
    if unknown:
        raise UsageError(f"kind {unknown[0]!r}: must be one of {', '.join(KINDS)}")
    rows[:, 10] = [KINDS[k] for k in kinds]
    rows[:, 11], rows[:, 12] = inner, outer
    return rows


def camera_numbers(camera):
    """Returns a camera as text: of 6 to 10 numbers, or text as it is."""
    if isinstance(camera, str):
        return camera
    return ",".join(repr(float(number)) for number in np.asarray(camera, np.float64).ravel())


def scene(vertices, triangles, lights=None, cameras=None, *, color=(0.8, 0.8, 0.8), name="arrays", placed_lights=-1,
          light_seed=1, backend="auto", cache=""):
    """Returns a Scene of arrays, which are copied once.

    vertices: (n, 3), world units. triangles: (m, 3), indices into vertices; both sides are seen.
    lights: rows of lights(), or (n, 3): point lights of 1 candela at these points; None: none, see placed_lights.
    cameras: a dict of names, or one camera, each px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]] as numbers or
    text; None: an automatic one. color: of all surfaces, linear RGB. placed_lights, light_seed, backend, cache: as
    load() has lights, light_seed, backend and cache.
    Raises UsageError naming the row of an index out of range, a coordinate that is not finite or an intensity below 0.
    """
    triangles = np.asarray(triangles)
    if triangles.size and triangles.dtype.kind not in "iu":
        raise UsageError(f"triangles holds {triangles.dtype}; indices are whole numbers")
    rows = np.zeros((0, COLUMNS)) if lights is None else np.atleast_2d(np.asarray(lights, np.float64))
    if rows.shape[1] == 3:
        rows = globals()["lights"](rows)
    named = {} if cameras is None else cameras if isinstance(cameras, dict) else {"camera": cameras}
    arrays = {
        "vertices": np.asarray(vertices), "triangles": triangles.reshape(-1, 3) if triangles.size == 0 else triangles,
        "lights": rows, "cameras": {key: camera_numbers(value) for key, value in named.items()},
        "color": np.broadcast_to(np.asarray(color, np.float64), (3,)).reshape(1, 3),
    }
    return _native.scene_of_arrays(arrays, name, placed_lights, light_seed, backend, os.fspath(cache))
