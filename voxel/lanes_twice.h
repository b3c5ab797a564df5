// SPDX-License-Identifier: Apache-2.0
// Two vectors as one of twice the lanes, for the kernels that are compiled once per instruction
// set, so that the work per packet is shared by more rays. LAYOUT.md has the measured widths.
#pragma once

#include "voxel/ray_slabs_leaf.h" // kLargestScale

#include <cstdint>

namespace shadowdag::stream {
namespace {

/// V with two of its vectors as one; 32 lanes at most.
template <class V> struct Twice {
    static constexpr uint32_t kWidth = 2 * V::kWidth;
    static constexpr uint32_t kHalf = (1u << V::kWidth) - 1;
    static_assert(kWidth <= 32, "lanes are bits of 32");
    struct Floats {
        typename V::Floats low, high;
    };
    struct Mask {
        typename V::Mask low, high;
        operator uint32_t() const { return (uint32_t(low) & kHalf) | uint32_t(high) << V::kWidth; }
    };

    static Floats splat(float v) { return {V::splat(v), V::splat(v)}; }
    static Floats load(const float* from) { return {V::load(from), V::load(from + V::kWidth)}; }
    static void store(float* to, const Floats& v) {
        V::store(to, v.low);
        V::store(to + V::kWidth, v.high);
    }
    static Floats gather(const float* base, const uint32_t* index) {
        return {V::gather(base, index), V::gather(base, index + V::kWidth)};
    }
    static float lane(const Floats& v, uint32_t i) {
        return i < V::kWidth ? V::lane(v.low, i) : V::lane(v.high, i - V::kWidth);
    }
    static Floats add(const Floats& a, const Floats& b) {
        return {V::add(a.low, b.low), V::add(a.high, b.high)};
    }
    static Floats sub(const Floats& a, const Floats& b) {
        return {V::sub(a.low, b.low), V::sub(a.high, b.high)};
    }
    static Floats mul(const Floats& a, const Floats& b) {
        return {V::mul(a.low, b.low), V::mul(a.high, b.high)};
    }
    static Floats div(const Floats& a, const Floats& b) {
        return {V::div(a.low, b.low), V::div(a.high, b.high)};
    }
    static Floats fma(const Floats& a, const Floats& b, const Floats& c) {
        return {V::fma(a.low, b.low, c.low), V::fma(a.high, b.high, c.high)};
    }
    static Floats root(const Floats& a) { return {V::root(a.low), V::root(a.high)}; }
    static Floats lesser(const Floats& a, const Floats& b) {
        return {V::lesser(a.low, b.low), V::lesser(a.high, b.high)};
    }
    static Floats greater(const Floats& a, const Floats& b) {
        return {V::greater(a.low, b.low), V::greater(a.high, b.high)};
    }
    static Floats absolute(const Floats& a) { return {V::absolute(a.low), V::absolute(a.high)}; }
    static Mask less(const Floats& a, const Floats& b) {
        return {V::less(a.low, b.low), V::less(a.high, b.high)};
    }
    static Mask lessOrEqual(const Floats& a, const Floats& b) {
        return {V::lessOrEqual(a.low, b.low), V::lessOrEqual(a.high, b.high)};
    }
    static Floats select(Mask which, const Floats& a, const Floats& b) {
        return {V::select(which.low, a.low, b.low), V::select(which.high, a.high, b.high)};
    }
    static Floats select(uint32_t which, const Floats& a, const Floats& b) {
        return {V::select(which & kHalf, a.low, b.low),
                V::select(which >> V::kWidth, a.high, b.high)};
    }
    static float least(uint32_t which, const Floats& v) {
        const Floats s = select(which, v, splat(kLargestScale));
        return V::least(kHalf, V::lesser(s.low, s.high));
    }
    static float greatest(uint32_t which, const Floats& v) {
        const Floats s = select(which, v, splat(-kLargestScale));
        return V::greatest(kHalf, V::greater(s.low, s.high));
    }
};

} // namespace
} // namespace shadowdag::stream
