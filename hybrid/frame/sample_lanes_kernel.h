// SPDX-License-Identifier: Apache-2.0
// lightsSample, irradianceAt and reflectedLight (scenes/light_leaf.h) for V::kWidth samples at
// once: the same operations in the same order, so the same bits. Only sample_lanes_*.cpp include
// it, each compiled for its processor; nothing inline of other headers is used.
#pragma once

#include "hybrid/frame/sample_lanes_work.h"

namespace shadowdag::stream {
namespace {

constexpr float kByteToShare = 1.0f / 255.0f;

template <class V> struct LightLanes {
    using F = typename V::Floats;
    static_assert(kSamplePadding % V::kWidth == 0);

    F toLight[3], squared; ///< squared: of its length

    LightLanes(const SampleWork& work, uint32_t first) {
        for (int a = 0; a < 3; ++a)
            toLight[a] = work.isDirectional
                             ? V::splat(work.at[a])
                             : V::sub(V::splat(work.at[a]), V::load(work.position[a] + first));
        squared = dot(toLight, toLight);
    }

    static F dot(const F (&a)[3], const F (&b)[3]) {
        return V::add(V::add(V::mul(a[0], b[0]), V::mul(a[1], b[1])), V::mul(a[2], b[2]));
    }
    F dotNormal(const SampleWork& work, uint32_t first) const {
        const F n[3] = {V::load(work.normal[0] + first), V::load(work.normal[1] + first),
                        V::load(work.normal[2] + first)};
        return dot(toLight, n);
    }
    F alongSpot(const SampleWork& work) const {
        const F d[3] = {V::splat(work.direction[0]), V::splat(work.direction[1]),
                        V::splat(work.direction[2])};
        return V::mul(V::splat(-1.0f), dot(toLight, d));
    }

    /// Returns the lanes of lightReaches.
    uint32_t reached(const SampleWork& work) const {
        if (work.isDirectional)
            return ~0u;
        const F zero = V::splat(0.0f);
        uint32_t lanes = V::less(squared, V::splat(work.rangeSquared)) & V::less(zero, squared);
        if (work.isSpot) {
            const F along = alongSpot(work);
            const F limit = V::splat(work.cosOuter * work.cosOuter);
            const F s = V::sub(V::mul(along, along), V::mul(limit, squared));
            lanes &= work.cosOuter >= 0.0f ? V::less(zero, along) & V::less(zero, s)
                                           : ~(V::less(along, zero) & V::lessOrEqual(zero, s));
        }
        return lanes;
    }

    /// Returns irradianceAt over the light's intensity.
    F irradiance(const SampleWork& work) const {
        const F one = V::splat(1.0f), zero = V::splat(0.0f);
        const F share = V::div(squared, V::splat(work.rangeSquared));
        F scale = V::div(V::sub(one, V::mul(share, share)), squared);
        if (work.isSpot) {
            const F c = V::div(alongSpot(work), V::root(squared));
            F t = V::div(V::sub(c, V::splat(work.cosOuter)), V::splat(work.coneWidth));
            t = V::select(V::less(t, zero), zero, t);
            t = V::select(V::less(one, t), one, t);
            scale = V::mul(scale, V::mul(t, t));
        }
        return scale;
    }
};

template <class V> uint32_t markSamples(const SampleWork& work) {
    uint32_t total = 0;
    for (uint32_t first = 0; first < work.count; first += V::kWidth) {
        const LightLanes<V> light(work, first);
        const uint32_t left = work.count - first;
        const uint32_t in = (1u << (left < V::kWidth ? left : V::kWidth)) - 1;
        const uint32_t asked =
            in & light.reached(work) & V::less(V::splat(0.0f), light.dotNormal(work, first));
        V::storeFlags(work.isAsked + first, asked);
        total += uint32_t(__builtin_popcount(asked));
    }
    return total;
}

template <class V> void addLight(const SampleWork& work) {
    using F = typename V::Floats;
    for (uint32_t first = 0; first < work.count; first += V::kWidth) {
        const uint32_t lit = V::nonZero(work.isAsked + first) & V::nonZero(work.seen + first);
        if (lit == 0)
            continue;
        const LightLanes<V> light(work, first);
        const F cosine = V::div(light.dotNormal(work, first), V::root(light.squared));
        const F seen = V::mul(V::loadBytes(work.seen + first), V::splat(kByteToShare));
        const F scale = V::mul(V::mul(cosine, seen), V::splat(work.inversePi));
        const F irradiance = work.isDirectional ? V::splat(1.0f) : light.irradiance(work);
        for (int a = 0; a < 3; ++a) {
            const F arriving = work.isDirectional ? V::splat(work.intensity[a])
                                                  : V::mul(V::splat(work.intensity[a]), irradiance);
            const F radiance = V::mul(V::mul(arriving, V::load(work.albedo[a] + first)), scale);
            const F before = V::load(work.color[a] + first);
            V::store(work.color[a] + first, V::select(lit, V::add(before, radiance), before));
        }
    }
}

} // namespace
} // namespace shadowdag::stream
