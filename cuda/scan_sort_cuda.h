// SPDX-License-Identifier: Apache-2.0
// The CUDA side of scan_sort.h, for its dispatcher alone.
#pragma once

#include "cuda/backend.h"
#include "cuda/view.h"

namespace shadowdag {

void prefixSums(CudaTag, View<const uint32_t> in, View<uint32_t> out);
uint64_t exclusiveScan(CudaTag, View<const uint32_t> in, View<uint32_t> out);
void sortPairs(CudaTag, View<uint64_t> keys, View<uint32_t> values);
void sortPairs(CudaTag, View<uint32_t> keys, View<uint32_t> values);

} // namespace shadowdag
