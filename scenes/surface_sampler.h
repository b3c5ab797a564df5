// SPDX-License-Identifier: Apache-2.0
// Seeded points of a scene's surface, for the placement of lights and cameras.
#pragma once

#include "cuda/cancel.h"
#include "scenes/split_mix.h"
#include "scenes/world.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace shadowdag {

/// A sequence of numbers that is the same on every machine: SplitMix64.
class PlacementRandom {
public:
    explicit PlacementRandom(uint64_t seed) : state_(seed) {}
    /// Returns a double in [0, 1) with 53 random bits.
    double next() {
        const uint64_t bits = splitMix64(state_);
        state_ += kSplitMixGamma;
        return double(bits >> 11) * 0x1p-53;
    }

private:
    uint64_t state_;
};

/// Draws points of the surface, each area as likely as any other of its size. Keeps the triangles'
/// view: they must outlive the sampler and not move.
class SurfaceSampler {
public:
    explicit SurfaceSampler(TriangleView triangles)
        : triangles_(triangles), areas_(triangles.count()) {
        double sum = 0.0;
        for (size_t t = 0; t < triangles.count(); ++t) {
            if (t % 65536 == 0)
                pollCpu();
            const glm::dvec3 a(triangles.vertex(t, 0)), b(triangles.vertex(t, 1)),
                c(triangles.vertex(t, 2));
            sum += glm::length(glm::cross(b - a, c - a));
            areas_[t] = sum;
        }
    }
    struct Point {
        glm::vec3 position, normal; ///< normal unit, or zero on a degenerate triangle
    };
    Point draw(PlacementRandom& random) const {
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

} // namespace shadowdag
