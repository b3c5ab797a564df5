// SPDX-License-Identifier: Apache-2.0
// The table that a compare prints at its end.
#pragma once

#include "tools/settings/json.h"

#include <ostream>
#include <string>

namespace shadowdag {

/// Returns the bytes of a run's shadow data: the DAG, the triangles of exact rays with what is
/// built over them, and the maps. @param run in the form of results.json
double shadowBytes(const Json& run);

/// Returns the interval of `key` as text, "2.10 to 3.50", with the confidence behind it where that
/// is below 95 %: the values were too few; "-" where the object has none, as older results.
std::string intervalText(const Json& of, const std::string& key);

/// Prints one line per run: time, error and memory, by scene and frame. @param runs in the form of
/// results.json
void printRuns(std::ostream& out, const Json& runs);

/// Prints one line per configuration of a sequence, over all its frames. @param rows sequence_runs
void printSequences(std::ostream& out, const Json& rows);

} // namespace shadowdag
