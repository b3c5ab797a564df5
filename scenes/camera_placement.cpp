// SPDX-License-Identifier: Apache-2.0
// placeCamera of world.h: the best of a grid of viewpoints, by rays.
#include "scenes/triangle_grid.h"
#include "scenes/world.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace shadowdag {

namespace {

// 16 azimuths by five elevations, from tables: no libm here, so every machine places the same
// camera.
constexpr int kAzimuthCount = 16;
constexpr int kElevationCount = 5;
constexpr double kC1 = 0.92387953251128674, kS1 = 0.38268343236508977, kC2 = 0.70710678118654752;
constexpr std::array<double, kAzimuthCount> kCos = {1,  kC1,  kC2,  kS1,  0, -kS1, -kC2, -kC1,
                                                    -1, -kC1, -kC2, -kS1, 0, kS1,  kC2,  kC1};
constexpr std::array<double, kElevationCount> kElevationSin = {-kC2, -kS1, 0, kS1, kC2};
constexpr std::array<double, kElevationCount> kElevationCos = {kC2, kC1, 1, kC1, kC2};

glm::vec3 direction(int azimuth, int elevation) {
    const double c = kCos[size_t(azimuth)];
    const double s = kCos[size_t((azimuth + 12) % kAzimuthCount)]; // sin x = cos(x - pi/2)
    const double e = kElevationCos[size_t(elevation)];
    return glm::vec3(glm::dvec3(c * e, kElevationSin[size_t(elevation)], s * e));
}

} // namespace

// Candidates stand on a 10 x 4 x 10 grid inside the bounds. Each sends 80 rays; a view is a window
// of 3 x 3 of them. A ray earns the root of its length relative to the diagonal (so that a wide
// view of middling length beats a keyhole), half of that on a back face (the viewpoint may lie
// inside a solid), and nothing when it leaves the scene. The middle ray counts twice. Viewpoints
// nearer than a fiftieth of the diagonal to a surface in any direction pay in proportion. The first
// best in order wins.
Camera placeCamera(const World& world) {
    const Box& bounds = world.boundsWorld();
    const TriangleGrid grid(world.triangles(), bounds);
    const float diagonal = glm::length(bounds.extent());
    constexpr int kAcross = 10, kUp = 4;

    Camera best;
    float bestScore = -1.0f, bestClearance = 0.0f;
    for (int iy = 0; iy < kUp; ++iy)
        for (int iz = 0; iz < kAcross; ++iz)
            for (int ix = 0; ix < kAcross; ++ix) {
                const glm::vec3 at((float(ix) + 0.5f) / kAcross, (float(iy) + 0.5f) / (kUp + 1),
                                   (float(iz) + 0.5f) / kAcross);
                const glm::vec3 position = bounds.min + bounds.extent() * at;
                std::array<std::array<float, kElevationCount>, kAzimuthCount> worth{};
                float clearance = diagonal;
                for (int a = 0; a < kAzimuthCount; ++a)
                    for (int e = 0; e < kElevationCount; ++e) {
                        const TriangleGrid::Hit hit = grid.trace(position, direction(a, e));
                        clearance = std::min(clearance, hit.distance);
                        if (hit.distance < 2.0f * diagonal)
                            worth[size_t(a)][size_t(e)] = std::sqrt(hit.distance / diagonal) *
                                                          (hit.isFrontFace ? 1.0f : 0.5f);
                    }
                const float free = std::min(1.0f, clearance / (0.02f * diagonal));
                for (int a = 0; a < kAzimuthCount; ++a)
                    for (int e = 1; e + 1 < kElevationCount; ++e) {
                        float score = worth[size_t(a)][size_t(e)];
                        for (int da = -1; da <= 1; ++da)
                            for (int de = -1; de <= 1; ++de)
                                score += worth[size_t((a + da + kAzimuthCount) % kAzimuthCount)]
                                              [size_t(e + de)];
                        score *= free;
                        if (score > bestScore) {
                            bestScore = score;
                            bestClearance = clearance;
                            best.positionWorld = position;
                            best.forward = direction(a, e);
                        }
                    }
            }
    best.forward = glm::normalize(best.forward);
    const glm::vec3 right = glm::normalize(glm::cross(best.forward, glm::vec3(0, 1, 0)));
    best.up = glm::normalize(glm::cross(right, best.forward));
    const float unit = diagonal > 0.0f ? diagonal : 1.0f;
    best.znear = std::clamp(0.5f * bestClearance, unit * 1e-4f, unit * 2e-3f);
    const glm::vec3 far = glm::max(glm::abs(bounds.min - best.positionWorld),
                                   glm::abs(bounds.max - best.positionWorld));
    best.zfar = std::max(1.01f * glm::length(far), 2.0f * best.znear);
    return best;
}

} // namespace shadowdag
