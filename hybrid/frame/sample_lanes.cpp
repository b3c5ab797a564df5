// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/sample_lanes.h"

#include <algorithm>

namespace shadowdag {

namespace {

constexpr size_t kArrayCount = 12;

} // namespace

SampleLanes::SampleLanes(StreamIsa isa) : isa_(isa) {
    SDAG_ASSERT(hasStreamIsa(isa));
    work_.inversePi = kInversePi;
}

void SampleLanes::reset(uint32_t count) {
    const size_t padded = (size_t(count) + stream::kSamplePadding - 1) / stream::kSamplePadding *
                          stream::kSamplePadding;
    // Vectors are stored to aligned addresses.
    constexpr size_t kAlign = 64 / sizeof(float);
    if (values_.size() < kArrayCount * padded + kAlign)
        values_.resize(kArrayCount * padded + kAlign);
    float* next = values_.data();
    while (reinterpret_cast<uintptr_t>(next) % 64 != 0)
        ++next;
    const auto take = [&] {
        float* array = next;
        next += padded;
        std::fill(array + count, next, 0.0f);
        return array;
    };
    for (int a = 0; a < 3; ++a) {
        work_.position[a] = take();
        work_.normal[a] = take();
        work_.albedo[a] = take();
        work_.color[a] = take();
    }
    isAsked_.assign(padded, 0);
    seen_.assign(padded, 0);
    work_.count = count;
    work_.isAsked = isAsked_.data();
    work_.seen = seen_.data();
}

void SampleLanes::set(uint32_t i, const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                      const glm::vec3& albedo, const glm::vec3& color) {
    for (int a = 0; a < 3; ++a) {
        work_.position[a][i] = positionWorld[a];
        work_.normal[a][i] = normalWorld[a];
        work_.albedo[a][i] = albedo[a];
        work_.color[a][i] = color[a];
    }
}

uint32_t SampleLanes::mark(const Light& light) {
    stream::SampleWork& w = work_;
    w.isDirectional = light.kind == Light::kSun;
    w.isSpot = light.kind == Light::kSpot;
    const glm::vec3 at = w.isDirectional ? -light.directionWorld : light.positionWorld;
    for (int a = 0; a < 3; ++a) {
        w.at[a] = at[a];
        w.intensity[a] = light.intensity[a];
        w.direction[a] = light.directionWorld[a];
    }
    w.rangeSquared = light.rangeWorld * light.rangeWorld;
    w.cosOuter = light.cosOuter;
    w.coneWidth = greater(light.cosInner - light.cosOuter, 1e-4f);
#if defined(SDAG_STREAM_X86)
    if (isa_ == StreamIsa::kAvx512)
        return stream::markSamplesAvx512(w);
    if (isa_ == StreamIsa::kAvx2)
        return stream::markSamplesAvx2(w);
#endif
    return stream::markSamplesPortable(w);
}

void SampleLanes::add() {
#if defined(SDAG_STREAM_X86)
    if (isa_ == StreamIsa::kAvx512)
        return stream::addLightAvx512(work_);
    if (isa_ == StreamIsa::kAvx2)
        return stream::addLightAvx2(work_);
#endif
    stream::addLightPortable(work_);
}

} // namespace shadowdag
