// SPDX-License-Identifier: Apache-2.0
// Writing a text as a whole file.
#pragma once

#include <string>

namespace shadowdag {

/// Writes a whole file or none; throws as OutputFile does.
void writeWholeFile(const std::string& path, const std::string& text);

} // namespace shadowdag
