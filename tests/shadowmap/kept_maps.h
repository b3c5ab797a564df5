// SPDX-License-Identifier: Apache-2.0
// Moving scenes and options with which maps are kept, for tests of static optimization.
#pragma once

#include "shadowmap/shadow_maps.h"
#include "tests/shadowmap/small_scene.h"

#include <cmath>
#include <iterator>
#include <memory>
#include <random>
#include <vector>

namespace shadowdag::test {

/// Returns options by which maps are kept from frame to frame.
inline ShadowMapOptions keeping(MapCulling culling) {
    ShadowMapOptions options = freshMaps();
    options.culling = culling;
    options.useStaticOptimization = true;
    options.retainsPages = true;
    options.pageTexels = 16;
    options.poolBytes = 16ull << 20;
    return options;
}

constexpr uint32_t kInstances = 14;
constexpr float kRoom = 4.0f;

/// A room with things in it, some of which move, stop and move on; lights that do the same, leave
/// and return; a camera whose receivers creep or jump.
class Animation {
public:
    SmallScene scene;
    std::unique_ptr<BatchSet> batches;
    std::vector<MapRequest> requests;
    std::vector<Box> boxes;
    std::vector<MapReceiver> receivers;
    std::vector<uint32_t> moved; ///< batches, of all steps since the last build
    /// How often each happened.
    size_t movedCount = 0, stoppedCount = 0, lightMoveCount = 0, resolutionCount = 0,
           returnCount = 0, jumpCount = 0;

    explicit Animation(uint32_t seed) : rng_(seed) {
        scene.addBox(glm::vec3(-kRoom), glm::vec3(kRoom), 8);
        instances_.assign(scene.triangles.size(), 0);
        for (uint32_t i = 1; i < kInstances; ++i) {
            firstVertex_[i] = uint32_t(scene.positions.size());
            const glm::vec3 c = 0.8f * kRoom * uniform3();
            switch (i % 3) {
            case 0:
                scene.addSphere(c, 0.2f + 0.4f * std::abs(uniform()), 6);
                break;
            case 1:
                scene.addBox(c - 0.5f * glm::abs(uniform3()), c + 0.4f, 3);
                break;
            default:
                for (int k = 0; k < 40; ++k)
                    scene.addTriangle(c + uniform3(), c + uniform3(), c + 0.3f * uniform3());
            }
            instances_.resize(scene.triangles.size(), i);
        }
        firstVertex_[kInstances] = uint32_t(scene.positions.size());
        batches = std::make_unique<BatchSet>(scene.view(), instances_);
        for (uint32_t l = 0; l < 5; ++l)
            lights_.push_back({0.7f * kRoom * uniform3(), 2.0f + 4.0f * std::abs(uniform()),
                               resolution(), true, l == 0});
        for (glm::vec3& station : stations_)
            station = 0.8f * kRoom * uniform3();
        placeReceivers();
    }

    void step() {
        std::vector<uint32_t> movedInstances;
        for (uint32_t i = 1; i < kInstances; ++i) {
            if (chance(8)) {
                isMoving_[i] = !isMoving_[i];
                stoppedCount += !isMoving_[i];
            }
            if (!isMoving_[i])
                continue;
            movedInstances.push_back(i);
            ++movedCount;
            move(i);
        }
        batches->update(scene.view(), movedInstances);
        moved.insert(moved.end(), batches->movedBatches().begin(), batches->movedBatches().end());
        for (Light& light : lights_) {
            if (chance(10))
                light.isMoving = !light.isMoving;
            if (light.isMoving) {
                light.position += 0.1f * uniform3();
                ++lightMoveCount;
            }
            if (chance(12)) {
                light.faceTexels = resolution();
                ++resolutionCount;
            }
            if (chance(6)) {
                light.isPresent = !light.isPresent;
                returnCount += light.isPresent;
            }
        }
        if (chance(10)) {
            eye_ = stations_[rng_() % std::size(stations_)];
            ++jumpCount;
        } else {
            eye_ += 0.05f * uniform3();
        }
        placeReceivers();
    }

private:
    struct Light {
        glm::vec3 position;
        float range;
        uint32_t faceTexels;
        bool isPresent, isMoving;
    };

    float uniform() { return std::uniform_real_distribution<float>(-1.0f, 1.0f)(rng_); }
    glm::vec3 uniform3() {
        const float x = uniform(), y = uniform();
        return {x, y, uniform()};
    }
    bool chance(uint32_t n) { return rng_() % n == 0; }
    uint32_t resolution() {
        constexpr uint32_t kTexels[] = {5, 20, 33, 64, 100, 190, 256};
        return kTexels[rng_() % std::size(kTexels)];
    }
    void move(uint32_t i) {
        // Now and then within the own box, which then stays what it was.
        if (chance(3)) {
            Box box;
            for (uint32_t v = firstVertex_[i]; v < firstVertex_[i + 1]; ++v)
                box.add(scene.positions[v]);
            for (uint32_t v = firstVertex_[i]; v < firstVertex_[i + 1]; ++v) {
                glm::vec3& p = scene.positions[v];
                if (glm::all(glm::lessThan(box.min, p)) && glm::all(glm::lessThan(p, box.max)))
                    p = box.center() + 0.5f * box.extent() * uniform3();
            }
            return;
        }
        const glm::vec3 by = (chance(4) ? 1.5f : 0.15f) * uniform3();
        for (uint32_t v = firstVertex_[i]; v < firstVertex_[i + 1]; ++v)
            scene.positions[v] += by;
    }
    void placeReceivers() {
        requests.clear();
        boxes.clear();
        receivers.clear();
        // A light may ask for several maps, even of one resolution.
        std::vector<std::vector<uint32_t>> maps(lights_.size());
        for (uint32_t l = 0; l < lights_.size(); ++l)
            for (uint32_t octave = 0; octave < 1 + l % 3 && lights_[l].isPresent; ++octave) {
                maps[l].push_back(uint32_t(requests.size()));
                requests.push_back({lights_[l].position, lights_[l].range, l,
                                    octave == 1 ? 64 : lights_[l].faceTexels, octave});
            }
        std::mt19937 around(7);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        for (uint32_t i = 0; i < 30; ++i) {
            const float x = unit(around), y = unit(around), z = unit(around);
            const glm::vec3 c = eye_ + 1.5f * glm::vec3(x, y, z);
            const glm::vec3 e = 0.02f + 0.2f * glm::abs(glm::vec3(z, x, y));
            boxes.push_back({c - e, c + e});
            for (uint32_t l = 0; l < lights_.size(); ++l)
                if (!maps[l].empty() && distanceSquared(boxes[i], lights_[l].position) <
                                            lights_[l].range * lights_[l].range)
                    receivers.push_back({i, maps[l][i % maps[l].size()]});
        }
    }

    std::mt19937 rng_;
    std::vector<uint32_t> instances_; // a triangle
    uint32_t firstVertex_[kInstances + 1] = {};
    bool isMoving_[kInstances] = {};
    std::vector<Light> lights_;
    glm::vec3 stations_[3]; // so that it also returns
    glm::vec3 eye_{0.5f, 0.0f, 0.0f};
};

} // namespace shadowdag::test
