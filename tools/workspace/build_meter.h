// SPDX-License-Identifier: Apache-2.0
// The cost of a build: time, processor time, memory.
#pragma once

#include "tools/settings/console.h"
#include "tools/settings/json.h"

#include <chrono>

namespace shadowdag {

/// Runs from its construction until stop().
class BuildMeter {
public:
    BuildMeter();
    void stop();
    /// Adds wall_s and cpu_s (of all threads), both between start and stop, and peak_rss_bytes (of
    /// the process so far) to `json`, and prints them.
    void report(const Console& console, Json& json) const;

private:
    std::chrono::steady_clock::time_point start_;
    double processorStart_ = 0, wallSeconds_ = 0, processorSeconds_ = 0;
};

} // namespace shadowdag
