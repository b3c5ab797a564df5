// SPDX-License-Identifier: Apache-2.0
// Writing the files of a report.
#pragma once

#include <string>

namespace shadowdag {

/// Writes a whole file or none; throws as OutputFile does.
void writeWholeFile(const std::string& path, const std::string& text);

} // namespace shadowdag
