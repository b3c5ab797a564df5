// SPDX-License-Identifier: Apache-2.0
#include "scenes/light_placement.h"

#include "cuda/cancel.h"
#include "scenes/open_space.h"
#include "scenes/surface_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace shadowdag {

namespace {

bool isInside(const Box& box, const glm::vec3& p) {
    return distanceSquared(box, p) == 0.0f;
}

// A light is in the open when it is seen from this many of the stations nearest to it.
constexpr int kStationsInSight = 4;

// One place: the first of 64 tries that has enough free space and is in the open, else the freest
// of those that are most in the open.
glm::vec3 placeOne(const SurfaceSampler& surface, const OpenSpace& open, const Box& bounds,
                   PlacementRandom& random) {
    const TriangleTree& tree = open.tree();
    const float diagonal = glm::length(bounds.extent());
    glm::vec3 best = bounds.center();
    float bestClearance = -1.0f;
    int bestInSight = -1;
    for (int attempt = 0; attempt < 64; ++attempt) {
        pollCpu();
        const SurfaceSampler::Point point = surface.draw(random);
        const float height = diagonal * float(0.005 + 0.025 * random.next());
        if (point.normal == glm::vec3(0.0f))
            continue;
        const glm::vec3 lifted = point.normal * (height * 1e-3f);
        const float spaceFront = spaceAlong(tree, bounds, point.position + lifted, point.normal);
        const float spaceBack = spaceAlong(tree, bounds, point.position - lifted, -point.normal);
        // The side with more space first; for the wall of a sealed map that is often the outer one.
        for (const bool isBack : {spaceBack > spaceFront, !(spaceBack > spaceFront)}) {
            const glm::vec3 side = isBack ? -point.normal : point.normal;
            const float room = isBack ? spaceBack : spaceFront;
            // A niche narrower than the height gets its light in the middle.
            const glm::vec3 place = point.position + side * std::min(height, 0.5f * room);
            if (!isInside(bounds, place))
                continue;
            const float clearance = tree.distance(place, height);
            const int inSight = open.stationsInSight(place, kStationsInSight);
            if (inSight == kStationsInSight && clearance >= 0.5f * height)
                return place;
            if (inSight > bestInSight || (inSight == bestInSight && clearance > bestClearance)) {
                bestClearance = clearance;
                bestInSight = inSight;
                best = place;
            }
        }
    }
    return best;
}

constexpr float kNever = std::numeric_limits<float>::max();

// 1 if the front of the surface there is visible from open space, -1 if the back is, 0 if neither.
float sideInSight(const SurfaceSampler::Point& point, const OpenSpace& open) {
    const glm::vec3 lifted = point.normal * (1e-3f * open.typicalOpenness());
    if (point.normal == glm::vec3(0.0f))
        return 0.0f;
    for (const float side : {1.0f, -1.0f})
        if (open.stationsInSight(point.position + lifted * side, 1) > 0)
            return side;
    return 0.0f;
}

} // namespace

std::vector<Light> placeLights(const World& world, int count, uint64_t seed, QueryCost* cost) {
    std::vector<Light> lights;
    if (count <= 0)
        return lights;
    const Box& bounds = world.boundsWorld();
    const std::vector<Light> none;
    const OpenSpace open(world.triangles(), bounds, none, seed);
    const SurfaceSampler surface(world.triangles());
    PlacementRandom random(seed);
    for (int i = 0; i < count; ++i) {
        Light light;
        light.positionWorld = placeOne(surface, open, bounds, random);
        // Relative range for now: 1/2 to 2, small ones more often.
        light.rangeWorld = float(1.0 / (2.0 - 1.5 * random.next()));
        light.intensity = {1.0f, float(0.7 + 0.3 * random.next()),
                           float(0.4 + 0.6 * random.next())};
        lights.push_back(light);
    }
    // The scale at which a surface point that one sees lies in kMeanLightsPerPoint ranges on the
    // lit side of its plane, on average: an order statistic of distance / relative range over the
    // pairs of sampled points and lights.
    constexpr double kMeanLightsPerPoint = 12.0;
    const size_t pointCount = std::clamp<size_t>((size_t(1) << 21) / size_t(count), 64, 1024);
    std::vector<float> ratios;
    ratios.reserve(pointCount * size_t(count));
    for (size_t p = 0; p < pointCount; ++p) {
        pollCpu();
        SurfaceSampler::Point point = surface.draw(random);
        float side = 0.0f; // towards the eye
        for (int attempt = 0; attempt < 4; ++attempt) {
            if (attempt > 0)
                point = surface.draw(random);
            side = sideInSight(point, open);
            if (side != 0.0f)
                break;
        }
        for (const Light& light : lights) {
            const glm::vec3 toLight = light.positionWorld - point.position;
            const bool isLit = side == 0.0f || side * glm::dot(point.normal, toLight) > 0.0f;
            ratios.push_back(isLit ? glm::length(toLight) / light.rangeWorld : kNever);
        }
    }
    const auto litCount = size_t(
        std::count_if(ratios.begin(), ratios.end(), [](float ratio) { return ratio < kNever; }));
    const size_t rank = std::min({size_t(kMeanLightsPerPoint * double(pointCount)),
                                  size_t(0.75 * double(litCount)), ratios.size() - 1});
    std::nth_element(ratios.begin(), ratios.begin() + std::ptrdiff_t(rank), ratios.end());
    const float diagonal = glm::length(bounds.extent());
    // Lights in the plane of a flat scene are on the lit side of no point.
    const float ratio = ratios[rank];
    const float scale = ratio > 0.0f && ratio < kNever ? ratio : std::max(diagonal, 1.0f);
    for (Light& light : lights) {
        light.rangeWorld *= scale;
        light.intensity *= 0.25f * light.rangeWorld * light.rangeWorld; // 1 lux at half the range
    }
    warnOfCutQueries(open.tree().cost(), "lights");
    if (cost != nullptr)
        *cost = open.tree().cost();
    return lights;
}

} // namespace shadowdag
