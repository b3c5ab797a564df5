// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/explain.h"

#include "hybrid/judge/clip_to_cube.h"
#include "hybrid/judge/own_segment.h"
#include "hybrid/judge/own_taps.h"
#include "hybrid/judge/pair_question.h"
#include "hybrid/judge/smooth_patch.h"
#include "scenes/split_mix.h"
#include "voxel/triangle_voxels.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace shadowdag {
namespace {

constexpr double kSqrt2 = 1.4142135623730951;

/// Returns whether the truth is dark along a tap's ray. The receiver's triangle, which is in the
/// map as well, cannot block: the ray ends before its plane.
bool isDarkAlong(const Truth& truth, TruthRay ray, uint32_t receiver) {
    ray.receiver = receiver;
    uint8_t blocked = 0;
    truth.traceBlocked(&ray, 1, &blocked);
    return blocked != 0;
}

} // namespace

std::array<glm::dvec2, kShiftCount> makeShifts(uint64_t seed) {
    constexpr int kSunflowerCount = 24;
    const glm::dvec2 golden(-0.7373688780783197,
                            0.6754902942615238); // cos and sin of 2.39996 radians
    const glm::dvec2 eighth(0.7071067811865476, 0.7071067811865476);
    const auto times = [](const glm::dvec2& a, const glm::dvec2& b) {
        return glm::dvec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
    };
    const double u = double(splitMix64(seed) >> 11) * 0x1p-53; // tangent of half the angle
    const glm::dvec2 turn = glm::dvec2(1 - u * u, 2 * u) / (1 + u * u);
    std::array<glm::dvec2, kShiftCount> shifts;
    glm::dvec2 inner = turn, rim = turn;
    int innerCount = 0;
    for (int i = 0; i < kShiftCount; ++i) {
        if (i % 4 == 3) {
            shifts[size_t(i)] = rim;
            rim = times(rim, eighth);
        } else {
            shifts[size_t(i)] = inner * std::sqrt((innerCount++ + 0.5) / kSunflowerCount);
            inner = times(inner, golden);
        }
    }
    return shifts;
}

PairJudge::PairJudge(const ErrorInputs& inputs, const Truth& truth, uint64_t seed)
    : inputs_(inputs), truth_(truth), shifts_(makeShifts(seed)) {}

