// SPDX-License-Identifier: Apache-2.0
// placeCameras: the views that see most of the scene's open space and of what its lights
// do there, by rays.
#include "scenes/camera_placement.h"

#include "cuda/cancel.h"
#include "scenes/surface_sampler.h"
#include "scenes/view_score.h"
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

// The field of view of a picture of 16 by 9 with Camera's yfov, 0.9.
constexpr int kWidth = 16, kHeight = 9;
constexpr float kSinHalfFov = 0.4349655341f, kTanHalfFov = 0.4830550656f;

constexpr size_t kMaxStations = 160; ///< of the open space
constexpr size_t kMaxLitLights = 64; ///< lights around which more stations are looked for
constexpr size_t kFinalists = 80;
/// Shares of rays that escape from the open space: beyond the first a scene is seen from outside as
/// well, beyond the second, as of a model without ground, from outside alone.
constexpr float kOpenEscape = 0.35f, kAllAroundEscape = 0.55f;
constexpr size_t kCoarseRays = 2, kFineRays = 16; ///< shadow rays a sample
constexpr int kLitElevationCount = 4;             ///< no window of coarse rays holds the highest

glm::vec3 direction(int azimuth, int elevation) {
    const double c = kCos[size_t(azimuth)];
    const double s = kCos[size_t((azimuth + 12) % kAzimuthCount)]; // sin x = cos(x - pi/2)
    const double e = kElevationCos[size_t(elevation)];
    return glm::vec3(glm::dvec3(c * e, kElevationSin[size_t(elevation)], s * e));
}

/// A view in question, and what is known of it.
struct Sight {
    float score = 0.0f;
    glm::vec3 position{0.0f}, forward{0, 0, -1}, up{0, 1, 0};
    bool isOrbit = false; ///< from outside, of all that there is
    ViewLight light;
};

// Best first, ties by order of appearance.
bool isBetter(const Sight& a, const Sight& b) {
    return a.score > b.score;
}

/// The places from which views are tried, and the length by which they are judged.
struct Stations {
    std::vector<glm::vec3> positions;
    float unit;
};

/// Finds places of the open space and near the lights, which its most open part may leave out: of a
/// map under a large sky that part is the sky. Rooms with lights then give the unit, too.
Stations findStations(const World& world, const OpenSpace& open) {
    const std::vector<Light>& lights = world.lights();
    const size_t tries = std::min(lights.size(), kMaxLitLights);
    PlacementRandom random(kSeed);
    std::vector<OpenSpace::Station> around;
    for (size_t k = 0; k < tries; ++k) {
        const Light& light = lights[k * lights.size() / tries];
        if (light.kind == Light::kSun)
            continue;
        for (const OpenSpace::Station& station :
             open.stationsAround(light.positionWorld, 3, random))
            around.push_back(station);
    }
    Stations found{{}, open.typicalOpenness()};
    if (around.size() >= 8) {
        std::vector<float> openness;
        for (const OpenSpace::Station& station : around)
            openness.push_back(station.openness);
        const auto middle = openness.begin() + std::ptrdiff_t(openness.size() / 2);
        std::nth_element(openness.begin(), middle, openness.end());
        found.unit = std::min(found.unit, *middle);
    }
    for (const OpenSpace::Station& station : open.stations())
        if (found.positions.size() < kMaxStations)
            found.positions.push_back(station.position);
    for (const OpenSpace::Station& station : around)
        if (station.clearance >= 0.05f * found.unit && station.openness >= 0.4f * found.unit)
            found.positions.push_back(station.position);
    return found;
}

/// Reports the share of the rays that score views.
class RayProgress {
public:
    /// Counts on kFinalists views for fine rays: with fewer the share jumps to 1 at the end.
    RayProgress(const Progress& progress, size_t stationCount, bool hasLights)
        : progress_(progress),
          stationRays_(kAzimuthCount *
                       (kElevationCount + (hasLights ? kLitElevationCount * kCoarseRays : 0))),
          sightRays_(kWidth * kHeight * (1 + (hasLights ? kFineRays : 0))),
          allRays_(stationCount * stationRays_ + kFinalists * sightRays_) {}

