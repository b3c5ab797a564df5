// SPDX-License-Identifier: Apache-2.0
// placeCamera of world.h: the view that sees most of the scene's open space, by rays.
#include "scenes/open_space.h"
#include "scenes/world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace shadowdag {

namespace {

constexpr uint64_t kSeed = 1;

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

// What one ray of a view sees.
struct Sample {
    bool isHit = false, isFront = false;
    float distance = 0.0f;
    glm::vec3 position{0.0f}, normal{0.0f}; // the normal towards the eye, unit or zero
};

class ViewJudge {
public:
    ViewJudge(const World& world, const OpenSpace& open) : world_(world), open_(open) {}

    Sample look(const glm::vec3& eye, const glm::vec3& d) const {
        const TriangleGrid::Hit hit = open_.grid().trace(eye, d);
        Sample sample;
        if (!std::isfinite(hit.distance))
            return sample;
        const TriangleView triangles = world_.triangles();
        const glm::vec3 a = triangles.vertex(hit.triangle, 0);
        glm::vec3 normal = glm::cross(triangles.vertex(hit.triangle, 1) - a,
                                      triangles.vertex(hit.triangle, 2) - a);
        const float length = std::sqrt(glm::dot(normal, normal));
        if (length > 0.0f)
            normal *= (glm::dot(normal, d) > 0.0f ? -1.0f : 1.0f) / length;
        return {true, hit.isFrontFace, hit.distance, eye + d * hit.distance, normal};
    }

    /// Returns the worth of a view of width x height samples in rows; see world.h. Shadow rays are
    /// traced only when `withShadows`.
    float score(const std::vector<Sample>& view, int width, bool withShadows) const {
        const float unit = std::max(open_.typicalOpenness(), 1e-30f);
        const int height = int(view.size()) / width;
        int hitCount = 0, backCount = 0, nearCount = 0, edgeCount = 0;
        float reach = 0.0f;
        std::array<int, kDepthBinCount * kNormalBinCount> bins{};
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const Sample& s = view[size_t(y * width + x)];
                if (x + 1 < width && isEdge(s, view[size_t(y * width + x + 1)]))
                    ++edgeCount;
                if (y + 1 < height && isEdge(s, view[size_t((y + 1) * width + x)]))
                    ++edgeCount;
                if (!s.isHit)
                    continue;
                ++hitCount;
                backCount += s.isFront ? 0 : 1;
                nearCount += s.distance < 0.3f * unit ? 1 : 0;
                reach += s.distance / (s.distance + 2.0f * unit);
                ++bins[size_t(binOf(s, unit))];
            }
        if (hitCount == 0)
            return 0.0f;
        const auto share = [&](int count) { return float(count) / float(hitCount); };
        float same = 0.0f; // the chance that two samples fall into the same bin
        for (int count : bins)
            same += share(count) * share(count);
        const float edges =
            float(edgeCount) / float(std::max(1, (width - 1) * height + width * (height - 1)));
        const float escape = 1.0f - float(hitCount) / float(view.size());
        const auto penalty = [](float excess) {
            const float rest = std::max(0.0f, 1.0f - std::max(0.0f, excess));
            return rest * rest;
        };
        return reach / float(hitCount) * (1.2f - same) * (0.5f + std::min(edges, 0.5f)) *
               penalty(2.0f * share(nearCount)) * penalty(escape - 0.1f) *
               penalty(2.0f * (share(backCount) - open_.typicalBackShare())) *
               lightWorth(view, hitCount, withShadows);
    }

private:
    static constexpr int kDepthBinCount = 8, kNormalBinCount = 6;

    static bool isEdge(const Sample& a, const Sample& b) {
        if (!a.isHit || !b.isHit)
            return a.isHit != b.isHit;
        return a.distance > 1.3f * b.distance || b.distance > 1.3f * a.distance ||
               glm::dot(a.normal, b.normal) < 0.7f;
    }

    // Octaves of distance, 1/8 to 8 units and beyond, by where the normal points most.
    static int binOf(const Sample& s, float unit) {
        int depth = 0;
        for (float limit = 0.125f * unit; depth + 1 < kDepthBinCount && s.distance > limit;
             limit *= 2.0f)
            ++depth;
        const glm::vec3 n = glm::abs(s.normal);
        const int axis = n.x >= n.y ? (n.x >= n.z ? 0 : 2) : (n.y >= n.z ? 1 : 2);
        return (depth * 3 + axis) * 2 + (s.normal[axis] < 0.0f ? 1 : 0);
    }

