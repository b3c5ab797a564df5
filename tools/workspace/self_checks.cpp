// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/self_checks.h"

#include "cuda/parallel_for.h"
#include "hybrid/judge/own_taps.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>

namespace shadowdag {

namespace {

/// A pair is asked about only where rounding cannot decide it.
constexpr double kMargin = 1e-5;

enum class Belongs : uint8_t { kNo, kYes, kEither };

/// Returns whether a value that must be positive is, within kMargin of a scale.
Belongs isPositive(double value, double scale) {
    return value > kMargin * scale    ? Belongs::kYes
           : value < -kMargin * scale ? Belongs::kNo
                                      : Belongs::kEither;
}

/// Returns whether a sample and a light are a pair by the definition in docs/method.md.
Belongs isPairByDefinition(const Light& light, const glm::dvec3& position,
                           const glm::dvec3& normal) {
    if (light.kind == Light::kSun)
        return isPositive(-glm::dot(glm::dvec3(light.directionWorld), normal), 1.0);
    const glm::dvec3 toLight = glm::dvec3(light.positionWorld) - position;
    const double distance = glm::length(toLight), range = light.rangeWorld;
    Belongs all = isPositive(range - distance, range);
    const auto also = [&](Belongs one) {
        all = all == Belongs::kNo || one == Belongs::kNo ? Belongs::kNo
              : all == Belongs::kYes                     ? one
                                                         : all;
    };
    // The spacing of floats at the coordinates is a part of the rounding.
    const double scale = distance + glm::length(position) + glm::length(toLight);
    also(isPositive(glm::dot(toLight, normal), scale));
    if (light.kind == Light::kSpot)
        also(isPositive(-glm::dot(toLight, glm::dvec3(light.directionWorld)) -
                            double(light.cosOuter) * distance,
                        scale));
    return all;
}

/// The rays of a camera's pixels, from its numbers alone.
struct ViewFrame {
    ViewFrame(const Camera& camera, const GBufferView& gbuffer)
        : eye(camera.positionWorld), forward(glm::normalize(glm::dvec3(camera.forward))),
          right(glm::normalize(glm::cross(forward, glm::dvec3(camera.up)))),
          up(glm::cross(right, forward)),
          pixel(2.0 * std::tan(0.5 * double(camera.yfov)) / gbuffer.height), width(gbuffer.width),
          height(gbuffer.height) {}

    /// Returns the way from the eye through a sample's pixel, of depth 1. @param dx,dy pixels right
    /// of its centre and over it
    glm::dvec3 wayOf(size_t sample, double dx = 0.0, double dy = 0.0) const {
        const double x = double(sample % width) + 0.5 - 0.5 * width + dx;
        const double y = 0.5 * height - double(sample / width) - 0.5 + dy;
        return forward + right * (x * pixel) + up * (y * pixel);
    }

