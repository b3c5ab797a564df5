// SPDX-License-Identifier: Apache-2.0
#include "cuda/quantile_interval.h"

#include "cuda/macros.h"
#include "cuda/statistics.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace shadowdag {

namespace {

/// Returns P(B = k) for k from 0 to n, B ~ Bin(n, p), relative to the likeliest k and then
/// normalised, so that no power underflows.
std::vector<double> binomial(size_t n, double p) {
    std::vector<double> share(n + 1, 0.0);
    const size_t mode = std::min(n, size_t(double(n + 1) * p));
    const double odds = p / (1.0 - p);
    share[mode] = 1.0;
    for (size_t k = mode; k < n; ++k)
        share[k + 1] = share[k] * odds * double(n - k) / double(k + 1);
    for (size_t k = mode; k > 0; --k)
        share[k - 1] = share[k] * double(k) / (odds * double(n - k + 1));
    double sum = 0;
    for (const double s : share)
        sum += s;
    for (double& s : share)
        s /= sum;
    return share;
}

} // namespace

QuantileRanks quantileRanks(size_t count, double quantile) {
    SDAG_ASSERT(count >= 1 && quantile > 0.0 && quantile < 1.0);
    const std::vector<double> share = binomial(count, quantile);
    constexpr double kTail = 0.5 * (1.0 - kConfidence);
    QuantileRanks ranks{0, count - 1, 1.0};
    double below = share[0], above = share[count]; // outside of the ranks
    while (ranks.low < count - 1 && below + share[ranks.low + 1] <= kTail)
        below += share[++ranks.low];
    while (ranks.high > 0 && above + share[ranks.high] <= kTail)
        above += share[ranks.high--];
    ranks.confidence = 1.0 - below - above;
    return ranks;
}

QuantileInterval medianInterval(std::vector<double> values) {
    const QuantileRanks ranks = quantileRanks(values.size(), 0.5);
    const double middle = median(values);
    std::sort(values.begin(), values.end());
    return {middle, values[ranks.low], values[ranks.high], ranks.confidence};
}

QuantileInterval quantileInterval(std::vector<double> values, double quantile) {
    const QuantileRanks ranks = quantileRanks(values.size(), quantile);
    std::sort(values.begin(), values.end());
    const double place = std::ceil(quantile * double(values.size()));
    return {values[size_t(std::max(place, 1.0)) - 1], values[ranks.low], values[ranks.high],
            ranks.confidence};
}

} // namespace shadowdag
