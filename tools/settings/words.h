// SPDX-License-Identifier: Apache-2.0
// Numbers and lists in sentences that people read.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// Returns a count with its unit: "1 row", "0 rows", "2 rows".
/// @param unit singular; its plural is formed with "s"
std::string countText(uint64_t count, const std::string& unit);

/// Returns alternatives: "", "a", "a or b", "a, b or c".
std::string orText(const std::vector<std::string>& names);

} // namespace shadowdag
