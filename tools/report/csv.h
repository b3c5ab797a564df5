// SPDX-License-Identifier: Apache-2.0
// Rows of JSON as comma-separated values.
#pragma once

#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns one line per run: scalars, then parameters and stages as separate columns.
std::string runsCsv(const Json& runs);

/// Returns one line per object; keys of the first are the columns.
std::string flatCsv(const Json& rows);

} // namespace shadowdag
