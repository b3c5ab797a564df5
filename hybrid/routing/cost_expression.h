// SPDX-License-Identifier: Apache-2.0
// The cost model that a user writes as an expression. With formula.h the only user of muParser.
#pragma once

#include "hybrid/routing/cost_model.h"

namespace shadowdag {

/// Returns the model of a muParser expression over the names texels, faceTexels, pages, samples,
/// clusters, triangles, batches, lights, range (MapQuantities): a map is traced when the expression
/// is > 0, drawn when it is <= 0 or not a number. The expression is tried once with all names 1.
/// Throws Error kUsage with muParser's reason and the position.
std::unique_ptr<CostModel> makeExpressionModel(const std::string& expression);

} // namespace shadowdag
