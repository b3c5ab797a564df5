// SPDX-License-Identifier: Apache-2.0
// results.csv and index.html out of what a compare found.
#pragma once

#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns one line a run: scalars, then parameters and stages as columns of their own.
std::string runsCsv(const Json& runs);

/// Returns one line an object; keys of the first are the columns.
std::string flatCsv(const Json& rows);

/// Returns the report as one HTML page that refers to pictures and charts by relative names and to
/// nothing else.
/// @param results as results.json holds it
/// @param charts what charts.py wrote to charts.json, or null
std::string reportHtml(const Json& results, const Json& charts);

} // namespace shadowdag
