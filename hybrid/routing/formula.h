// SPDX-License-Identifier: Apache-2.0
// Formulas over named numbers, used by study files. With cost_expression.h the only user of
// muParser.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

using FormulaNames = std::vector<std::pair<const char*, double>>;

/// Returns the value of a muParser expression over the names. Throws Error kUsage with muParser's
/// reason and the position, and if it does not have exactly one value.
double evaluateFormula(const std::string& formula, const FormulaNames& names);

} // namespace shadowdag
