// SPDX-License-Identifier: Apache-2.0
// The rows of results and the values that two of them are compared by; results_diff.h says which.
#pragma once

#include "cuda/quantile_interval.h"
#include "tools/settings/json.h"

#include <nlohmann/json.hpp>

#include <map>
#include <optional>
#include <set>
#include <string>

namespace shadowdag {

enum class ResultDirection { kNeither, kLessIsBetter, kMoreIsBetter };

/// Returns which way a value is better. @param key its last name, "false_shadow_count"
ResultDirection directionOf(const std::string& key);

/// A value of a row: measured with its interval, a set of names, or exact.
struct ResultValue {
    Json exact;
    std::optional<QuantileInterval> measured;
    std::optional<std::set<std::string>> names;
};

using ResultRow = std::map<std::string, ResultValue>;
/// Rows by list, then by name.
using ResultRows = std::map<std::string, std::map<std::string, ResultRow>>;

/// Returns the rows of results. Throws Error kInput, naming file, list and row, where a row is
/// listed twice, a list is none, a count, an error, a size or a time is not a number >= 0 or
/// outside its interval, a count is not whole, a share is above 1, or a row has more wrong or dark
/// pairs than pairs.
/// @param file for messages @param kind as ResultsIdentity @param readsTimes false: leaves them out
ResultRows readRows(const std::string& file, const std::string& kind, bool readsTimes,
                    const Json& results);

} // namespace shadowdag
