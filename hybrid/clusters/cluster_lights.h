// SPDX-License-Identifier: Apache-2.0
// The lights that reach each cluster: exact for boxes and spheres, conservative for spots and for
// normals; contains every light of a pair (pairs.h).
#pragma once

#include "cuda/mutant.h"
#include "cuda/pass.h"
#include "hybrid/clusters/clusters.h"
#include "scenes/light.h"
#include "scenes/wide_bvh.h"

namespace shadowdag {

/// The lights of every cluster. start: clusterCount + 1, into lights; lights: world light indices,
/// ascending within a cluster; record: for every entry of `lights`, the index of its map in
/// FrameResult::maps, or kProvenLit; empty before resolutions are gathered.
struct ClusterLightsView {
    View<const uint32_t> start;
    View<const uint32_t> lights;
    View<const uint32_t> record = {};
};

/// The record of a (cluster, light) pair that needs no map and no ray: it has no exact pair, or
/// none of them is shadowed.
constexpr uint32_t kProvenLit = 0xffffffffu;

/// Returns whether the light may reach a point of the box. The distance is computed with the same
/// operations in the same order as in lightReaches, each monotone, so rounding cannot lose a light;
/// a box that the sphere touches exactly is out, as its nearest point is. A spot is tested against
/// the box's bounding sphere, so boxes beside the cone may be kept. A directional light reaches
/// every box.
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

/// Returns whether a box is farther from a light than 3/4 of its range: where Mutant::kLightShort
/// loses it.
SDAG_HD inline bool isBeyond(const Light& light, const Box& box) {
    return distanceSquared(box, light.positionWorld) >
           0.5625f * light.rangeWorld * light.rangeWorld;
}

/// Returns whether a light whose sphere's box overlaps that of a cluster may reach the cluster, and
/// whether its samples may face the light, as far as their normals are known.
SDAG_HD inline bool reachesCluster(View<const Light> lights, const Box& box,
                                   const ClusterNormalsView& normals, size_t cluster,
                                   uint32_t light) {
    if (light == 0 && isBeyond(lights[light], box) && isMutant(Mutant::kLightShort))
        return false;
    return mayReach(lights[light], box) &&
           (normals.cells.empty() ||
            mayFace(lights[light], box, normals.cells[cluster], normals.k));
}

/// Calls hit(light) for every light that may reach a cluster and that its samples may face; in
/// unspecified order.
template <class Hit>
SDAG_HD void forLightsOfCluster(const WideBvhView& lightBvh, View<const Light> lights,
                                View<const Box> boxesWorld, const ClusterNormalsView& normals,
                                size_t cluster, const Hit& hit) {
    const Box box = boxesWorld[cluster];
    traverse(
        lightBvh, [&](const Box& sphere) { return overlaps(sphere, box); },
        [&](uint32_t light) {
            if (reachesCluster(lights, box, normals, cluster, light))
                hit(light);
        });
}

/// Sorts `count` entries by key(list[i]), ascending, keys different from each other; `attached`, if
/// not null, goes along. Shell's sort with Ciura's gaps: short, in place, and lists hold tens of
/// lights.
template <class Key>
SDAG_HD void sortByKey(uint32_t count, const Key& key, uint32_t* list, uint32_t* attached) {
    constexpr uint32_t kGaps[] = {301, 132, 57, 23, 10, 4, 1};
    for (const uint32_t gap : kGaps)
        for (uint32_t i = gap; i < count; ++i) {
            const uint32_t entry = list[i], with = attached ? attached[i] : 0;
            const uint32_t keyOfEntry = key(entry);
            uint32_t j = i;
            for (; j >= gap && key(list[j - gap]) > keyOfEntry; j -= gap) {
                list[j] = list[j - gap];
                if (attached)
                    attached[j] = attached[j - gap];
            }
            list[j] = entry;
            if (attached)
                attached[j] = with;
        }
}

/// Counts the lights of a cluster.
struct CountClusterLights {
    View<const Box> boxesWorld;
    WideBvhView lightBvh;
    View<const Light> lights;
    ClusterNormalsView normals;
    View<uint32_t> count;

    size_t itemCount() const { return boxesWorld.count; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        uint32_t found = 0;
        if (!boxesWorld[cluster].empty())
            forLightsOfCluster(lightBvh, lights, boxesWorld, normals, cluster,
                               [&](uint32_t) { ++found; });
        count[cluster] = found;
    }
};
void launchPass(CudaTag, const CountClusterLights& work); ///< by warps

/// Writes the lights of a cluster, ascending. If the list does not fit, it writes zeros up to the
/// end of the memory; zero is a valid light for passes that read them before everything is
/// repeated.
struct FillClusterLights {
    View<const Box> boxesWorld;
    WideBvhView lightBvh;
    View<const Light> lights;
    ClusterNormalsView normals;
    View<const uint32_t> start;
    View<uint32_t> clusterLights;

    size_t itemCount() const { return boxesWorld.count; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        if (start[cluster + 1] > clusterLights.count) {
            for (size_t i = start[cluster]; i < clusterLights.count; ++i)
                clusterLights[i] = 0;
            return;
        }
        if (start[cluster] == start[cluster + 1])
            return;
        uint32_t* const list = clusterLights.data + start[cluster];
        uint32_t count = 0;
        forLightsOfCluster(lightBvh, lights, boxesWorld, normals, cluster,
                           [&](uint32_t light) { list[count++] = light; });
        sortByKey(
            count, [&](uint32_t light) { return light; }, list, static_cast<uint32_t*>(nullptr));
    }
};
void launchPass(CudaTag, const FillClusterLights& work); ///< by warps

/// Limits the starts of lists to the available memory; stores the length that they need.
struct ClampStarts {
    View<uint32_t> start;
    uint32_t limit;
    View<uint32_t> length; ///< 1

    size_t itemCount() const { return start.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t at = start[i];
        if (i + 1 == start.count)
            length[0] = at;
        start[i] = at < limit ? at : limit;
    }
};

/// Numbers the lights along the curve that sorts their hierarchy (first the static ones, then the
/// moving ones).
struct RankLights {
    View<const uint32_t> items; ///< WideBvhView::items
    View<uint32_t> rank;        ///< by light

    size_t itemCount() const { return items.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (items[i] != kNoBvhItem)
            rank[items[i]] = uint32_t(i);
    }
};

/// Copies the list of a cluster, ordered by rank: consecutive lights are close together in space,
/// so that the rays and the lookups of one reuse data that those of the last have fetched.
struct OrderClusterLights {
    ClusterLightsView lists;
    View<const uint32_t> rank;
    View<uint32_t> lights;
    View<uint32_t> record;

    size_t itemCount() const { return lists.start.count - 1; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        const uint32_t begin = lists.start[cluster], end = lists.start[cluster + 1];
        for (uint32_t i = begin; i < end; ++i) {
            lights[i] = lists.lights[i];
            record[i] = lists.record[i];
        }
        sortByKey(
            end - begin, [&](uint32_t light) { return rank[light]; }, lights.data + begin,
            isMutant(Mutant::kOrderWithoutMaps) ? nullptr : record.data + begin);
    }
};

} // namespace shadowdag
