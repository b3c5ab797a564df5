// SPDX-License-Identifier: Apache-2.0
// Formulas over named numbers, as files of studies have them. With cost_expression.h the only door
// to muParser.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

using FormulaNames = std::vector<std::pair<const char*, double>>;

/// Returns the value of a muParser expression over the names. Throws Error kUsage with muParser's
/// reason and the position, and where it has not one value.
double evaluateFormula(const std::string& formula, const FormulaNames& names);

} // namespace shadowdag
