// SPDX-License-Identifier: Apache-2.0
// Intervals of quantiles by order statistics: exact for any distribution of independent values.
// Source: David, Nagaraja, Order Statistics, 2003, sec. 7.1.
#pragma once

#include <cstddef>
#include <vector>

namespace shadowdag {

/// The confidence that published intervals have, if there are enough values for it.
constexpr double kConfidence = 0.95;

/// Ranks of n ascending values, from 0, between which a quantile lies.
struct QuantileRanks {
    size_t low = 0, high = 0;
    double confidence = 0; ///< the exact probability that the quantile lies between them
};

/// Returns the narrowest pair of ranks, cut off equally at both ends, between which the quantile
/// lies with kConfidence at least: of n values, the number of those below it is binomial,
/// P(X[low] <= quantile <= X[high]) = P(low < B <= high) with B ~ Bin(n, quantile).
/// Where n is too small for that, the least and the greatest value and what they hold: of the
/// median of 5 values 0.9375, of the 99th percentile of 120 values 0.70.
/// @param count at least 1 @param quantile in (0, 1)
QuantileRanks quantileRanks(size_t count, double quantile);

/// A quantile of measured values with its interval.
struct QuantileInterval {
    double value = 0, low = 0, high = 0;
    double confidence = 0; ///< see QuantileRanks: kConfidence or more, unless the values are few

    bool isWide() const { return confidence >= kConfidence; }
};

/// Returns the median, as median() has it, with its interval. values: at least one, none NaN.
QuantileInterval medianInterval(std::vector<double> values);
/// Returns the least value that at least the share `quantile` of all values does not exceed, with
/// its interval.
QuantileInterval quantileInterval(std::vector<double> values, double quantile);

} // namespace shadowdag
