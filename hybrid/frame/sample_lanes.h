// SPDX-License-Identifier: Apache-2.0
// The samples of a cluster in arrays: which of them a light lights, and the light that they
// reflect, in lanes with the widest vector instructions of the processor.
#pragma once

#include "hybrid/frame/sample_lanes_work.h"
#include "scenes/light.h"
#include "voxel/dag_stream.h"

#include <vector>

namespace shadowdag {

/// Holds one cluster after the other. Not thread-safe: one a thread.
class SampleLanes {
public:
    explicit SampleLanes(StreamIsa isa = bestStreamIsa());

    /// Starts anew with `count` samples, to be set one by one.
    void reset(uint32_t count);
    /// Sets what mark() reads of a sample. @param normalWorld unit, on the side of the lights
    void set(uint32_t i, const glm::vec3& positionWorld, const glm::vec3& normalWorld);
    /// The same, and what add() reads. @param color what lights are added to
    void set(uint32_t i, const glm::vec3& positionWorld, const glm::vec3& normalWorld,
             const glm::vec3& albedo, const glm::vec3& color);
    uint32_t count() const { return work_.count; }
    glm::vec3 color(uint32_t i) const {
        return {work_.color[0][i], work_.color[1][i], work_.color[2][i]};
    }

    /// Finds the samples that a light would light without occluders, by lightsSample; returns how
    /// many they are.
    uint32_t mark(const Light& light);
    /// By sample: 1 for those that the last mark() found, 0 for others.
    View<const uint8_t> isAsked() const { return {isAsked_.data(), work_.count}; }
    /// By sample: the visibility that add() reads, 255 lit .. 0 dark; to be set for those asked.
    View<uint8_t> seen() { return {seen_.data(), work_.count}; }
    /// The arrays of the samples; valid until the next reset().
    const stream::SampleWork& arrays() const { return work_; }
    /// Adds what the marked samples reflect of the light that was marked last, by reflectedLight.
    void add();

private:
    StreamIsa isa_;
    std::vector<float> values_; ///< 12 arrays
    std::vector<uint8_t> isAsked_, seen_;
    stream::SampleWork work_{};
};

} // namespace shadowdag
