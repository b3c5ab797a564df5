// SPDX-License-Identifier: Apache-2.0
// How much of a light's map a pixel covers if both project on the surface that the pixel shows: the
// part that equation 1 leaves out (Olsson et al. 2015, sec. IV-B, names the light at an oblique
// angle as its failure).
//
// Derivation. A pixel of side s at distance 1, at depth z on a ray of length v, is (s z)^2 large
// across the camera's axis, (s z)^2 z / v across the ray, and A = (s z)^2 z / (n.v) on a surface of
// normal n, v now the vector to the camera. A light in direction l / |l| sees A n.l / |l| across
// its ray: the solid angle A n.l / |l|^3 of a point light, of whose sphere 6 R^2 texels share 4 pi;
// that very area of a directional light, where R texels make the side of its square.
#pragma once

#include "hybrid/clusters/cluster_lights.h"
#include "shadowmap/directional_window.h"

namespace shadowdag {

/// How the resolution requested by a (cluster, light) pair is computed.
enum class ResolutionRule : uint8_t {
    kSphere, ///< the paper's equation 1: pixels over the solid angle of the cluster's sphere
    kPlane,  ///< a texel for a pixel at the cluster's mean position, on its mean plane
};

/// The lower bound of the cosines of the angles to the light and to the camera in footprints.
/// Without a bound a cluster at grazing light would decide the resolution of its whole map.
constexpr double kLeastCosine = 0.1;

/// Returns the part of a light that a pixel covers: for a point or spot light the solid angle, for
/// a directional light the area across its rays in square metres. 0 if the surface faces away from
/// the light.
/// @param position,normal unit, of the surface that the pixel shows
SDAG_HD inline double pixelShare(const ViewRays& view, const glm::dvec3& position,
                                 const glm::dvec3& normal, const Light& light) {
    const bool isDirectional = light.kind == Light::kSun;
    const glm::dvec3 toLight = isDirectional ? -glm::dvec3(light.directionWorld)
                                             : glm::dvec3(light.positionWorld) - position;
    const double facing = glm::dot(normal, toLight);
    if (!(facing > 0.0))
        return 0.0;
    const double distanceSquared = glm::dot(toLight, toLight);
    const double cosine = glm::max(facing / glm::sqrt(distanceSquared), kLeastCosine);
    const glm::dvec3 toCamera = view.origin - position;
    const double depth = -glm::dot(toCamera, view.forward);
    const double seen = glm::max(glm::dot(normal, toCamera),
                                 kLeastCosine * glm::sqrt(glm::dot(toCamera, toCamera)));
    const double side = view.pixelSize * depth;
    const double across = side * side * depth / seen * cosine;
    return isDirectional ? across : across / distanceSquared;
}

/// Returns the total measure of a light's texels times 1 / R^2: that of one texel at R = 1.
SDAG_HD inline double shareOfTexel(const Light& light) {
    constexpr double kFourPiOverSix = 2.0943951023931955;
    return light.kind == Light::kSun ? directionalExtentWorld(light) * directionalExtentWorld(light)
                                     : kFourPiOverSix;
}

/// The mean of a cluster's positions and the direction of the mean of its normals (zero where they
/// cancel out).
struct ClusterPlane {
    glm::dvec3 position{0.0}, normal{0.0};
};

/// Returns the plane of a cluster. Cost: its samples, once.
SDAG_HD inline ClusterPlane meanPlane(const GBufferView& gbuffer, const ClusterView& clusters,
                                      size_t cluster, const ViewRays& view) {
    ClusterPlane plane;
    for (uint32_t i = clusters.sampleStart[cluster]; i < clusters.sampleStart[cluster + 1]; ++i) {
        const uint32_t sample = clusters.samples[i];
        plane.position += glm::dvec3(gbuffer.positionWorld[sample]) - view.origin;
        plane.normal += glm::dvec3(gbuffer.normalWorld[sample]);
    }
    plane.position = plane.position / double(clusters.sampleCount(cluster)) + view.origin;
    const double length = glm::sqrt(glm::dot(plane.normal, plane.normal));
    plane.normal = length > 0.0 ? plane.normal / length : glm::dvec3(0.0);
    return plane;
}

} // namespace shadowdag
