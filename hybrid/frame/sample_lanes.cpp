// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/sample_lanes.h"

#include "voxel/stream_kernel.h"

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

void SampleLanes::set(uint32_t i, const glm::vec3& positionWorld, const glm::vec3& normalWorld) {
    for (int a = 0; a < 3; ++a) {
        work_.position[a][i] = positionWorld[a];
        work_.normal[a][i] = normalWorld[a];
    }
}

void SampleLanes::set(uint32_t i, const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                      const glm::vec3& albedo, const glm::vec3& color) {
    set(i, positionWorld, normalWorld);
    for (int a = 0; a < 3; ++a) {
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
    return SDAG_KERNEL_OF(isa_, stream::markSamples)(w);
}

void SampleLanes::add() {
    SDAG_KERNEL_OF(isa_, stream::addLight)(work_);
}

} // namespace shadowdag
