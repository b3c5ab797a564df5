// SPDX-License-Identifier: Apache-2.0
// Rows of JSON as comma-separated values.
#pragma once

#include "tools/settings/json.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Returns one line per run: scalars, then parameters and stages as separate columns.
std::string runsCsv(const Json& runs);

/// Returns one line per object; all their keys are the columns, in the order in which they first
/// occur, without those in `omitted`.
std::string flatCsv(const Json& rows, const std::vector<std::string>& omitted = {});

} // namespace shadowdag