    glm::dvec3 eye, forward, right, up;
    double pixel; ///< side at depth 1
    uint32_t width, height;
};

/// Returns how many pairs a frame lists that are none by the definition in docs/method.md, or
/// lacks; where rounding decides, none.
uint64_t countWrongPairs(const World& world, const PairResults& answers) {
    const GBufferView& gbuffer = answers.gbuffer;
    const PairList& pairs = answers.frame.pairs;
    const std::vector<Light>& lights = world.lights();
    uint64_t wrong = 0;
    for (size_t s = 0; s < gbuffer.count(); ++s) {
        uint64_t at = pairs.sampleStart[s];
        for (uint32_t l = 0; l < lights.size(); ++l) {
            const bool isListed = at < pairs.sampleStart[s + 1] && pairs.light[at] == l;
            at += isListed;
            const Belongs belongs =
                gbuffer.triangle[s] == kBackground
                    ? Belongs::kNo
                    : isPairByDefinition(lights[l], glm::dvec3(gbuffer.positionWorld[s]),
                                         glm::dvec3(gbuffer.normalWorld[s]));
            wrong += belongs == (isListed ? Belongs::kNo : Belongs::kYes);
        }
        wrong += pairs.sampleStart[s + 1] - at; // listed twice or out of order
    }
    return wrong;
}

/// Returns how many samples are a twentieth of a pixel or more off the ray of their pixel.
uint64_t countWrongSamples(const Camera& camera, const GBufferView& gbuffer) {
    const ViewFrame view(camera, gbuffer);
    uint64_t wrong = 0;
    for (size_t s = 0; s < gbuffer.count(); ++s) {
        if (gbuffer.triangle[s] == kBackground)
            continue;
        const glm::dvec3 way = glm::dvec3(gbuffer.positionWorld[s]) - view.eye;
        const double depth = glm::dot(way, view.forward);
        const glm::dvec3 onRay = view.wayOf(s) * depth;
        const double rounding = 0x1p-22 * (glm::length(view.eye) + glm::length(way));
        wrong += !(glm::length(way - onRay) <= 0.05 * view.pixel * depth + rounding);
    }
    return wrong;
}

/// Returns how many samples Embree does not see from the camera: a triangle lies before them, by at
/// least a thousandth of their depth, on the ray of their pixel and on four rays a twentieth of a
/// pixel beside it. Of the background, which begins at the far plane, too, as far as the scene
/// reaches: Embree takes no ray to where floats end.
uint64_t countHiddenSamples(const Truth& truth, const Camera& camera, const Box& bounds,
                            const GBufferView& gbuffer) {
    const ViewFrame view(camera, gbuffer);
    const glm::dvec3 farthest = glm::max(glm::abs(glm::dvec3(bounds.min) - view.eye),
                                         glm::abs(glm::dvec3(bounds.max) - view.eye));
    const double background = std::min(double(camera.zfar), 1.01 * glm::length(farthest));
    constexpr double kBeside = 0.05, kBefore = 1.0 - 1e-3; // pixels; of the distance
    constexpr double kPlaces[][2] = {
        {0, 0}, {kBeside, 0}, {-kBeside, 0}, {0, kBeside}, {0, -kBeside}};
    std::atomic<uint64_t> hidden{0};
    cpuParallelRanges(gbuffer.count(), 1024, [&](size_t begin, size_t end) {
        uint64_t count = 0;
        for (size_t s = begin; s < end; ++s) {
            const double depth =
                gbuffer.triangle[s] == kBackground
                    ? background
                    : glm::dot(glm::dvec3(gbuffer.positionWorld[s]) - view.eye, view.forward);
            TruthRay rays[std::size(kPlaces)];
            uint8_t blocked[std::size(kPlaces)];
            for (size_t i = 0; i < std::size(kPlaces); ++i) {
                const glm::dvec3 way = view.wayOf(s, kPlaces[i][0], kPlaces[i][1]);
                rays[i] = truth.segmentRay(glm::vec3(view.eye + way * double(camera.znear)),
                                           glm::vec3(view.eye + way * (depth * kBefore)));
                rays[i].receiver = gbuffer.triangle[s];
            }
            truth.traceBlocked(rays, std::size(kPlaces), blocked);
            count += depth * kBefore > double(camera.znear) &&
                     std::all_of(std::begin(blocked), std::end(blocked),
                                 [](uint8_t is) { return is != 0; });
        }
        hidden += count;
    });
    return hidden;
}

/// Returns how many maps have fewer texels than the frame's records ask for.
uint64_t countWrongResolutions(const PairResults& answers) {
    uint64_t wrong = 0;
    size_t drawn = 0;
    const View<const ShadowMapInfo> maps = answers.method.maps.maps;
    for (const MapRecord& record : answers.frame.maps) {
        if (record.route != Route::kMap)
            continue;
        const double asked =
            double(record.quantities.faceTexels) / double(answers.frame.counts.maps.degradeDivisor);
        wrong += drawn >= maps.count || !(double(maps[drawn].faceTexels) + 1.0 > asked);
        ++drawn;
    }
    return wrong;
}

/// Returns how many pairs of maps have another visibility than the stored depths of a map of their
/// light give, read by taps that are made in double (own_taps.h); where rounding chooses the
/// texels, pairs are left out.
uint64_t countWrongLookups(const World& world, const PairResults& answers) {
    const PairList& pairs = answers.frame.pairs;
    const ShadowMapView& maps = answers.method.maps;
    constexpr double kRounding = 2.0 / 255.0;
    uint64_t wrong = 0;
    for (size_t s = 0; s < answers.gbuffer.count(); ++s)
        for (uint64_t p = pairs.sampleStart[s]; p < pairs.sampleStart[s + 1]; ++p) {
            const PairServer server = answers.frame.pairServer[p];
            if (!server.isMap())
                continue;
            if (!isMapOf(maps.maps[server.map()], world.lights()[pairs.light[p]])) {
                ++wrong;
                continue;
            }
            const OwnTaps taps =
                makeOwnTaps(maps.maps[server.map()], answers.gbuffer.positionWorld[s],
                            answers.gbuffer.normalWorld[s], answers.method.bias);
            if (taps.isAtBorder)
                continue;
            const glm::dvec2 range = ownVisibility(maps, server.map(), taps);
            const double is = answers.frame.visibility[p] / 255.0;
            wrong += is < range.x - kRounding || is > range.y + kRounding;
        }
    return wrong;
}

} // namespace

uint64_t countWrongColors(const World& world, const PairResults& answers) {
    const std::vector<glm::vec3> expected =
        shadePairs(answers.gbuffer, world, answers.frame.pairs, answers.frame.visibility);
    uint64_t wrong = 0;
    for (size_t s = 0; s < expected.size(); ++s)
        for (int c = 0; c < 3; ++c) {
            const float is = answers.frame.color[s][c], should = expected[s][c];
            if (is != should && // infinite ones, too
                !(std::fabs(is - should) <= 1e-4f * (std::fabs(is) + std::fabs(should)) + 1e-9f)) {
                ++wrong;
                break;
            }
        }
    return wrong;
}

SelfChecks checkFrame(Workspace& workspace, const PairResults& answers, const ErrorReport& report) {
    const World& world = workspace.world();
    const Camera camera = workspace.camera();
    SelfChecks checks;
    checks.wrongListPairCount = countWrongPairs(world, answers);
    checks.misplacedSampleCount = countWrongSamples(camera, answers.gbuffer);
    checks.hiddenSampleCount =
        countHiddenSamples(workspace.truth(), camera, world.boundsWorld(), answers.gbuffer);
    checks.wrongLookupCount = countWrongLookups(world, answers);
    checks.coarserMapCount = countWrongResolutions(answers);
    checks.wrongColorCount = countWrongColors(world, answers);
    checks.beyondBeliefCount = report.beyondBeliefCount;
    checks.coarserCellCount = report.coarserCellCount;
    checks.exact = adjudicate(world, answers, report.exactWrongPairs);
    checks.promisesExact = answers.method.rays.options.triangleRays != TriangleRays::kEmbree;
    return checks;
}

std::string SelfChecks::text() const {
    std::string text;
    const auto add = [&](uint64_t count, const char* what) {
        if (count > 0)
            text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
    };
    add(wrongListPairCount, "pairs that the frame lacks or has too many of");
    add(misplacedSampleCount, "samples beside the ray of their pixel");
    add(hiddenSampleCount, "samples that another surface hides from the camera");
    add(beyondBeliefCount, "pairs dark by voxels farther from the outline than --believe allows");
    add(coarserCellCount, "pairs dark by cells larger than their level of detail");
    if (promisesExact)
        add(exact.provenWrongCount, "answers of exact tests that are proven wrong");
    add(wrongLookupCount, "lookups unlike the stored depths of their light's map");
    add(coarserMapCount, "maps of fewer texels than were asked");
    add(wrongColorCount, "colours unlike those of their pairs");
    return text.empty()
               ? text
               : "the frame is not what its method promises, whatever the truth says: " + text +
                     "; please report it with the scene";
}

Json SelfChecks::json() const {
    Json json = {{"wrong_list_pair_count", wrongListPairCount},
                 {"misplaced_sample_count", misplacedSampleCount},
                 {"hidden_sample_count", hiddenSampleCount},
                 {"wrong_lookup_count", wrongLookupCount},
                 {"coarser_map_count", coarserMapCount},
                 {"wrong_color_count", wrongColorCount},
                 {"beyond_belief_count", beyondBeliefCount},
                 {"coarser_cell_count", coarserCellCount}};
    json.update(exact.json());
    return json;
}

} // namespace shadowdag
