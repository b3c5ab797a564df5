// SPDX-License-Identifier: Apache-2.0
#include "hybrid/routing/cost_solve.h"

#include "cuda/macros.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace shadowdag {

namespace {

/// A pivot below this share of its column's own length is rounding: the column depends on others.
constexpr double kLeastPivot = 1e-10;

using Vector = std::array<double, kMaxUnknowns>;

/// The normal equations, every column scaled to length 1.
struct NormalEquations {
    size_t count = 0;
    std::array<Vector, kMaxUnknowns> matrix{};
    Vector right{}, length{}; ///< length: of the columns before scaling

    NormalEquations(const std::vector<std::vector<double>>& rows, const std::vector<double>& values)
        : count(rows.empty() ? 0 : rows[0].size()) {
        SDAG_ASSERT(count <= kMaxUnknowns && rows.size() == values.size());
        for (size_t r = 0; r < rows.size(); ++r)
            for (size_t i = 0; i < count; ++i) {
                right[i] += rows[r][i] * values[r];
                for (size_t j = 0; j < count; ++j)
                    matrix[i][j] += rows[r][i] * rows[r][j];
            }
        for (size_t i = 0; i < count; ++i)
            length[i] = std::sqrt(matrix[i][i]);
        for (size_t i = 0; i < count; ++i) {
            right[i] = length[i] > 0 ? right[i] / length[i] : 0;
            for (size_t j = 0; j < count; ++j)
                matrix[i][j] =
                    length[i] > 0 && length[j] > 0 ? matrix[i][j] / (length[i] * length[j]) : 0;
        }
    }

    /// Solves for the columns of a set, by Cholesky; returns whether they are independent and all
    /// coefficients positive.
    bool solve(uint32_t columns, Vector& x) const {
        std::array<size_t, kMaxUnknowns> used;
        std::array<Vector, kMaxUnknowns> lower;
        Vector forward;
        size_t size = 0;
        for (size_t column = 0; column < count; ++column) {
            if ((columns >> column & 1u) == 0)
                continue;
            double pivot = matrix[column][column], sum = right[column];
            for (size_t j = 0; j < size; ++j) {
                double entry = matrix[column][used[j]];
                for (size_t k = 0; k < j; ++k)
                    entry -= lower[size][k] * lower[j][k];
                lower[size][j] = entry / lower[j][j];
                pivot -= lower[size][j] * lower[size][j];
                sum -= lower[size][j] * forward[j];
            }
            if (!(pivot > kLeastPivot))
                return false;
            lower[size][size] = std::sqrt(pivot);
            forward[size] = sum / lower[size][size];
            used[size++] = column;
        }
        x = {};
        for (size_t i = size; i-- > 0;) {
            double sum = forward[i];
            for (size_t k = i + 1; k < size; ++k)
                sum -= lower[k][i] * x[used[k]];
            x[used[i]] = sum / lower[i][i];
            if (!(x[used[i]] > 0))
                return false;
        }
        return true;
    }

    /// Returns by how much a solution in its columns lowers the squared error.
    double gain(const Vector& x) const {
        double sum = 0;
        for (size_t i = 0; i < count; ++i)
            sum += right[i] * x[i];
        return sum;
    }
};

} // namespace

std::vector<double> solveNonNegative(const std::vector<std::vector<double>>& rows,
                                     const std::vector<double>& values) {
    const NormalEquations equations(rows, values);
    Vector best{}, x;
    double most = 0;
    for (uint32_t columns = 1; columns < 1u << equations.count; ++columns)
        if (equations.solve(columns, x) && equations.gain(x) > most) {
            most = equations.gain(x);
            best = x;
        }
    std::vector<double> result(equations.count, 0.0);
    for (size_t i = 0; i < result.size(); ++i)
        result[i] = best[i] > 0 ? best[i] / equations.length[i] : 0;
    return result;
}

} // namespace shadowdag
