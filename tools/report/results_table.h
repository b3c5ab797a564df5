// SPDX-License-Identifier: Apache-2.0
// What a compare prints for people when it is done.
#pragma once

#include "tools/settings/json.h"

#include <ostream>

namespace shadowdag {

/// Prints a line a run: time and error, by scene and frame. @param runs as results.json holds them
void printRuns(std::ostream& out, const Json& runs);

/// Prints a line a configuration of a sequence, over all its frames. @param rows sequence_runs
void printSequences(std::ostream& out, const Json& rows);

} // namespace shadowdag
