// SPDX-License-Identifier: Apache-2.0
// The resolution that a shadow map must have: one texel for one pixel, on average over a cluster.
// Source: Olsson et al., More Efficient Virtual Shadow Maps for Many Lights, TVCG 2015, sec. IV-B,
// eq. 1.
//
// A cluster of S pixels whose bounding sphere (radius r, centre at distance d) fills the solid
// angle alpha wants
//     R^2 = (S / (alpha / 4 pi)) / 6,   alpha / 4 pi = (1 - sqrt(1 - x)) / 2,   x = r^2 / d^2,
// texels a face. Multiplied by 1 + sqrt(1 - x) this is S (1 + sqrt(1 - x)) / (3 x), which does not
// cancel for small x.
//
// The light inside the sphere (d <= r): alpha is taken as 2 pi, R^2 = S / 3. The pixels are on
// surfaces, and what a light sees of a surface in front of it, however near, stays within a half
// space; 4 pi would spread them over twice the directions they can have. The rule continues the
// equation, whose alpha is 2 pi at d = r, so R never jumps as a light or the camera moves, and it
// never grows as the light comes nearer. (Octants of the box, S / 4 each, were considered: they ask
// for up to 2.1 times as much for a light at the sphere's border, but jump by that factor there,
// and the next clusters' equations rule at such a light anyway.)
//
// A deviation: r is the radius of the samples' box plus half a pixel's diagonal at the cluster's
// far end. A pixel is not a point; without it a cluster of one sample has r = 0 and wants an
// infinite resolution, with it one texel for its pixel.
#pragma once

#include "hybrid/lights.h"

#include <bit>

namespace shadowdag {

/// Returns R^2, texels squared, that a cluster of `sampleCount` > 0 pixels wants of a light.
/// @param radiusSquared,distanceSquared of the cluster's bounding sphere and of its centre from the
/// light, same unit
SDAG_HD inline float requiredResolutionSquared(uint32_t sampleCount, double radiusSquared,
                                               double distanceSquared) {
    const double samples = sampleCount;
    if (!(radiusSquared < distanceSquared))
        return float(samples / 3.0);
    const double x = radiusSquared / distanceSquared;
    return float(samples * (1.0 + glm::sqrt(1.0 - x)) / (3.0 * x));
}

/// Returns the squared radius of a cluster's bounding sphere, half a pixel's diagonal added.
/// @param pixelSize side of a pixel at distance 1 (ViewRays)
SDAG_HD inline double clusterRadiusSquared(const Box& box, const ViewRays& view) {
    const glm::dvec3 half = 0.5 * (glm::dvec3(box.max) - glm::dvec3(box.min));
    const glm::dvec3 center = 0.5 * (glm::dvec3(box.max) + glm::dvec3(box.min)) - view.origin;
    const double farthest = glm::dot(center, view.forward) + glm::dot(glm::abs(view.forward), half);
    constexpr double kHalfDiagonal = 0.70710678118654752;
    const double radius =
        glm::sqrt(glm::dot(half, half)) + kHalfDiagonal * view.pixelSize * farthest;
    return radius * radius;
}

/// What a light's clusters ask for together.
/// All three: lightCount, zero before; order independent.
struct LightDemandView {
    View<uint32_t> resolutionSquaredBits; ///< float bits of the maximum R^2
    View<uint32_t> sampleCount;           ///< samples of its clusters
    View<uint32_t> clusterCount;
};

/// Raises the demand of every light of a cluster.
struct DemandResolution {
    ClusterView clusters;
    ClusterLightsView lists;
    View<const Light> lights;
    ViewRays view;
    LightDemandView demand;

    SDAG_HD void operator()(size_t cluster) const {
        const Box box = clusters.boxesWorld[cluster];
        const glm::dvec3 center = 0.5 * (glm::dvec3(box.max) + glm::dvec3(box.min));
        const double radiusSquared = clusterRadiusSquared(box, view);
        const uint32_t samples = clusters.sampleCount(cluster);
        for (uint32_t i = lists.start[cluster]; i < lists.start[cluster + 1]; ++i) {
            const uint32_t light = lists.lights[i];
            const glm::dvec3 toLight = glm::dvec3(lights[light].positionWorld) - center;
            const float wanted =
                requiredResolutionSquared(samples, radiusSquared, glm::dot(toLight, toLight));
            // Positive floats order as their bits do.
            atomicMaxRelaxed(&demand.resolutionSquaredBits[light], std::bit_cast<uint32_t>(wanted));
            atomicAddRelaxed(&demand.sampleCount[light], samples);
            atomicAddRelaxed(&demand.clusterCount[light], 1);
        }
    }
};

} // namespace shadowdag