    void addStation() { add(stationRays_); }
    void addSight() { add(sightRays_); }

private:
    void add(size_t rays) {
        rays_ += rays;
        pollCpu();
        if (progress_)
            progress_(std::min(1.0, double(rays_) / double(allRays_)));
    }

    const Progress& progress_;
    size_t stationRays_, sightRays_, allRays_, rays_ = 0;
};

/// Adds the two best views of every station: 80 rays, windows of 3 x 3 of them, two shadow rays a
/// ray.
void addCoarse(const ViewScore& score, const std::vector<glm::vec3>& stations, bool hasLights,
               RayProgress& progress, std::vector<Sight>& sights) {
    for (const glm::vec3& station : stations) {
        std::array<std::array<ViewSample, kElevationCount>, kAzimuthCount> around;
        std::array<std::array<ViewLight, kElevationCount>, kAzimuthCount> lit;
        for (int a = 0; a < kAzimuthCount; ++a)
            for (int e = 0; e < kElevationCount; ++e) {
                ViewSample& sample = around[size_t(a)][size_t(e)];
                sample = score.look(station, direction(a, e));
                if (hasLights && e < kLitElevationCount)
                    lit[size_t(a)][size_t(e)] = score.light({sample}, kCoarseRays);
            }
        std::vector<Sight> here;
        for (int a = 0; a < kAzimuthCount; ++a)
            for (int e = 1; e <= 2; ++e) {
                std::vector<ViewSample> window;
                ViewLight light;
                for (int de = -1; de <= 1; ++de)
                    for (int da = -1; da <= 1; ++da) {
                        const auto azimuth = size_t((a + da + kAzimuthCount) % kAzimuthCount);
                        window.push_back(around[azimuth][size_t(e + de)]);
                        if (hasLights)
                            light += lit[azimuth][size_t(e + de)];
                    }
                Sight sight;
                sight.score = score.shape(window, 3) * score.lightWorth(light);
                sight.position = station;
                sight.forward = glm::normalize(direction(a, e));
                here.push_back(std::move(sight));
            }
        std::stable_sort(here.begin(), here.end(), isBetter);
        sights.insert(sights.end(), here.begin(), here.begin() + 2);
        progress.addStation();
    }
}

/// Adds views of all of a world that stands in the open, such as a model: from outside, around it.
void addOrbit(const Box& bounds, std::vector<Sight>& sights) {
    const glm::vec3 center = 0.5f * (bounds.min + bounds.max);
    const float radius = 0.5f * glm::length(bounds.extent());
    for (int a = 0; a < kAzimuthCount; a += 2)
        for (int e = 3; e <= 4; ++e) { // from above
            Sight sight;
            glm::vec3 out = direction(a, e);
            out.y *= e == 3 ? 0.6f : 0.8f;
            out = glm::normalize(out);
            sight.position = center + out * (radius / kSinHalfFov);
            sight.forward = -out;
            sight.isOrbit = true;
            sights.push_back(std::move(sight));
        }
}

/// Scores a view by the field of view of a picture, and sets its up.
void scoreFine(const ViewScore& score, Sight& sight) {
    const glm::vec3 right = glm::normalize(glm::cross(sight.forward, glm::vec3(0, 1, 0)));
    sight.up = glm::normalize(glm::cross(right, sight.forward));
    std::vector<ViewSample> samples;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const float u = (2.0f * (float(x) + 0.5f) / kWidth - 1.0f) * (16.0f / 9.0f);
            const float v = 1.0f - 2.0f * (float(y) + 0.5f) / kHeight;
            samples.push_back(score.look(
                sight.position,
                glm::normalize(sight.forward + (right * u + sight.up * v) * kTanHalfFov)));
        }
    sight.light = score.light(samples, kFineRays);
    sight.score = score.shape(samples, kWidth, sight.isOrbit ? 1.0f : 0.1f) *
                  (sight.isOrbit ? 1.0f : score.wholeObjects(samples, kWidth)) *
                  score.lightWorth(sight.light);
}

