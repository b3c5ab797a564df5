// SPDX-License-Identifier: Apache-2.0
// Which values of a run follow from its times, and so differ between equal runs.
#pragma once

#include <string>

namespace shadowdag {

inline bool isOfTime(const std::string& key) {
    return key.starts_with("time_") || key.find("_ms") != std::string::npos ||
           key == "other_cpu_share" || key == "shown_as";
}

} // namespace shadowdag
