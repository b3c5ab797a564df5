// SPDX-License-Identifier: Apache-2.0
// Writes a text as a complete file.
#pragma once

#include <string>

namespace shadowdag {

/// Writes a complete file or none; throws as OutputFile does.
void writeWholeFile(const std::string& path, const std::string& text);

} // namespace shadowdag
