// SPDX-License-Identifier: Apache-2.0
// JSON values as Python objects and back.
#pragma once

#include "tools/settings/json.h"

#include <pybind11/pybind11.h>

#include <string>

namespace shadowdag::python {

/// Returns a JSON value as dict, list, str, int, float, bool or None.
pybind11::object toPython(const Json& value);

/// Returns a Python value as JSON: dict with str keys, list or tuple, str or path, number (of
/// numpy, too), bool, None. An infinite float becomes "inf", as files have it. Throws Error kUsage
/// naming `where` for anything else.
Json jsonOf(const pybind11::handle& value, const std::string& where);

} // namespace shadowdag::python
