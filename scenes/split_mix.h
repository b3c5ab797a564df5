// SPDX-License-Identifier: Apache-2.0
// Seeded bits that are the same on every machine.
#pragma once

#include <cstdint>

namespace shadowdag {

/// The increment of SplitMix64's state per number.
constexpr uint64_t kSplitMixGamma = 0x9e3779b97f4a7c15u;

/// Returns the number that SplitMix64 draws in state `x`; its state is x + kSplitMixGamma then.
/// Source: Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, OOPSLA 2014.
inline uint64_t splitMix64(uint64_t x) {
    x += kSplitMixGamma;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

} // namespace shadowdag
