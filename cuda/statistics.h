// SPDX-License-Identifier: Apache-2.0
// Summary statistics of repeated measurements.
#pragma once

#include "cuda/macros.h"

#include <algorithm>
#include <vector>

namespace shadowdag {

/// Returns the median: of an even count, the mean of the two middle values. values: at least one,
/// none of them NaN.
inline double median(std::vector<double> values) {
    SDAG_ASSERT(!values.empty());
    std::sort(values.begin(), values.end());
    const size_t half = values.size() / 2;
    return values.size() % 2 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

} // namespace shadowdag
