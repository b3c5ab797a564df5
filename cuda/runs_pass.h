// SPDX-License-Identifier: Apache-2.0
// The passes of runs.h, for its dispatcher alone.
#pragma once

#include "cuda/runs.h"

namespace shadowdag::cpu {
void markRunStarts(const MarkRunStarts& work);
void listRunStarts(const ListRunStarts& work);
} // namespace shadowdag::cpu
namespace shadowdag::cuda {
void markRunStarts(const MarkRunStarts& work);
void listRunStarts(const ListRunStarts& work);
} // namespace shadowdag::cuda
