# SPDX-License-Identifier: Apache-2.0
"""Shadows from many lights: voxel DAG rays, virtual shadow maps and hybrids, judged against Embree.

    import shadowdag as sd
    scene = sd.load("builtin:atrium")
    frame = scene.frame(method="hybrid", model="texels:96", size="320x180")
    frame.judge()["counts"]

Coordinates are world units (metres), right-handed, y up. Arrays that the library owns are read-only and shared, not
copied. Errors are classes of `Error`; Ctrl-C raises KeyboardInterrupt. docs/python.md is the chapter about it.
"""
try:
    from ._native import (SERVERS, VERDICTS, Dag, DefectError, DeviceError, Error, Frame, InputError, ResourceError, Scene,
                          UsageError, Warning, __commit__, __version__, allow_outside, builtin_scenes, built_with_cuda,
                          frame_settings, load, load_asset, set_threads, threads)
except ImportError as error:
    import glob
    import importlib.machinery
    import os
    import sys
    built = [os.path.basename(path) for path in glob.glob(os.path.join(os.path.dirname(__file__), "_native*.so"))]
    if not built or any(name.endswith(importlib.machinery.EXTENSION_SUFFIXES[0]) for name in built):
        raise
    raise ImportError("shadowdag was built for another Python: {} is not for {}, Python {}.{}; run the one that it was built "
                      "for, as /usr/bin/python3".format(", ".join(built), sys.executable, *sys.version_info[:2])) from error
from .display import attach
from .frames import frame, pixels_of_pairs, worst_pixels
from .measuring import cost_model, measure
from .program import calibrate, compare, program, run_program, study
from .results import Results, load_results
from .scenes import lights, scene

Scene.frame = frame
attach()

__all__ = [
    "SERVERS", "VERDICTS", "Dag", "DefectError", "DeviceError", "Error", "Frame", "InputError", "ResourceError",
    "Results", "Scene", "UsageError", "Warning", "allow_outside", "builtin_scenes", "built_with_cuda", "calibrate",
    "compare", "cost_model", "frame_settings", "lights", "load", "load_asset", "load_results", "measure",
    "pixels_of_pairs", "program", "run_program", "scene", "set_threads", "study", "threads", "worst_pixels",
]