    // Best at 8 to 16 lights a sample, 3/10 to 6/10 of them dark, many of them lighting something.
    float lightWorth(const std::vector<Sample>& view, int hitCount, bool withShadows) const {
        const std::vector<Light>& lights = world_.lights();
        if (lights.empty())
            return 1.0f;
        size_t pairCount = 0, tracedCount = 0, darkCount = 0, unlitCount = 0;
        std::vector<uint8_t> isSeen(lights.size(), 0);
        const float lift = 1e-3f * open_.typicalOpenness();
        for (const Sample& s : view) {
            if (!s.isHit)
                continue;
            const size_t pairsBefore = pairCount;
            size_t ofSample = 0;
            for (size_t l = 0; l < lights.size(); ++l) {
                if (!lightReaches(lights[l], s.position) ||
                    !(glm::dot(towardsLight(lights[l], s.position), s.normal) > 0.0f))
                    continue;
                ++pairCount;
                // The first four pairs of a sample from a light on that differs by sample.
                if (withShadows && ofSample++ < 4) {
                    ++tracedCount;
                    if (open_.sees(s.position + s.normal * lift,
                                   pointAtLight(lights[l], s.position)))
                        isSeen[l] = 1;
                    else
                        ++darkCount;
                } else if (!withShadows)
                    isSeen[l] = 1;
            }
            unlitCount += pairCount == pairsBefore ? 1 : 0;
        }
        const float mean = float(pairCount) / float(hitCount);
        const auto seenCount = float(std::count(isSeen.begin(), isSeen.end(), 1));
        const float many = mean / (mean + 4.0f) * std::min(1.0f, 16.0f / (mean + 1e-6f));
        const float seen = seenCount / (seenCount + 4.0f);
        float dark = 1.0f;
        if (tracedCount > 0) {
            const float share = float(darkCount) / float(tracedCount);
            dark = 0.4f + 2.0f * std::min(share, 0.3f) - std::max(0.0f, share - 0.6f);
        }
        const float reached = 1.0f - float(unlitCount) / float(hitCount);
        return 0.05f + many * seen * dark * reached * reached;
    }

    const World& world_;
    const OpenSpace& open_;
};

struct Sight {
    float score;
    uint32_t station;
    glm::vec3 forward;
};

// Best first, ties by order of appearance.
bool isBetter(const Sight& a, const Sight& b) {
    return a.score > b.score;
}

} // namespace

Camera placeCamera(const World& world) {
    const Box& bounds = world.boundsWorld();
    const OpenSpace open(world.triangles(), bounds, world.lights(), kSeed);
    const ViewJudge judge(world, open);
    const std::vector<OpenSpace::Station>& stations = open.stations();

    // Coarse: 80 rays a station, windows of 3 x 3 of them; a station's two best go on.
    constexpr size_t kMaxStations = 160, kFinalists = 40;
    std::vector<Sight> views;
    for (uint32_t i = 0; i < std::min(stations.size(), kMaxStations); ++i) {
        std::array<std::array<Sample, kElevationCount>, kAzimuthCount> around;
        for (int a = 0; a < kAzimuthCount; ++a)
            for (int e = 0; e < kElevationCount; ++e)
                around[size_t(a)][size_t(e)] = judge.look(stations[i].position, direction(a, e));
        std::vector<Sight> ofStation;
        for (int a = 0; a < kAzimuthCount; ++a)
            for (int e = 1; e <= 2; ++e) {
                std::vector<Sample> window;
                for (int de = -1; de <= 1; ++de)
                    for (int da = -1; da <= 1; ++da)
                        window.push_back(around[size_t((a + da + kAzimuthCount) % kAzimuthCount)]
                                               [size_t(e + de)]);
                ofStation.push_back({judge.score(window, 3, false), i, direction(a, e)});
            }
        std::stable_sort(ofStation.begin(), ofStation.end(), isBetter);
        views.insert(views.end(), ofStation.begin(), ofStation.begin() + 2);
    }
    std::stable_sort(views.begin(), views.end(), isBetter);
    views.resize(std::min(views.size(), kFinalists));

    // Fine: the field of view of a 16:9 picture, 16 x 9 rays, with shadows.
    Camera best;
    constexpr int kWidth = 16, kHeight = 9;
    constexpr float kTanHalfFov = 0.4830550656f; // of Camera's yfov, 0.9
    float bestScore = -1.0f;
    for (const Sight& view : views) {
        const glm::vec3 forward = glm::normalize(view.forward);
        const glm::vec3 right = glm::normalize(glm::cross(forward, glm::vec3(0, 1, 0)));
        const glm::vec3 up = glm::normalize(glm::cross(right, forward));
        std::vector<Sample> samples;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const float u = (2.0f * (float(x) + 0.5f) / kWidth - 1.0f) * (16.0f / 9.0f);
                const float v = 1.0f - 2.0f * (float(y) + 0.5f) / kHeight;
                samples.push_back(
                    judge.look(stations[view.station].position,
                               glm::normalize(forward + (right * u + up * v) * kTanHalfFov)));
            }
        const float score = judge.score(samples, kWidth, true);
        if (score > bestScore) {
            bestScore = score;
            best.positionWorld = stations[view.station].position;
            best.forward = forward;
            best.up = up;
        }
    }
    const float diagonal = glm::length(bounds.extent());
    const float unit = diagonal > 0.0f ? diagonal : 1.0f;
    const float clearance = open.grid().distance(best.positionWorld, 0.02f * unit);
    best.znear = std::clamp(0.5f * clearance, unit * 1e-4f, unit * 2e-3f);
    const glm::vec3 far = glm::max(glm::abs(bounds.min - best.positionWorld),
                                   glm::abs(bounds.max - best.positionWorld));
    best.zfar = std::max(1.01f * glm::length(far), 2.0f * best.znear);
    return best;
}

} // namespace shadowdag
