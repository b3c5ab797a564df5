// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/own_taps.h"

#include "hybrid/judge/own_segment.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

namespace shadowdag {

namespace {

/// Of a limit: floats of 1/z and of the limit.
constexpr double kDepthSlack = 0x1p-18;
/// Of the lengths of two vectors: their product in floats.
constexpr double kProductSlack = 0x1p-21;
constexpr double kBorderTexels = 0x1p-12;

/// A face: 2 a looks along +a, 2 a + 1 along -a; u runs along a + 1 and v along a + 2, modulo 3.
struct Face {
    int axis, u, v;
    double sign;

    explicit Face(uint32_t face)
        : axis(int(face / 2)), u((axis + 1) % 3), v((axis + 2) % 3), sign(face % 2 ? -1.0 : 1.0) {}
    glm::dvec3 direction(double uHere, double vHere) const {
        glm::dvec3 d;
        d[axis] = sign;
        d[u] = uHere;
        d[v] = vHere;
        return d;
    }
};

/// Returns the face with the largest component, the first axis among equal ones.
uint32_t faceTowards(const glm::dvec3& d) {
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (std::fabs(d[a]) > std::fabs(d[axis]))
            axis = a;
    return uint32_t(2 * axis) + (d[axis] < 0.0);
}

double centreOf(int texel, uint32_t count) {
    return (2.0 * texel + 1.0) / count - 1.0;
}

int texelAt(double coordinate, uint32_t count) {
    return std::clamp(int(std::floor((coordinate + 1.0) * 0.5 * count)), 0, int(count) - 1);
}

/// Returns whether a position in texels is where one texel ends and the next begins.
bool isNearBorder(double s) {
    return std::fabs(s - std::round(s)) < kBorderTexels;
}

/// The texels of the filter along one axis, from `first` on, with their weights.
struct Span {
    int first, count;
    double weights[3];
};

/// 9 taps: the box of two texels around the receiver, at s texels from the face's side; 4: of one
/// texel; 1: the texel that holds it.
Span spanOf(double s, uint32_t taps, uint32_t texels, bool& isAtBorder) {
    const double inside = std::clamp(s, 0.0, double(texels));
    const int holds = std::min(int(inside), int(texels) - 1);
    const double f = inside - holds, moves = taps == 4 ? 0.5 : 0.0;
    isAtBorder |= isNearBorder(s - moves);
    if (taps == 9)
        return {holds - 1, 3, {0.5 * (1.0 - f), 0.5, 0.5 * f}};
    if (taps == 4) {
        const int first = f < 0.5 ? holds - 1 : holds;
        const double between = f < 0.5 ? f + 0.5 : f - 0.5;
        return {first, 2, {1.0 - between, between, 0.0}};
    }
    return {holds, 1, {1.0, 0.0, 0.0}};
}

constexpr double kLowTexels = 6.0; // FILTERS.md
/// Where all taps but this share are omitted, all count.
constexpr double kLeastCounted = 0.01;
/// Where the depths of a window stand in the page table: as those of a cube's face +z.
constexpr uint32_t kWindowFace = 4;
constexpr double kWindowStart = 2.0625; ///< w: depths end at 2

uint32_t tapCountOf(const ShadowMapBias& bias) {
    return bias.taps >= 9 ? 9 : bias.taps >= 4 ? 4 : 1;
}

/// A window's rows are perpendicular: u . p = place in the window along u + u0, and so on.
glm::dvec3 windowPlace(const DirectionalWindow& window, const glm::dvec3& pWorld) {
    return {glm::dot(window.u, pWorld) - window.u0, glm::dot(window.v, pWorld) - window.v0,
            glm::dot(window.w, pWorld) - window.w0};
}

glm::dvec3 worldPlace(const DirectionalWindow& window, const glm::dvec3& place) {
    const auto along = [](const glm::dvec3& row, double value) {
        return row * (value / glm::dot(row, row));
    };
    return along(window.u, place.x + window.u0) + along(window.v, place.y + window.v0) +
           along(window.w, place.z + window.w0);
}

/// Taps of a window: the receiver's plane is w as a linear form of (u, v), raised by what rounding,
/// levels of detail and the bias may move it (directional_filter.h).
OwnTaps makeWindowTaps(const ShadowMapInfo& map, const glm::dvec3& position,
                       const glm::dvec3& normal, const ShadowMapBias& bias) {
    OwnTaps own;
    const DirectionalWindow& window = map.window;
    const int n = int(map.faceTexels);
    const glm::dvec3 place = windowPlace(window, position);
    const double perWorld = glm::length(window.w); // growth of w along the light
    const double texelWorld = 2.0 / (n * glm::length(window.u));
    const double texelDepth = texelWorld * perWorld;
    const double facing = glm::dot(normal, window.w / perWorld);
    const auto slopeAlong = [&](const glm::dvec3& row) { // w a texel
        return facing > 0.0 ? -texelDepth * glm::dot(normal, glm::normalize(row)) / facing : 0.0;
    };
    const double slopeX = slopeAlong(window.u), slopeY = slopeAlong(window.v);
    const double rounding =
        0x1p-20 * perWorld *
        (largestMagnitude(glm::abs(position) + glm::abs(glm::dvec3(map.lightPositionWorld))) +
         double(map.rangeWorld));
    const double acrossLift = rounding + 0x1p-22;
    double ownLift = acrossLift;
    if (facing > 0.0)
        ownLift = rounding / std::max(facing, 0x1p-10) + 0x1p-22 +
                  double(map.lodTexels) * texelDepth / std::max(facing, 0x1p-4);
    const double low = bias.taps > 1 ? kLowTexels * texelDepth : INFINITY;
    const double x = (place.x + 1.0) * 0.5 * n, y = (place.y + 1.0) * 0.5 * n;
    const Span columns = spanOf(x, tapCountOf(bias), map.faceTexels, own.isAtBorder);
    const Span rows = spanOf(y, tapCountOf(bias), map.faceTexels, own.isAtBorder);
    for (int j = 0; j < rows.count; ++j)
        for (int i = 0; i < columns.count; ++i) {
            OwnTap tap;
            tap.face = kWindowFace;
            tap.x = uint32_t(std::clamp(columns.first + i, 0, n - 1));
            tap.y = uint32_t(std::clamp(rows.first + j, 0, n - 1));
            tap.centre = {centreOf(int(tap.x), map.faceTexels),
                          centreOf(int(tap.y), map.faceTexels), 0.0};
            tap.weight = columns.weights[i] * rows.weights[j];
            const double rise = slopeX * (tap.x + 0.5 - x) + slopeY * (tap.y + 0.5 - y);
            tap.limit = place.z + std::max(rise + ownLift, acrossLift) +
                        double(bias.constantTexels) * texelDepth;
            tap.slack = kDepthSlack * (std::fabs(tap.limit) + std::fabs(rise));
            tap.isLow = rise > low;
            own.isAtBorder |= std::fabs(rise - low) < kDepthSlack;
            own.taps.push_back(tap);
        }
    return own;
}

} // namespace

double OwnTaps::visibility(const std::function<bool(const OwnTap&)>& isDark,
                           const std::function<bool(const OwnTap&)>& isMissing) const {
    double lit = 0.0, counted = 0.0;
    for (const bool takesLow : {false, true}) {
        for (const OwnTap& tap : taps)
            if (takesLow || !tap.isLow || isMissing(tap)) {
                counted += tap.weight;
                lit += isMissing(tap) || isDark(tap) ? 0.0 : tap.weight;
            }
        if (counted > kLeastCounted)
            return lit / counted;
        lit = counted = 0.0;
    }
    return 1.0;
}

bool isMapOf(const ShadowMapInfo& map, const Light& light) {
    if (light.kind != Light::kSun)
        return !map.window.isDirectional() && map.lightPositionWorld == light.positionWorld &&
               map.rangeWorld == light.rangeWorld;
    if (!map.window.isDirectional())
        return false;
    constexpr double kTurn = 0x1p-20; // of rounded directions
    const glm::dvec3 towards = -glm::normalize(glm::dvec3(light.directionWorld));
    return glm::length(glm::normalize(map.window.w) - towards) < kTurn;
}

OwnTaps makeOwnTaps(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                    const glm::vec3& normalWorld, const ShadowMapBias& bias) {
    OwnTaps own;
    const uint32_t n = map.faceTexels;
    const glm::dvec3 position(positionWorld);
    if (map.window.isDirectional())
        return makeWindowTaps(map, position, glm::dvec3(normalWorld), bias);
    const glm::dvec3 d = position - glm::dvec3(map.lightPositionWorld), normal(normalWorld);
    const double dd = glm::dot(d, d);
    if (!(dd > 0.0))
        return own;
    const uint32_t faceIndex = faceTowards(d);
    const Face face(faceIndex);
    const double z = std::fabs(d[face.axis]);
    for (const int other : {face.u, face.v})
        own.isAtBorder |= z - std::fabs(d[other]) < kBorderTexels * z / n;

    // The planes: limits of 1/z along (u, v, 1), as the head of lookupVisibility derives them.
    const double rounding = 0x1p-22 * largestMagnitude(position) + 0x1p-20 * largestMagnitude(d);
    const double forgiven = 1.0 - std::min(2.0 * double(bias.constantTexels) / n, 0.5);
    const double height = -glm::dot(normal, d);
    const double exact = std::max(height - rounding, 0.5 * height);
    const double lifted = map.lodTexels > 0.0f
                              ? std::max(exact - 2.0 * double(map.lodTexels) * z / n, 0.5 * exact)
                              : exact;
    const double apart = dd * (1.0 - std::min(rounding / z + 0x1p-20, 0.5));
    const double low = bias.taps > 1 && height > 0.0
                           ? std::max(1.0 - 2.0 * kLowTexels / n, 0.0) * (lifted / exact)
                           : 0.0;

    const uint32_t taps = tapCountOf(bias);
    const Span columns = spanOf((d[face.u] / z + 1.0) * 0.5 * n, taps, n, own.isAtBorder);
    const Span rows = spanOf((d[face.v] / z + 1.0) * 0.5 * n, taps, n, own.isAtBorder);
    for (int j = 0; j < rows.count; ++j)
        for (int i = 0; i < columns.count; ++i) {
            const int x = columns.first + i, y = rows.first + j;
            // Beyond the face the texel of the neighbour face that holds this direction is taken.
            const glm::dvec3 towards = face.direction(centreOf(x, n), centreOf(y, n));
            OwnTap tap;
            tap.face =
                x >= 0 && y >= 0 && x < int(n) && y < int(n) ? faceIndex : faceTowards(towards);
            const Face of(tap.face);
            const double depth = std::fabs(towards[of.axis]);
            tap.x = uint32_t(texelAt(towards[of.u] / depth, n));
            tap.y = uint32_t(texelAt(towards[of.v] / depth, n));
            for (const int axis : {of.u, of.v})
                own.isAtBorder |= isNearBorder((towards[axis] / depth + 1.0) * 0.5 * n);
            tap.centre = of.direction(centreOf(int(tap.x), n), centreOf(int(tap.y), n));
            tap.weight = columns.weights[i] * rows.weights[j];
            const double atPlane = height > 0.0 ? -glm::dot(normal, tap.centre) / lifted : 0.0;
            const double across = glm::dot(d, tap.centre) / apart;
            tap.limit = std::max(atPlane, across) / forgiven;
            // Low over the plane its products cancel: their rounding is of all of d and the centre.
            tap.slack = kDepthSlack * std::fabs(tap.limit);
            const double planeSlack =
                height > 0.0 ? kProductSlack * (std::sqrt(dd) / lifted * std::fabs(atPlane) +
                                                glm::length(tap.centre) / lifted)
                             : 0.0;
            if (atPlane > across)
                tap.slack += planeSlack / forgiven;
            tap.isLow = atPlane * low > across;
            own.isAtBorder |= low > 0.0 && std::fabs(atPlane * low - across) <
                                               kDepthSlack * across + low * planeSlack;
            own.taps.push_back(tap);
        }
    return own;
}

OwnTapRay ownTapRay(const ShadowMapInfo& map, const OwnTap& tap) {
    if (map.window.isDirectional()) {
        const auto at = [&](double w) {
            return glm::vec3(worldPlace(map.window, {tap.centre.x, tap.centre.y, w}));
        };
        return {at(kWindowStart), at(tap.limit)};
    }
    // On the few texels of a tiny face the planes may lie behind the light: then everything counts.
    const double leastLimit = 0.25 / std::max(double(map.rangeWorld), 1e-30);
    const glm::dvec3 light(map.lightPositionWorld);
    return {map.lightPositionWorld,
            glm::vec3(light + tap.centre / std::max(tap.limit, leastLimit))};
}

namespace {

/// Returns the depth that a map stores in a tap's texel; nothing where its page has no memory.
std::optional<double> storedDepth(const ShadowMapView& maps, const ShadowMapInfo& map,
                                  const OwnTap& tap) {
    const uint32_t side = 1u << maps.pageTexelsLog2;
    const uint32_t entry = map.pageTableStart +
                           (tap.face * map.facePages + tap.y / side) * map.facePages + tap.x / side;
    const uint32_t page = maps.pageTable[entry];
    if (page == kNoPage)
        return std::nullopt;
    const uint32_t bits =
        maps.depths[size_t(page) * side * side + (tap.y % side) * side + tap.x % side];
    return double(std::bit_cast<float>(bits));
}

} // namespace

ShadowMapTrace ownTrace(const ShadowMapView& maps, uint32_t mapIndex, const OwnTaps& taps) {
    const ShadowMapInfo& map = maps.maps[mapIndex];
    ShadowMapTrace trace;
    double nearest = 0.0;
    for (const bool takesLow : {false, true}) {
        trace.missingTapCount = 0;
        double counted = 0.0;
        for (const OwnTap& tap : taps.taps) {
            const std::optional<double> w = storedDepth(maps, map, tap);
            const bool isCounted = takesLow || !tap.isLow || !w;
            trace.missingTapCount += !w;
            counted += isCounted ? tap.weight : 0.0;
            if (!w || !isCounted || *w <= tap.limit - tap.slack || *w <= nearest)
                continue;
            nearest = *w;
            if (map.window.isDirectional()) {
                trace.blockerWorld =
                    glm::vec3(worldPlace(map.window, {tap.centre.x, tap.centre.y, nearest}));
                trace.texelWorld = float(2.0 / (map.faceTexels * glm::length(map.window.u)));
            } else {
                trace.blockerWorld =
                    glm::vec3(glm::dvec3(map.lightPositionWorld) + tap.centre / nearest);
                trace.texelWorld = float(2.0 / (map.faceTexels * nearest));
            }
        }
        if (counted > kLeastCounted)
            break;
    }
    return trace;
}

glm::dvec2 ownVisibility(const ShadowMapView& maps, uint32_t mapIndex, const OwnTaps& taps) {
    glm::dvec2 range;
    const auto depthOf = [&](const OwnTap& tap) {
        return storedDepth(maps, maps.maps[mapIndex], tap);
    };
    for (int i = 0; i < 2; ++i)
        range[i] = taps.visibility(
            [&](const OwnTap& tap) {
                return *depthOf(tap) > tap.limit + (i == 0 ? -tap.slack : tap.slack);
            },
            [&](const OwnTap& tap) { return !depthOf(tap); });
    return range;
}

} // namespace shadowdag
