// SPDX-License-Identifier: Apache-2.0
// Bit counting functions for the CPU and CUDA.
#pragma once

#include "cuda/macros.h"

#include <bit>
#include <cstdint>

namespace shadowdag {

/// Returns how many bits are set.
SDAG_HD inline uint32_t bitCount32(uint32_t bits) {
#if defined(__CUDA_ARCH__)
    return uint32_t(__popc(bits));
#else
    return uint32_t(std::popcount(bits));
#endif
}

/// Returns the number of the lowest bit set; bits must not be 0.
SDAG_HD inline uint32_t lowestBit32(uint32_t bits) {
#if defined(__CUDA_ARCH__)
    return uint32_t(__ffs(int(bits))) - 1;
#else
    return uint32_t(std::countr_zero(bits));
#endif
}

/// Returns the number of the highest bit set; bits must not be 0.
SDAG_HD inline uint32_t highestBit32(uint32_t bits) {
#if defined(__CUDA_ARCH__)
    return 31u - uint32_t(__clz(int(bits)));
#else
    return 31u - uint32_t(std::countl_zero(bits));
#endif
}

} // namespace shadowdag
