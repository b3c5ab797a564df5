// SPDX-License-Identifier: Apache-2.0
// The exceptions of the module: one class for each kind of error of the library.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace shadowdag::python {

/// Adds Error, UsageError, InputError, ResourceError, DeviceError, DefectError and Warning to the
/// scope, and translates exceptions of the library to them, with their own messages.
void addErrors(pybind11::module_& scope);

/// Throws Error kUsage for an argument with a zero byte, which would end every message about it.
void refuseZeroByte(const std::string& argument);

/// Returns a path that is given as str or os.PathLike, in the bytes of the file system. Throws
/// py::type_error for anything else.
std::string pathOf(const pybind11::object& path);

/// Returns a text of the library in Python; bytes that are not UTF-8, as names of files may have,
/// are as os.listdir gives them.
pybind11::str textObject(const std::string& text);

} // namespace shadowdag::python
