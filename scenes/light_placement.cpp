// SPDX-License-Identifier: Apache-2.0
#include "scenes/light_placement.h"

#include "scenes/triangle_grid.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shadowdag {

namespace {

// Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, OOPSLA 2014 (SplitMix64).
class Random {
public:
    explicit Random(uint64_t seed) : state_(seed) {}
    /// Returns a double in [0, 1) with 53 random bits.
    double next() {
        uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }

private:
    uint64_t state_;
};

// Draws points of the surface, each area as likely as any other of its size.
class SurfaceSampler {
public:
    explicit SurfaceSampler(TriangleView triangles)
        : triangles_(triangles), areas_(triangles.count()) {
        double sum = 0.0;
        for (size_t t = 0; t < triangles.count(); ++t) {
            const glm::dvec3 a(triangles.vertex(t, 0)), b(triangles.vertex(t, 1)),
                c(triangles.vertex(t, 2));
            sum += glm::length(glm::cross(b - a, c - a));
            areas_[t] = sum;
        }
    }
    struct Point {
        glm::vec3 position, normal; ///< normal unit, or zero on a degenerate triangle
    };
    Point draw(Random& random) const {
        const double at = random.next() * areas_.back();
        const size_t t =
            std::min(size_t(std::upper_bound(areas_.begin(), areas_.end(), at) - areas_.begin()),
                     areas_.size() - 1);
        double u = random.next(), v = random.next();
        if (u + v > 1.0) { // fold the parallelogram onto the triangle
            u = 1.0 - u;
            v = 1.0 - v;
        }
        const glm::dvec3 a(triangles_.vertex(t, 0)), b(triangles_.vertex(t, 1)),
            c(triangles_.vertex(t, 2));
        const glm::dvec3 cross = glm::cross(b - a, c - a);
        const double length = glm::length(cross);
        return {glm::vec3(a + (b - a) * u + (c - a) * v),
                length > 0.0 ? glm::vec3(cross / length) : glm::vec3(0.0f)};
    }

private:
    TriangleView triangles_;
    std::vector<double> areas_; // running sum
};

bool isInside(const Box& box, const glm::vec3& p) {
    return distanceSquared(box, p) == 0.0f;
}

// How far one gets from a point of the box to the next surface or, where there is none, to the end
// of the box: a wall's outer side has no room.
float roomAlong(const TriangleGrid& grid, const Box& bounds, const glm::vec3& p,
                const glm::vec3& direction) {
    float room = grid.trace(p, direction).distance;
    for (int axis = 0; axis < 3; ++axis)
        if (direction[axis] != 0.0f) {
            const float end = direction[axis] > 0.0f ? bounds.max[axis] : bounds.min[axis];
            room = std::min(room, (end - p[axis]) / direction[axis]);
        }
    return std::max(room, 0.0f);
}

// One place: the first of 64 tries that is free enough, else the freest of them.
glm::vec3 placeOne(const SurfaceSampler& surface, const TriangleGrid& grid, const Box& bounds,
                   Random& random) {
    const float diagonal = glm::length(bounds.extent());
    glm::vec3 best = bounds.center();
    float bestClearance = -1.0f;
    for (int attempt = 0; attempt < 64; ++attempt) {
        const SurfaceSampler::Point point = surface.draw(random);
        const float height = diagonal * float(0.005 + 0.025 * random.next());
        if (point.normal == glm::vec3(0.0f))
            continue;
        const glm::vec3 lifted = point.normal * (height * 1e-3f);
        const float roomFront = roomAlong(grid, bounds, point.position + lifted, point.normal);
        const float roomBack = roomAlong(grid, bounds, point.position - lifted, -point.normal);
        const glm::vec3 side = roomBack > roomFront ? -point.normal : point.normal;
        const float room = std::max(roomFront, roomBack);
        // A niche narrower than the height gets its light in the middle.
        const glm::vec3 place = point.position + side * std::min(height, 0.5f * room);
        if (!isInside(bounds, place))
            continue;
        const float clearance = grid.distance(place, height);
        if (clearance > bestClearance) {
            bestClearance = clearance;
            best = place;
        }
        if (clearance >= 0.5f * height)
            return place;
    }
    return best;
}

} // namespace

std::vector<Light> placeLights(const World& world, int count, uint64_t seed) {
    std::vector<Light> lights;
    if (count <= 0)
        return lights;
    const Box& bounds = world.boundsWorld();
    const TriangleGrid grid(world.triangles(), bounds);
    const SurfaceSampler surface(world.triangles());
    Random random(seed);
    for (int i = 0; i < count; ++i) {
        Light light;
        light.positionWorld = placeOne(surface, grid, bounds, random);
        // Relative range for now: 1/2 to 2, small ones more often.
        light.rangeWorld = float(1.0 / (2.0 - 1.5 * random.next()));
        light.intensity = {1.0f, float(0.7 + 0.3 * random.next()),
                           float(0.4 + 0.6 * random.next())};
        lights.push_back(light);
    }
    // The scale at which a surface point lies in kMeanLightsPerPoint ranges on average is an order
    // statistic of distance / relative range over all pairs of sampled points and lights.
    constexpr double kMeanLightsPerPoint = 12.0;
    const size_t pointCount = std::clamp<size_t>((size_t(1) << 21) / size_t(count), 64, 2048);
    std::vector<float> ratios;
    ratios.reserve(pointCount * size_t(count));
    for (size_t p = 0; p < pointCount; ++p) {
        const glm::vec3 position = surface.draw(random).position;
        for (const Light& light : lights)
            ratios.push_back(glm::length(light.positionWorld - position) / light.rangeWorld);
    }
    const double lightsPerPoint = std::min(kMeanLightsPerPoint, 0.75 * count);
    const size_t rank = std::min(size_t(lightsPerPoint * double(pointCount)), ratios.size() - 1);
    std::nth_element(ratios.begin(), ratios.begin() + std::ptrdiff_t(rank), ratios.end());
    const float diagonal = glm::length(bounds.extent());
    const float scale = ratios[rank] > 0.0f ? ratios[rank] : std::max(diagonal, 1.0f);
    for (Light& light : lights) {
        light.rangeWorld *= scale;
        light.intensity *= 0.25f * light.rangeWorld * light.rangeWorld; // 1 lux at half the range
    }
    return lights;
}

} // namespace shadowdag