PairJudge::Question PairJudge::ask(uint32_t sample, uint64_t pair, bool isDark) const {
    const VisibilityInputs& method = inputs_.method;
    const uint32_t lightIndex = inputs_.pairs.light[pair];
    Question q{};
    q.position = inputs_.gbuffer.positionWorld[sample];
    q.normal = inputs_.gbuffer.normalWorld[sample];
    q.receiver = inputs_.gbuffer.triangle[sample];
    const Light& light = inputs_.lights[lightIndex];
    q.light = pointAtLight(light, q.position);
    q.route = inputs_.pairRoute[pair];
    if (q.route == Route::kRays && method.rays.options.believesNone()) {
        q.isExact = true;
        q.rhoWorld = truth_.clearance(q.position, q.receiver);
        return q;
    }
    if (q.route == Route::kRays) {
        const VoxelGrid& grid = method.rays.dag.grid;
        const ShadowPair shadowPair{q.position, q.normal,   q.light,
                                    q.receiver, lightIndex, light.kind == Light::kSun};
        const OwnSegment own = makeOwnSegment(method.rays, shadowPair);
        q.hit.level = own.startLevel;
        // By moving geometry or, where not all voxels are believed, by triangles.
        q.isExact = isDark ? !isDarkByBelievedVoxel(method.rays, shadowPair, &q.hit)
                           : !method.rays.options.believesAll();
        if (q.isExact) {
            q.rhoWorld = truth_.clearance(q.position, q.receiver);
            return q;
        }
        q.startOffsetWorld = own.startOffsetWorld;
        q.endOffsetWorld = own.endOffsetWorld;
        const double sideOfHit = double(1u << q.hit.level);
        const glm::dvec3 middle = glm::dvec3(q.hit.cell) + 0.5 * sideOfHit;
        const uint32_t coarsest = isDark ? own.coarsestLevelAt(middle, sideOfHit) : own.startLevel;
        q.isCoarserThanAsked = q.hit.level > coarsest;
        // A cell coarser than the rule asks does not excuse itself.
        const double side = q.isCoarserThanAsked ? double(1u << coarsest) : sideOfHit;
        q.rhoWorld = kSqrt3 * side * grid.voxelSizeWorld + own.liftWorld;
        double magnification = 1.0, leastMagnification = 1.0;
        if (isDark && !shadowPair.isDirectional) {
            const double near = glm::length(middle - own.lightVoxel);
            const double far =
                glm::length(grid.voxelFromWorld(glm::dvec3(q.position)) - own.lightVoxel);
            magnification = std::max(far / std::max(near, 0.5 * side), 1.0);
            leastMagnification = std::max(far / (near + 0.5 * kSqrt3 * sideOfHit), 1.0);
        }
        q.displacedWorld = kSqrt3 * side * magnification * grid.voxelSizeWorld + own.liftWorld;
        q.leastDisplacedWorld = kSqrt3 * side * leastMagnification * grid.voxelSizeWorld;
        return q;
    }
    q.map = inputs_.pairServer[pair].map();
    const ShadowMapInfo& map = method.maps.maps[q.map];
    double texelWorld;
    if (isDark) {
        q.trace =
            ownTrace(method.maps, q.map, makeOwnTaps(map, q.position, planeNormal(q), method.bias));
        texelWorld = q.trace.texelWorld;
    } else {
        const TruthBlocker found = truth_.blocker(q.position, q.normal, q.receiver, q.light);
        const glm::vec3 toLight = glm::normalize(q.light - q.position);
        texelWorld = texelWorldAt(
            map, q.position + toLight * found.distanceWorld); // the receiver's when lit
    }
    // A map that has fewer texels than its clusters request is held to those: coarser ones explain
    // nothing, and are no reason to skip more of the ray.
    const float asked = q.map < inputs_.askedTexels.size() ? inputs_.askedTexels[q.map] : 0.0f;
    q.isCoarserThanAsked = double(map.faceTexels) < double(asked);
    const double given = q.isCoarserThanAsked ? double(map.faceTexels) / double(asked) : 1.0;
    // The part of the ray that the lookup's bias skips, as a share of its length: see `forgiven`
    // there.
    q.startOffsetWorld = glm::length(glm::dvec3(q.light) - glm::dvec3(q.position)) *
                         std::min(2.0 * method.bias.constantTexels / map.faceTexels, 0.5) * given;
    if (map.window.isDirectional())
        q.startOffsetWorld = method.bias.constantTexels * texelWorldAt(map, q.position);
    if (map.lodTexels >
        0.0f) { // the plane is lifted along its normal, down to half the light's height
        const glm::dvec3 toLight(q.light - q.position);
        const double distance = glm::length(toLight);
        double height = glm::dot(glm::dvec3(q.normal), toLight);
        if (map.window.isDirectional()) // as far as lookups lift it
            height = std::max(height, distance * kLeastFacingOfLevels);
        q.startOffsetWorld += distance * given *
                              std::min(map.lodTexels * texelWorldAt(map, q.position) / height, 0.5);
    }
    q.endOffsetWorld = 0.0;
    q.isOfOwnLight = isMapOf(map, inputs_.lights[inputs_.pairs.light[pair]]);
    // Half the diagonal of the filter's box of (side - 1)^2 texels, and a texel.
    const double texels = (0.5 * kSqrt2 * (filterSide(method.bias.taps) - 1) + 1.0) * given;
    q.ownRhoWorld = texels / given * texelWorld;
    q.rhoWorld = texels * texelWorld;
    q.displacedWorld = texels * texelWorldAt(map, q.position);
    return q;
}

bool PairJudge::isMagnified(const Question& q) const {
    const RayDetail& detail = inputs_.method.rays.detail;
    return detail.pixelSize > 0.0 && // else the pixels are not known
           q.displacedWorld > kMagnifiedFootprints * pixelFootprintWorld(detail, q.position);
}

glm::vec3 PairJudge::planeNormal(const Question& q) const {
    return inputs_.hasPlane ? q.normal : glm::vec3(0.0f);
}

void PairJudge::forTrianglesInCell(const Question& q,
                                   const std::function<void(uint32_t)>& visit) const {
    const VoxelGrid& grid = inputs_.method.rays.dag.grid;
    const double side = double(1u << q.hit.level);
    truth_.forTrianglesNear(
        grid.worldFromVoxel(glm::dvec3(q.hit.cell) + 0.5 * side),
        0.5 * kSqrt3 * side * grid.voxelSizeWorld, [&](uint32_t triangle) {
            const glm::vec3 corners[3] = {inputs_.triangles.vertex(triangle, 0),
                                          inputs_.triangles.vertex(triangle, 1),
                                          inputs_.triangles.vertex(triangle, 2)};
            if (touchesCube(setupTriangle(grid, corners), glm::ivec3(q.hit.cell), int(side)))
                visit(triangle);
        });
}

