// SPDX-License-Identifier: Apache-2.0
// What a message advises where a file or a folder could not be written.
#pragma once

#include <string>

namespace shadowdag {

/// Returns the remedy of a failed write, creation or rename, without a full stop.
/// @param error errno of the call; 0 if unknown
std::string writeRemedy(int error);

} // namespace shadowdag
