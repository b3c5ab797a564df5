// SPDX-License-Identifier: Apache-2.0
#include "hybrid/routing/formula.h"

#include "cuda/error.h"

#include <muParser.h>

namespace shadowdag {

double evaluateFormula(const std::string& formula, const FormulaNames& names) {
    std::vector<double> values;
    for (const auto& [name, value] : names)
        values.push_back(value);
    try {
        mu::Parser parser;
        for (size_t i = 0; i < names.size(); ++i)
            parser.DefineVar(names[i].first, &values[i]);
        parser.SetExpr(formula);
        int resultCount = 0;
        const mu::value_type* const results = parser.Eval(resultCount);
        if (resultCount != 1)
            throw Error(ErrorKind::kUsage, "formula '" + formula + "' has " +
                                               std::to_string(resultCount) +
                                               " values separated by commas; use one");
        return results[0];
    } catch (const mu::Parser::exception_type& error) {
        std::string known;
        for (const auto& [name, value] : names)
            known += (known.empty() ? "" : ", ") + std::string(name);
        throw Error(ErrorKind::kUsage, "formula '" + formula + "': " + error.GetMsg() +
                                           " (at position " + std::to_string(error.GetPos()) +
                                           "); it may use " + known);
    }
}

} // namespace shadowdag