bool PairJudge::isAcne(const Question& q) const {
    if (q.receiver == kBackground || q.isExact)
        return false;
    const auto isOwn = [&](uint32_t triangle, const std::vector<uint32_t>& patch) {
        return std::find(patch.begin(), patch.end(), triangle) != patch.end() ||
               truth_.isCoplanar(q.receiver, triangle);
    };
    const auto patchIf = [&](bool isNear) { // most blockers are far away
        return isNear ? smoothPatch(truth_, inputs_.triangles, q.receiver, q.position, q.rhoWorld)
                      : std::vector<uint32_t>();
    };
    if (q.route == Route::kRays) {
        const VoxelGrid& grid = inputs_.method.rays.dag.grid;
        const glm::dvec3 sample = grid.voxelFromWorld(glm::dvec3(q.position)), low(q.hit.cell);
        const glm::dvec3 nearest = glm::clamp(sample, low, low + double(1u << q.hit.level));
        const std::vector<uint32_t> patch =
            patchIf(glm::length(nearest - sample) * grid.voxelSizeWorld <= q.rhoWorld);
        bool hasOwn = false;
        forTrianglesInCell(q,
                           [&](uint32_t triangle) { hasOwn = hasOwn || isOwn(triangle, patch); });
        return hasOwn;
    }
    if (q.trace.texelWorld == 0.0f) // dark because of missing pages, or lit: no blocker
        return false;
    const glm::dvec3 v0(inputs_.triangles.vertex(q.receiver, 0));
    const glm::dvec3 cross = glm::cross(glm::dvec3(inputs_.triangles.vertex(q.receiver, 1)) - v0,
                                        glm::dvec3(inputs_.triangles.vertex(q.receiver, 2)) - v0);
    const glm::dvec3 blocker(q.trace.blockerWorld);
    const bool isAtPlane =
        std::fabs(glm::dot(cross, blocker - v0)) <= double(q.trace.texelWorld) * glm::length(cross);
    const bool isNear = glm::length(blocker - glm::dvec3(q.position)) <= q.rhoWorld;
    if (!isAtPlane && !isNear)
        return false;
    // A little past the point, which has the precision of the map's 1/z.
    const glm::vec3 past = q.light + (q.trace.blockerWorld - q.light) * 1.5f;
    const uint32_t first = truth_.traceFirst(truth_.segmentRay(q.light, past));
    if (first == kBackground)
        return false;
    return (isAtPlane && truth_.isCoplanar(q.receiver, first)) ||
           (isNear && isOwn(first, patchIf(isNear)));
}

bool PairJudge::isContact(const Question& q) const {
    if (q.isExact)
        return false;
    TruthRay ray = truth_.pairRay(q.position, q.normal, q.receiver, q.light);
    const double distance = glm::length(glm::dvec3(ray.direction));
    const double tStart = q.startOffsetWorld / distance, tEnd = 1.0 - q.endOffsetWorld / distance;
    if (!(tStart < tEnd))
        return true;
    ray.startLocal = glm::vec3(glm::dvec3(ray.startLocal) + glm::dvec3(ray.direction) * tStart);
    ray.direction = glm::vec3(glm::dvec3(ray.direction) * (tEnd - tStart));
    uint8_t blocked = 0;
    truth_.traceBlocked(&ray, 1, &blocked);
    return blocked == 0;
}

bool PairJudge::anyShiftAgrees(const Question& q, bool dark) const {
    const glm::dvec3 way = glm::normalize(glm::dvec3(q.light) - glm::dvec3(q.position));
    const glm::dvec3 size = glm::abs(way);
    const glm::dvec3 axis = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                            : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                 : glm::dvec3(0, 0, 1);
    const glm::dvec3 right = glm::normalize(glm::cross(way, axis)), up = glm::cross(right, way);
    glm::dvec3 shiftsWorld[kShiftCount];
    for (int i = 0; i < kShiftCount; ++i)
        shiftsWorld[i] = (right * shifts_[size_t(i)].x + up * shifts_[size_t(i)].y) * q.rhoWorld;
    constexpr int kBatch = 8; // a packet; most pairs need no second
    for (int first = 0; first < kShiftCount; first += kBatch) {
        TruthRay rays[kBatch];
        uint8_t blocked[kBatch];
        truth_.shiftedPairRays(q.position, q.normal, q.receiver, q.light, shiftsWorld + first,
                               kBatch, rays);
        truth_.traceBlocked(rays, kBatch, blocked);
        for (int i = 0; i < kBatch; ++i)
            if ((blocked[i] != 0) == dark)
                return true;
    }
    return false;
}

