// SPDX-License-Identifier: Apache-2.0
// Tells the user that a result is less than was asked for, from code that returns no text.
#pragma once

#include <string>

namespace shadowdag {

/// Sets the function that receives warnings, for the whole process, on the thread that works.
/// Null, as it is at first: a line on standard error.
void setWarningListener(void (*listener)(const std::string& text));

/// Gives a warning, a sentence without its final period, to that function.
void warn(const std::string& text);

} // namespace shadowdag