/// Returns how much a view adds to those chosen: from 0.08 for one of them again to 1. It stands or
/// looks elsewhere, and shows lights that they do not.
float novelty(const Sight& sight, const std::vector<const Sight*>& chosen, float unit) {
    if (chosen.empty())
        return 1.0f;
    float apart = 1.0f;
    for (const Sight* other : chosen) {
        const float away = glm::length(sight.position - other->position) / unit;
        const float turned = 0.5f * (1.0f - glm::dot(sight.forward, other->forward));
        apart = std::min(apart, std::max(std::min(away, 1.0f), turned));
    }
    size_t newCount = 0;
    const size_t seenCount = sight.light.seenCount();
    for (size_t l = 0; l < sight.light.isSeen.size(); ++l)
        newCount += sight.light.isSeen[l] != 0 &&
                    std::none_of(chosen.begin(), chosen.end(),
                                 [&](const Sight* other) { return other->light.isSeen[l] != 0; });
    const float isNew = seenCount > 0 ? float(newCount) / float(seenCount) : 1.0f;
    return (0.2f + 0.8f * apart) * (0.4f + 0.6f * isNew);
}

Camera cameraOf(const Sight& sight, const World& world, const OpenSpace& open) {
    const Box& bounds = world.boundsWorld();
    const float diagonal = glm::length(bounds.extent());
    const float unit = diagonal > 0.0f ? diagonal : 1.0f;
    Camera camera;
    camera.positionWorld = sight.position;
    camera.forward = sight.forward;
    camera.up = sight.up;
    const float clearance = open.tree().distance(sight.position, 0.02f * unit);
    camera.znear = std::clamp(0.5f * clearance, unit * 1e-4f, unit * 2e-3f);
    const glm::vec3 far = glm::max(glm::abs(bounds.min - camera.positionWorld),
                                   glm::abs(bounds.max - camera.positionWorld));
    camera.zfar = std::max(1.01f * glm::length(far), 2.0f * camera.znear);
    return camera;
}

} // namespace

std::vector<Camera> placeCameras(const World& world, size_t count, QueryCost* cost,
                                 const Progress& progress) {
    const Box& bounds = world.boundsWorld();
    const OpenSpace open(world.triangles(), bounds, world.lights(), kSeed);
    const Stations stations = findStations(world, open);
    const ViewScore score(world, open, stations.unit);
    std::vector<Sight> sights;
    const bool hasLights = !world.lights().empty();
    RayProgress rays(progress, stations.positions.size(), hasLights);
    addCoarse(score, stations.positions, hasLights, rays, sights);
    std::stable_sort(sights.begin(), sights.end(), isBetter);
    sights.resize(std::min(sights.size(), kFinalists));
    const bool hasExtent = glm::length(bounds.extent()) > 0.0f;
    if (hasExtent && score.typicalEscape() > kAllAroundEscape)
        sights.clear(); // nothing is inside
    if (hasExtent && score.typicalEscape() > kOpenEscape)
        addOrbit(bounds, sights);
    for (Sight& sight : sights) {
        scoreFine(score, sight);
        rays.addSight();
    }
    if (progress)
        progress(1.0);

    const float unit = std::max(2.0f * stations.unit, 1e-30f);
    std::vector<const Sight*> chosen;
    std::vector<Camera> cameras;
    while (cameras.size() < count) {
        const Sight* best = nullptr;
        float bestScore = -1.0f;
        for (const Sight& sight : sights) {
            if (std::find(chosen.begin(), chosen.end(), &sight) != chosen.end())
                continue;
            if (!chosen.empty() && hasLights &&
                (sight.light.litCount == 0 || sight.light.darkCount == 0))
                continue;
            const float worth = sight.score * novelty(sight, chosen, unit);
            if (worth > bestScore) {
                bestScore = worth;
                best = &sight;
            }
        }
        if (best == nullptr)
            break;
        chosen.push_back(best);
        cameras.push_back(cameraOf(*best, world, open));
    }
    warnOfCutQueries(open.tree().cost(), "cameras");
    if (cost != nullptr)
        *cost = open.tree().cost();
    return cameras;
}

Camera placeCamera(const World& world) {
    return placeCameras(world, 1).front();
}

} // namespace shadowdag
