# SPDX-License-Identifier: Apache-2.0
"""Scenes from numpy arrays."""
from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import Scene, UsageError

KINDS = {"point": 0, "spot": 1, "directional": 2}
COLUMNS = 13  # position, direction, intensity, range, kind, inner and outer cone angle


def filled(rows, name, value):
    """Writes a value for all lights, or one a light, into their columns. Raises UsageError naming the argument."""
    value = np.asarray(value, np.float64)
    try:
        rows[:] = value if rows.shape[1] > 1 else value.reshape(-1, 1)
    except ValueError:
        raise UsageError(f"{name} has the shape {value.shape}; it must be one value for all {len(rows)} lights, or one a "
                         "light") from None


def lights(position: ArrayLike, intensity: ArrayLike = 1.0, direction: ArrayLike = (0.0, -1.0, 0.0), range: ArrayLike = 0.0,
           kind: str | Sequence[str] = "point", inner: ArrayLike = 0.0, outer: ArrayLike = 0.7853982) -> NDArray[np.float64]:
    """Returns rows of lights for scene(), float64, (n, 13). Every argument is one value for all lights or one a light.

    position: (n, 3) or (3,), world units. intensity: candela (lux of directional lights), a number or RGB for all, (n,)
    or (n, 3); from 0 to 1e30.
    direction: of spot and directional lights, of any length. range: world units, beyond which the light is zero;
    0: where it falls below 0.05 lux. kind: point, spot or directional. inner, outer: cone angles of spots, radians,
    0 <= inner < outer <= pi / 2.
    Raises UsageError naming an argument of the wrong shape, or an unknown kind; scene() checks the values.
    """
    position = np.atleast_2d(np.asarray(position, np.float64))
    count = len(position)
    if position.ndim != 2 or position.shape[1] != 3:
        raise UsageError(f"position has the shape {position.shape}; it must be (n, 3), or (3,) for one light")
    rows = np.zeros((count, COLUMNS))
    rows[:, 0:3] = position
    filled(rows[:, 3:6], "direction", direction)
    intensity = np.asarray(intensity, np.float64)
    if intensity.shape == (3,) and count == 3:
        raise UsageError("intensity has three numbers for three lights: one a light, or RGB for all? Give the shape (3, 1) "
                         "or (3, 3)")
    filled(rows[:, 6:9], "intensity", intensity[:, None] if intensity.shape == (count,) and count > 1 else intensity)
    filled(rows[:, 9:10], "range", range)
    kinds = [kind] * count if isinstance(kind, str) else list(kind)
    unknown = [k for k in kinds if k not in KINDS]
    if unknown:
        raise UsageError(f"kind {unknown[0]!r}: must be one of {', '.join(KINDS)}")
    filled(rows[:, 10:11], "kind", [KINDS[k] for k in kinds])
    filled(rows[:, 11:12], "inner", inner)
    filled(rows[:, 12:13], "outer", outer)
    return rows


def camera_numbers(camera: str | ArrayLike) -> str:
    """Returns a camera as text: of 6 to 10 numbers, or text as it is."""
    if isinstance(camera, str):
        return camera
    return ",".join(repr(float(number)) for number in np.asarray(camera, np.float64).ravel())


def scene(vertices: ArrayLike, triangles: ArrayLike, lights: ArrayLike | None = None,
          cameras: Mapping[str, str | ArrayLike] | str | ArrayLike | None = None, *, color: ArrayLike = (0.8, 0.8, 0.8),
          name: str = "arrays", placed_lights: int = -1, light_seed: int = 1, backend: str = "auto",
          cache: str | os.PathLike[str] = "") -> Scene:
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
