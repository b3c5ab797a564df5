// SPDX-License-Identifier: Apache-2.0
// Which lights reach which cluster: exact for boxes and spheres, conservative for spots; never
// loses a light that a pair (pairs.h) needs.
#pragma once

#include "hybrid/clusters.h"
#include "scenes/light.h"
#include "scenes/wide_bvh.h"

namespace shadowdag {

/// The lights of every cluster. start: clusterCount + 1, into lights; lights: world light indices,
/// ascending within a cluster; record: of every entry of `lights`, which of the frame's maps serves
/// it (an index into FrameResult::maps), or kProvenLit; empty before resolutions are gathered.
struct ClusterLightsView {
    View<const uint32_t> start;
    View<const uint32_t> lights;
    View<const uint32_t> record = {};
};

/// The record of a (cluster, light) pair that needs no map and no ray: it has no exact pair, or
/// nothing shadows any of them.
constexpr uint32_t kProvenLit = 0xffffffffu;

/// Returns whether the light may reach a point of the box. The distance is computed with the same
/// operations in the same order as in lightReaches, each monotone, so rounding cannot lose a light;
/// a box that the sphere touches exactly is out, as its nearest point is. A spot is tested against
/// the box's bounding sphere: it may keep boxes beside the cone. A sun reaches every box.
SDAG_HD inline bool mayReach(const Light& light, const Box& box) {
    if (light.kind == Light::kSun)
        return true;
    if (!(distanceSquared(box, light.positionWorld) < light.rangeWorld * light.rangeWorld))
        return false;
    if (light.kind != Light::kSpot || light.cosOuter <= 0.0f) // wide cones: the sphere alone
        return true;
    // Distance from the sphere's centre to the cone: Wronski, Cull that cone!, 2017. Doubles, and a
    // radius a little larger than rounding can matter.
    const glm::dvec3 v = glm::dvec3(box.center()) - glm::dvec3(light.positionWorld);
    const double radius =
        0.5 * glm::length(glm::dvec3(box.extent())) * (1.0 + 1e-5) + 1e-5 * glm::length(v);
    const double along = glm::dot(v, glm::dvec3(light.directionWorld));
    const double across = glm::sqrt(glm::max(glm::dot(v, v) - along * along, 0.0));
    const double cosine = light.cosOuter;
    const double sine = glm::sqrt(glm::max(1.0 - cosine * cosine, 0.0));
    return cosine * across - sine * along <= radius && along >= -radius;
}

/// Calls hit(light) for every light that may reach the box, in no useful order.
template <class Hit>
SDAG_HD void forLightsOfBox(const WideBvhView& lightBvh, View<const Light> lights, const Box& box,
                            const Hit& hit) {
    traverse(
        lightBvh, [&](const Box& sphere) { return overlaps(sphere, box); },
        [&](uint32_t light) {
            if (mayReach(lights[light], box))
                hit(light);
        });
}

/// Counts the lights of a cluster.
struct CountClusterLights {
    View<const Box> boxesWorld;
    WideBvhView lightBvh;
    View<const Light> lights;
    View<uint32_t> count;

    SDAG_HD void operator()(size_t cluster) const {
        uint32_t found = 0;
        forLightsOfBox(lightBvh, lights, boxesWorld[cluster], [&](uint32_t) { ++found; });
        count[cluster] = found;
    }
};

/// Writes the lights of a cluster, ascending.
struct FillClusterLights {
    View<const Box> boxesWorld;
    WideBvhView lightBvh;
    View<const Light> lights;
    View<const uint32_t> start;
    View<uint32_t> clusterLights;

    SDAG_HD void operator()(size_t cluster) const {
        uint32_t* const list = clusterLights.data + start[cluster];
        uint32_t count = 0;
        forLightsOfBox(lightBvh, lights, boxesWorld[cluster],
                       [&](uint32_t light) { list[count++] = light; });
        // Shell's sort with Ciura's gaps: short, in place, and lists hold tens of lights.
        constexpr uint32_t kGaps[] = {301, 132, 57, 23, 10, 4, 1};
        for (const uint32_t gap : kGaps)
            for (uint32_t i = gap; i < count; ++i) {
                const uint32_t light = list[i];
                uint32_t j = i;
                for (; j >= gap && list[j - gap] > light; j -= gap)
                    list[j] = list[j - gap];
                list[j] = light;
            }
    }
};

} // namespace shadowdag
