// SPDX-License-Identifier: Apache-2.0
// The exception type of the project: what went wrong, with what value, where, and what to do.
#pragma once

#include <stdexcept>
#include <string>

namespace shadowdag {

/// The kind of failure that an Error reports; the value is the exit status of the program.
enum class ErrorKind {
    kUsage = 1,    ///< contradictory or unknown options
    kInput = 2,    ///< a bad input file
    kResource = 3, ///< not enough memory or disk
    kDevice = 4,   ///< the requested device is missing or failed
};

/// Thrown for bad input, files, devices and allocations. The message names the file, the offending
/// value and the remedy. A programmer's mistake is SDAG_ASSERT; an expected and frequent event (a
/// full pool, a full list) is a value in the result, never an Error.
class Error : public std::runtime_error {
public:
    Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}

    /// Returns the kind, whose integer value is the exit status.
    ErrorKind kind() const { return kind_; }

private:
    ErrorKind kind_;
};

} // namespace shadowdag
