// SPDX-License-Identifier: Apache-2.0
// Prefix sums and stable sorts with the same result on both backends and for any thread count.
#pragma once

#include "cuda/backend.h"
#include "cuda/view.h"

namespace shadowdag {

/// Writes to out[i] the sum of in[0..i) and returns the sum of all. In place (out == in) is
/// allowed. Sums are taken modulo 2^32; the returned total is 64 bit, so the caller sees an
/// overflow.
uint64_t exclusiveScan(Backend backend, View<const uint32_t> in, View<uint32_t> out);

/// Does the same and returns nothing, so that the host does not wait for it on CUDA.
void prefixSums(Backend backend, View<const uint32_t> in, View<uint32_t> out);

/// Sorts the keys ascending in place and moves `values` along (both of the same count). Stable:
/// equal keys keep their order. An empty `values` sorts keys alone.
void sortPairs(Backend backend, View<uint64_t> keys, View<uint32_t> values);
void sortPairs(Backend backend, View<uint32_t> keys, View<uint32_t> values);

} // namespace shadowdag
