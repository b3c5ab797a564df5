// SPDX-License-Identifier: Apache-2.0
// Vectors of floats for the kernels that are compiled once per instruction set: any processor
// (lanes_avx2.h).
#pragma once

#include "voxel/ray_slabs_leaf.h" // kLargestScale

#include <cstdint>

namespace shadowdag::stream {
namespace {

/// 8 floats in plain C++.
struct PortableLanes {
    static constexpr uint32_t kWidth = 8;
    struct Floats {
        float at[kWidth];
    };
    struct Ints {
        int32_t at[kWidth];
    };
    struct Doubles {
        double at[kWidth];
    };
    using Mask = uint32_t;
    static Mask mask(uint32_t bits) { return bits; }

    template <class F> static Floats each(const F& of) {
        Floats r;
        for (uint32_t i = 0; i < kWidth; ++i)
            r.at[i] = of(i);
        return r;
    }
    template <class F> static Ints eachInt(const F& of) {
        Ints r;
        for (uint32_t i = 0; i < kWidth; ++i)
            r.at[i] = of(i);
        return r;
    }
    template <class F> static Doubles eachDouble(const F& of) {
        Doubles r;
        for (uint32_t i = 0; i < kWidth; ++i)
            r.at[i] = of(i);
        return r;
    }
    template <class F> static uint32_t bits(const F& of) {
        uint32_t r = 0;
        for (uint32_t i = 0; i < kWidth; ++i)
            r |= uint32_t(of(i)) << i;
        return r;
    }

