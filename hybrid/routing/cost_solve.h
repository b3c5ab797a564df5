// SPDX-License-Identifier: Apache-2.0
// Least squares without negative coefficients, for few unknowns.
#pragma once

#include <cstddef>
#include <vector>

namespace shadowdag {

constexpr size_t kMaxUnknowns = 10; ///< 2^10 sets of them are tried

/// Returns x >= 0 that minimises |A x - b|^2: one coefficient per column. Deterministic; a zero
/// column or a linear combination of others gets 0, and so does the later one of two equal columns.
///
/// The positive coefficients of the best solution are the unconstrained solution in their columns,
/// so the best of all sets of columns whose unconstrained solution is positive is the best of all:
/// exact, where a search from set to set (Lawson, Hanson 1974) has to stop by a tolerance.
/// @param rows A, row by row, of one length, at most kMaxUnknowns
/// @param values b, one a row
std::vector<double> solveNonNegative(const std::vector<std::vector<double>>& rows,
                                     const std::vector<double>& values);

} // namespace shadowdag