bool PairJudge::anyAimedShiftIsDark(const Question& q) const {
    const glm::dvec3 start(q.position);
    const glm::dvec3 way = glm::normalize(glm::dvec3(q.light) - start);
    bool isDark = false;
    const auto aimAt = [&](const glm::dvec3& targetWorld) {
        const glm::dvec3 to = targetWorld - start;
        const glm::dvec3 shift = to - way * glm::dot(to, way);
        if (isDark || glm::length(shift) > q.rhoWorld)
            return;
        TruthRay ray;
        uint8_t blocked = 0;
        truth_.shiftedPairRays(q.position, q.normal, q.receiver, q.light, &shift, 1, &ray);
        truth_.traceBlocked(&ray, 1, &blocked);
        isDark = blocked != 0;
    };
    if (q.route == Route::kMap) {
        aimAt(glm::dvec3(q.trace.blockerWorld));
        return isDark;
    }
    const VoxelGrid& grid = inputs_.method.rays.dag.grid;
    const double side = double(1u << q.hit.level);
    const glm::dvec3 cell(q.hit.cell);
    truth_.forTrianglesNear(grid.worldFromVoxel(cell + 0.5 * side),
                            0.5 * kSqrt3 * side * grid.voxelSizeWorld, [&](uint32_t triangle) {
                                if (isDark || triangle == q.receiver)
                                    return;
                                std::vector<glm::dvec3> part(3);
                                for (int corner = 0; corner < 3; ++corner)
                                    part[size_t(corner)] = grid.voxelFromWorld(
                                        glm::dvec3(inputs_.triangles.vertex(triangle, corner)));
                                part = clipToCube(std::move(part), cell, cell + side);
                                if (part.empty())
                                    return;
                                glm::dvec3 middle(0.0);
                                for (const glm::dvec3& corner : part)
                                    middle += corner / double(part.size());
                                // Corners are moved slightly inwards, off the triangle's own
                                // border.
                                for (const glm::dvec3& corner : part)
                                    aimAt(grid.worldFromVoxel(corner + (middle - corner) * 0.01));
                                aimAt(grid.worldFromVoxel(middle));
                            });
    return isDark;
}

bool PairJudge::hasTaps(const Question& q) const {
    return q.route == Route::kMap && q.trace.missingTapCount == 0;
}

bool PairJudge::isDarkByTruthTaps(const Question& q, float constantTexels) const {
    ShadowMapInfo map = inputs_.method.maps.maps[q.map];
    if (constantTexels == 0.0f)
        map.lodTexels = 0.0f; // part of the bias
    ShadowMapBias bias = inputs_.method.bias;
    bias.constantTexels = constantTexels;
    return makeOwnTaps(map, q.position, planeNormal(q), bias).visibility([&](const OwnTap& tap) {
        const OwnTapRay ray = ownTapRay(map, tap);
        return isDarkAlong(truth_, truth_.segmentRay(ray.startWorld, ray.endWorld), q.receiver);
    }) < 0.5;
}

PairJudge::Promises PairJudge::promisesOf(const Question& q) const {
    Promises promises;
    promises.isExact = q.isExact;
    if (q.route != Route::kRays || q.isExact)
        return promises;
    const RayInputs& rays = inputs_.method.rays;
    promises.isCoarserCell = q.isCoarserThanAsked;
    promises.isBeyondBelief =
        !rays.options.believesAll() &&
        q.leastDisplacedWorld >
            double(rays.options.believe) * pixelFootprintWorld(rays.detail, q.position);
    return promises;
}

PairVerdict PairJudge::judge(uint32_t sample, uint64_t pair, bool isDark,
                             Promises* promises) const {
    const Question q = ask(sample, pair, isDark);
    if (promises)
        *promises = promisesOf(q);
    if (isDark ? isAcne(q) : isContact(q))
        return isDark ? PairVerdict::kAcne : PairVerdict::kContact;
    const bool isExplained = anyShiftAgrees(q, isDark);
    if (isMagnified(q) && (isExplained || (isDark && anyAimedShiftIsDark(q))))
        return PairVerdict::kMagnified;
    if (isExplained)
        return PairVerdict::kExplained;
    if (q.isExact)
        return PairVerdict::kUnexplained;
    if (isDark && anyAimedShiftIsDark(q))
        return PairVerdict::kSettled;
    // The taps' rays of a coarser map are farther than rho, and those of another light's elsewhere.
    if (!hasTaps(q) || q.isCoarserThanAsked || !q.isOfOwnLight)
        return PairVerdict::kUnexplained;
    for (const float constantTexels : {0.0f, inputs_.method.bias.constantTexels})
        if (isDarkByTruthTaps(q, constantTexels) == isDark)
            return PairVerdict::kTapSettled;
    return PairVerdict::kUnexplained;
}

PairJudge::Flips PairJudge::flips(uint32_t sample, uint64_t pair, bool isDark) const {
    const Question q = ask(sample, pair, isDark);
    Flips flips;
    flips.isMagnified = isMagnified(q);
    if (flips.isMagnified)
        return flips; // its reverse would be magnified, not explained
    flips.byShifts = anyShiftAgrees(q, !isDark);
    flips.hasTaps = hasTaps(q);
    flips.byTaps = flips.hasTaps && isDarkByTruthTaps(q, 0.0f) != isDark;
    return flips;
}

} // namespace shadowdag
