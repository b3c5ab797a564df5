# SPDX-License-Identifier: Apache-2.0
"""Frames of a scene, and where their pairs lie in the picture."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._native import Frame, Scene
from .scenes import camera_numbers


def frame(self: Scene, settings: Mapping[str, Any] | None = None, /, *, record: bool = True,
          progress: Callable[[str, float], Any] | None = None, **more: Any) -> Frame:
    """Renders one frame and returns it as a Frame.

    settings, more: the settings of the frame, as a dict or as keywords: method, model, variant, costs, time, resolution
    and those of experiment files; frame_settings() lists them with defaults and help. `model` may be a function: see
    cost_model; `size` a pair as Frame.size has it; `camera` 6 to 10 numbers, as scene() has them. A bad value, an unknown
    key and a setting that the method does not read raise UsageError, with the program's own messages. record=False keeps
    no pairs and counts nothing for reports, as frames are timed.
    progress: callable (what, fraction in [0, 1]).
    Every frame depends on its settings alone, not on frames before. Deterministic but for times.
    """
    asked = {**(settings or {}), **more}
    if isinstance(asked.get("size"), (tuple, list)) and len(asked["size"]) == 2:
        asked["size"] = "{}x{}".format(*asked["size"])
    if isinstance(asked.get("camera"), (tuple, list, np.ndarray)):
        asked["camera"] = camera_numbers(asked["camera"])
    return _native.render(self, asked, record, progress)


def pixels_of_pairs(frame: Frame) -> NDArray[np.uint32]:
    """Returns the pixel of each pair, uint32, (pairs, 2): x to the right and y down."""
    first = frame.first_pair
    sample = np.repeat(np.arange(len(first) - 1, dtype=np.uint32), np.diff(first).astype(np.int64))
    width = np.uint32(frame.size[0])
    return np.stack([sample % width, sample // width], axis=1)


def worst_pixels(frame: Frame, count: int = 10) -> list[tuple[int, int, NDArray[np.intp]]]:
    """Returns the pixels with most wrong pairs: a list of (x, y, indices of the wrong pairs), the worst first."""
    wrong = np.flatnonzero(frame.judge()["verdicts"] != 0)
    pixels = pixels_of_pairs(frame)[wrong].astype(np.int64)
    sample = pixels[:, 1] * frame.size[0] + pixels[:, 0]
    order, counts = np.unique(sample, return_counts=True)
    worst = order[np.lexsort((order, -counts))][:count]
    return [(int(s % frame.size[0]), int(s // frame.size[0]), wrong[sample == s]) for s in worst]