    static Floats splat(float v) {
        return each([&](uint32_t) { return v; });
    }
    static Floats load(const float* from) {
        return each([&](uint32_t i) { return from[i]; });
    }
    static Floats loadBytes(const uint8_t* from) {
        return each([&](uint32_t i) { return float(from[i]); });
    }
    static uint32_t nonZero(const uint8_t* from) {
        return bits([&](uint32_t i) { return from[i] != 0; });
    }
    static void storeFlags(uint8_t* to, uint32_t bits) {
        for (uint32_t i = 0; i < kWidth; ++i)
            to[i] = uint8_t(bits >> i & 1);
    }
    static void store(float* to, const Floats& v) {
        for (uint32_t i = 0; i < kWidth; ++i)
            to[i] = v.at[i];
    }
    static Floats gather(const float* base, const uint32_t* index) {
        return each([&](uint32_t i) { return base[index[i]]; });
    }
    static float lane(const Floats& v, uint32_t i) { return v.at[i]; }
    static Floats add(const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return a.at[i] + b.at[i]; });
    }
    static Floats sub(const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return a.at[i] - b.at[i]; });
    }
    static Floats mul(const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return a.at[i] * b.at[i]; });
    }
    static Floats div(const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return a.at[i] / b.at[i]; });
    }
    static Floats fma(const Floats& a, const Floats& b, const Floats& c) {
        return each([&](uint32_t i) { return __builtin_fmaf(a.at[i], b.at[i], c.at[i]); });
    }
    static Floats root(const Floats& a) {
        return each([&](uint32_t i) { return __builtin_sqrtf(a.at[i]); });
    }
    static Floats lesser(const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return a.at[i] < b.at[i] ? a.at[i] : b.at[i]; });
    }
    static Floats greater(const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return a.at[i] > b.at[i] ? a.at[i] : b.at[i]; });
    }
    static Floats absolute(const Floats& a) {
        return each([&](uint32_t i) { return __builtin_fabsf(a.at[i]); });
    }
    static uint32_t less(const Floats& a, const Floats& b) {
        return bits([&](uint32_t i) { return a.at[i] < b.at[i]; });
    }
    static uint32_t lessOrEqual(const Floats& a, const Floats& b) {
        return bits([&](uint32_t i) { return a.at[i] <= b.at[i]; });
    }
    static Floats select(uint32_t which, const Floats& a, const Floats& b) {
        return each([&](uint32_t i) { return which >> i & 1 ? a.at[i] : b.at[i]; });
    }
    static void storeInts(int32_t* to, const Ints& v) { __builtin_memcpy(to, &v, sizeof v); }
    static Ints splatInt(int32_t v) {
        return eachInt([&](uint32_t) { return v; });
    }
    static Ints toInts(const Floats& v) {
        constexpr float kEnd = 2147483648.0f;
        return eachInt(
            [&](uint32_t i) { return v.at[i] >= -kEnd && v.at[i] < kEnd ? int32_t(v.at[i]) : 0; });
    }
    static Floats toFloats(const Ints& v) {
        return each([&](uint32_t i) { return float(v.at[i]); });
    }
    // Integers wrap around, as vectors' do.
    static Ints addInts(const Ints& a, const Ints& b) {
        return eachInt([&](uint32_t i) { return int32_t(uint32_t(a.at[i]) + uint32_t(b.at[i])); });
    }
    static Ints mulInts(const Ints& a, const Ints& b) {
        return eachInt([&](uint32_t i) { return int32_t(uint32_t(a.at[i]) * uint32_t(b.at[i])); });
    }
    static Ints andInts(const Ints& a, const Ints& b) {
        return eachInt([&](uint32_t i) { return a.at[i] & b.at[i]; });
    }
    static Ints shiftLeft(const Ints& a, int by) {
        return eachInt([&](uint32_t i) { return int32_t(uint32_t(a.at[i]) << by); });
    }
    static Ints shiftRight(const Ints& a, int by) {
        return eachInt([&](uint32_t i) { return a.at[i] >> by; });
    }
    static uint32_t equalInts(const Ints& a, const Ints& b) {
        return bits([&](uint32_t i) { return a.at[i] == b.at[i]; });
    }
    static Ints selectInts(uint32_t which, const Ints& a, const Ints& b) {
        return eachInt([&](uint32_t i) { return which >> i & 1 ? a.at[i] : b.at[i]; });
    }
    static Ints gatherInts(const uint32_t* base, const Ints& index) {
        return eachInt([&](uint32_t i) { return int32_t(base[index.at[i]]); });
    }
    /// Returns 1 << by of every lane. @param by 0..31
    static Ints bitOf(const Ints& by) {
        return eachInt([&](uint32_t i) { return int32_t(1u << by.at[i]); });
    }
    /// Returns base[index], or what other threads' atomics have replaced since. For words in which
    /// bits are only set, where an old value errs on the safe side.
    static Ints gatherShared(const uint32_t* base, const Ints& index) {
        return eachInt([&](uint32_t i) {
            return int32_t(__atomic_load_n(base + index.at[i], __ATOMIC_RELAXED));
        });
    }
    /// Asks the caches for base[index] of every lane.
    static void prefetch(const uint32_t* base, const Ints& index) {
        for (const int32_t i : index.at)
            __builtin_prefetch(base + i);
    }
    static Floats bitsToFloats(const Ints& v) {
        Floats r;
        __builtin_memcpy(&r, &v, sizeof r);
        return r;
    }
    static Doubles splatDouble(double v) {
        return eachDouble([&](uint32_t) { return v; });
    }
    static Doubles toDoubles(const Floats& v) {
        return eachDouble([&](uint32_t i) { return double(v.at[i]); });
    }
    static Floats toFloats(const Doubles& v) {
        return each([&](uint32_t i) { return float(v.at[i]); });
    }
    static Doubles add(const Doubles& a, const Doubles& b) {
        return eachDouble([&](uint32_t i) { return a.at[i] + b.at[i]; });
    }
    static Doubles sub(const Doubles& a, const Doubles& b) {
        return eachDouble([&](uint32_t i) { return a.at[i] - b.at[i]; });
    }
    static Doubles mul(const Doubles& a, const Doubles& b) {
        return eachDouble([&](uint32_t i) { return a.at[i] * b.at[i]; });
    }
    static Doubles div(const Doubles& a, const Doubles& b) {
        return eachDouble([&](uint32_t i) { return a.at[i] / b.at[i]; });
    }
    static Doubles lesser(const Doubles& a, const Doubles& b) {
        return eachDouble([&](uint32_t i) { return a.at[i] < b.at[i] ? a.at[i] : b.at[i]; });
    }
    static Doubles greater(const Doubles& a, const Doubles& b) {
        return eachDouble([&](uint32_t i) { return a.at[i] > b.at[i] ? a.at[i] : b.at[i]; });
    }
    static uint32_t lessOrEqual(const Doubles& a, const Doubles& b) {
        return bits([&](uint32_t i) { return a.at[i] <= b.at[i]; });
    }
    static Doubles truncate(const Doubles& v) {
        return eachDouble([&](uint32_t i) { return double(int32_t(v.at[i])); });
    }
    static float least(uint32_t which, const Floats& v) {
        float r = v.at[__builtin_ctz(which)];
        for (uint32_t i = 0; i < kWidth; ++i)
            r = (which >> i & 1) != 0 && v.at[i] < r ? v.at[i] : r;
        return r;
    }
    static float greatest(uint32_t which, const Floats& v) {
        float r = v.at[__builtin_ctz(which)];
        for (uint32_t i = 0; i < kWidth; ++i)
            r = (which >> i & 1) != 0 && v.at[i] > r ? v.at[i] : r;
        return r;
    }
};

} // namespace
} // namespace shadowdag::stream
