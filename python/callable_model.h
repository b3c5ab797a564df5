// SPDX-License-Identifier: Apache-2.0
// A cost model written in Python.
#pragma once

#include "hybrid/frame.h"

#include <pybind11/numpy.h>

#include <memory>

namespace shadowdag::python {

/// Makes the type of a map's row known to numpy. Once.
void addMapRows();

/// Returns records as a structured array, copied, so that it outlives the frame.
/// @param isRouted with the fields route (0 rays, 1 map) and pair_count
pybind11::array mapRows(const std::vector<MapRecord>& maps);

/// Returns a model that asks a callable. It receives the quantities of all maps as a structured
/// array and returns one number a map: bool, True for rays, or the cost of drawing the map over
/// that of tracing it. Frames call it without the interpreter's lock, on the thread that renders.
/// What it raises, and py::error_already_set for another result, leaves the frame.
/// @param function may have the attribute `counts`, a list of kCountNames: the counted quantities
/// that it reads; without it all are counted, within the frame's time
std::unique_ptr<CostModel> makeCallableModel(const pybind11::object& function);

} // namespace shadowdag::python
