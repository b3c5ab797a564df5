// SPDX-License-Identifier: Apache-2.0
// What results were measured of: whether two of them may be compared.
#pragma once

#include "tools/settings/json.h"

#include <nlohmann/json.hpp>

#include <string>

namespace shadowdag {

/// What a set of results belongs to.
struct ResultsIdentity {
    std::string kind; ///< "compare", "study failures", "validate", ...
    Json experiment;  ///< what was asked for, without texts for readers and recorded counts
    Json scenes;      ///< hash of what is voxelized, by scene
    Json contents;    ///< hash of triangles and lights by scene, of results that have it
    Json machine;     ///< what times depend on
    Json program;     ///< commit, compiler, flags: may differ
};

/// Returns the identity of results of any command that writes JSON; an empty kind for anything
/// else.
ResultsIdentity identityOf(const Json& results);

/// Returns what to say before a report in a directory is replaced by one of another command or
/// experiment, "" if there is none there.
/// @param fresh what identityOf reads of the new one: "study", or "runs", "map_costs", "experiment"
std::string remarkOnReplaced(const std::string& directory, const Json& fresh);

/// Returns whether a value is the result of `fit`, which identityOf does not know.
bool isFitResult(const Json& json);

/// Throws Error kUsage if the file of an option holds results of a command, which may have taken
/// hours to measure. @param allowed the command whose results it may replace: "calibrate", "fit"
void refuseToReplaceResults(const std::string& option, const std::string& path,
                            const std::string& allowed);

/// Takes the number of rounds and of warm-ups out of the experiment: no count depends on them.
void leaveOutRounds(ResultsIdentity& identity);

/// Returns the first difference in the hashes of scenes that both have, "" if there is none.
std::string firstOtherScene(const ResultsIdentity& a, const ResultsIdentity& b);

} // namespace shadowdag
