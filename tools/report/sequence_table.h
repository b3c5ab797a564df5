// SPDX-License-Identifier: Apache-2.0
// Frames in sequence as a table of the report.
#pragma once

#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns a heading and a table with a line a scene and configuration, over its frames.
/// @param rows sequence_runs of results.json
std::string sequenceTableHtml(const Json& rows);

} // namespace shadowdag
