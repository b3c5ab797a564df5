// SPDX-License-Identifier: Apache-2.0
// What an EmbreeScene holds. Only for files that call Embree.
#pragma once

#include "hybrid/rays/embree_scene.h"
#include "hybrid/rays/embree_version.h"

#include <atomic>
#include <string>
#include <vector>

namespace shadowdag {

struct EmbreeScene::State {
    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
        if (scene)
            rtcReleaseScene(scene);
        if (device)
            rtcReleaseDevice(device);
    }

    std::atomic<int64_t> embreeBytes{0}; ///< allocated by the device; outlives it
    std::string lastError;
    std::vector<glm::vec4> vertices; ///< 16 bytes each because Embree reads a float past the third
    std::vector<glm::uvec3> triangles;
    std::vector<uint32_t> sourceOf; ///< by triangle of `triangles`; empty without cut triangles
    AlphaMaskSet masks;
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    bool hasNative16 = false; ///< Embree traces packets of 16 rays with vectors of 16
};

} // namespace shadowdag
