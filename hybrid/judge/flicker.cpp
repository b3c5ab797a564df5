// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/flicker.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/frame/pair_result.h"
#include "hybrid/gbuffer/view_rays.h"
#include "hybrid/judge/explain.h"
#include "scenes/split_mix.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace shadowdag {
namespace {

// Points that leave the view or vanish behind something are replaced by spare ones.
constexpr uint32_t kDrawnPerPoint = 2;

// The source of a result: a face resolution in texels, or one of these.
constexpr uint32_t kServedByRays = 0, kServedByProof = 0xffffffffu;

uint32_t servedBy(const ErrorInputs& inputs, PairServer server) {
    switch (server.by()) {
    case ServedBy::kProof:
        return kServedByProof;
    case ServedBy::kRays:
        return kServedByRays;
    case ServedBy::kMap:
        break;
    }
    return inputs.method.maps.maps[server.map()].faceTexels;
}

FlickerChange changeBetween(uint32_t before, uint32_t after) {
    const auto isMap = [](uint32_t by) { return by != kServedByRays && by != kServedByProof; };
    if (before == after)
        return FlickerChange::kHeld;
    return isMap(before) && isMap(after) ? FlickerChange::kResolutionSwitch
                                         : FlickerChange::kMethodSwitch;
}

bool isDark(uint8_t visibility) {
    return visibility < kHalfLit;
}

/// Returns the unit normal of a triangle on the side of `towards`, zero where it has none.
glm::vec3 normalTowards(const std::array<glm::vec3, 3>& corners, const glm::dvec3& from,
                        const glm::vec3& towards) {
    const glm::dvec3 a(corners[0]), b(corners[1]), c(corners[2]);
    const glm::dvec3 cross = glm::cross(b - a, c - a);
    const double length = glm::length(cross);
    if (!(length > 0.0))
        return glm::vec3(0.0f);
    const bool isFlipped = glm::dot(cross, glm::dvec3(towards) - from) < 0.0;
    return glm::vec3(cross / (isFlipped ? -length : length));
}

/// Returns the barycentric coordinates of a point of the triangle's plane; those of its middle for
/// a triangle without area.
glm::dvec3 barycentricOf(const std::array<glm::vec3, 3>& corners, const glm::vec3& point) {
    const glm::dvec3 a(corners[0]), ab = glm::dvec3(corners[1]) - a,
                                    ac = glm::dvec3(corners[2]) - a, ap = glm::dvec3(point) - a;
    const double bb = glm::dot(ab, ab), bc = glm::dot(ab, ac), cc = glm::dot(ac, ac),
                 pb = glm::dot(ap, ab), pc = glm::dot(ap, ac), area = bb * cc - bc * bc;
    if (!(area > 0.0))
        return glm::dvec3(1.0 / 3.0);
    const double v = (cc * pb - bc * pc) / area, w = (bb * pc - bc * pb) / area;
    return {1.0 - v - w, v, w};
}

std::array<glm::vec3, 3> cornersOf(const TriangleView& triangles, uint32_t triangle) {
    return {triangles.vertex(triangle, 0), triangles.vertex(triangle, 1),
            triangles.vertex(triangle, 2)};
}

/// Finds the pixel whose centre is nearest to the point's projection; false outside of the view.
bool projectToPixel(const ViewRays& view, const glm::vec3& point, uint32_t& x, uint32_t& y) {
    const glm::dvec3 d = glm::dvec3(point) - view.origin;
    const double depth = glm::dot(d, view.forward);
    if (!(depth > view.znear) || depth > view.zfar)
        return false;
    const double px = (glm::dot(d, view.right) / depth - view.firstX) / view.pixelSize;
    const double py = (view.firstY - glm::dot(d, view.up) / depth) / view.pixelSize;
    if (!(px >= -0.5 && py >= -0.5 && px < view.width - 0.5 && py < view.height - 0.5))
        return false;
    x = uint32_t(std::floor(px + 0.5));
    y = uint32_t(std::floor(py + 0.5));
    return true;
}

/// Returns the samples in the 3 x 3 pixels around one, nearest to the point first.
std::vector<uint32_t> samplesBeside(const GBufferView& gbuffer, uint32_t x, uint32_t y,
                                    const glm::vec3& point) {
    std::vector<std::pair<float, uint32_t>> found;
    for (uint32_t v = y > 0 ? y - 1 : 0; v <= std::min(y + 1, gbuffer.height - 1); ++v)
        for (uint32_t u = x > 0 ? x - 1 : 0; u <= std::min(x + 1, gbuffer.width - 1); ++u) {
            const uint32_t sample = v * gbuffer.width + u;
            if (gbuffer.triangle[sample] == kBackground)
                continue;
            const glm::vec3 d = gbuffer.positionWorld[sample] - point;
            found.emplace_back(glm::dot(d, d), sample);
        }
    std::sort(found.begin(), found.end());
    std::vector<uint32_t> samples;
    for (const auto& [distance, sample] : found)
        samples.push_back(sample);
    return samples;
}

/// Points with their pairs in the form of a frame, for the truth and the error analysis.
struct PointPairs {
    std::vector<glm::vec3> positionWorld, normalWorld;
    std::vector<float> depthView;
    std::vector<uint32_t> triangle;
    PairList pairs{{0}, {}};
    std::vector<uint8_t> visibility;
    std::vector<Route> route;
    std::vector<PairServer> server;

    void addPoint(const glm::vec3& position, const glm::vec3& normal, uint32_t onTriangle) {
        positionWorld.push_back(position);
        normalWorld.push_back(normal);
        depthView.push_back(0.0f);
        triangle.push_back(onTriangle);
    }
    void addPair(uint32_t light, uint8_t answer, PairServer by) {
        pairs.light.push_back(light);
        visibility.push_back(answer);
        route.push_back(by.isMap() ? Route::kMap : Route::kRays);
        server.push_back(by);
    }
    void endPoint() { pairs.sampleStart.push_back(pairs.light.size()); }
    GBufferView gbuffer() const {
        return {viewOf(positionWorld), viewOf(normalWorld),       viewOf(depthView),
                viewOf(triangle),      uint32_t(triangle.size()), 1};
    }
    ErrorInputs inputs(const ErrorInputs& frame) const {
        return {gbuffer(), frame.triangles, frame.lights,      pairs,         visibility, route,
                server,    frame.method,    frame.askedTexels, frame.hasPlane};
    }
};

std::vector<Light> listOf(View<const Light> lights) {
    return {lights.data, lights.data + lights.count};
}

} // namespace

void FlickerCounts::Class::add(const Class& other) {
    answerCount += other.answerCount;
    flickerCount += other.flickerCount;
    explainedCount += other.explainedCount;
    contactCount += other.contactCount;
    acneCount += other.acneCount;
    magnifiedCount += other.magnifiedCount;
}

FlickerCounts::Class FlickerCounts::total() const {
    Class sum;
    for (const Class& one : byChange)
        sum.add(one);
    return sum;
}

void FlickerCounts::add(const FlickerCounts& other) {
    pointCount += other.pointCount;
    truthChangeCount += other.truthChangeCount;
    missingResultCount += other.missingResultCount;
    missingTapCount += other.missingTapCount;
    for (size_t i = 0; i < byChange.size(); ++i)
        byChange[i].add(other.byChange[i]);
}

void FlickerMeter::forget() {
    points_.clear();
    answers_.clear();
}

void FlickerMeter::skip() {
    forget();
    ++frameCount_;
}

FlickerCounts FlickerMeter::add(const FlickerFrame& frame) {
    const ErrorInputs& inputs = frame.inputs;
    const size_t count = inputs.pairs.count();
    if (inputs.visibility.size() != count || inputs.pairServer.size() != count ||
        inputs.pairRoute.size() != count)
        throw Error(ErrorKind::kUsage, "flicker of " + std::to_string(count) +
                                           " pairs needs one visibility per pair, got " +
                                           std::to_string(inputs.visibility.size()) +
                                           "; render with recordPairs");
    const FlickerCounts counts = follow(frame);
    draw(frame);
    return counts;
}

void FlickerMeter::draw(const FlickerFrame& frame) {
    const ErrorInputs& inputs = frame.inputs;
    const GBufferView& gbuffer = inputs.gbuffer;
    forget();
    const uint64_t stream = splitMix64(seed_ + frameCount_++ * kSplitMixGamma);
    const uint64_t wanted = uint64_t(pointCount_) * kDrawnPerPoint;
    std::vector<bool> isDrawn(gbuffer.count());
    std::vector<uint32_t> samples;
    for (uint64_t i = 0; samples.size() < wanted && i < 8 * gbuffer.count(); ++i) {
        const uint64_t bits = splitMix64(stream + i * kSplitMixGamma);
        const size_t sample = size_t((unsigned __int128)(bits)*gbuffer.count() >> 64);
        if (isDrawn[sample] || gbuffer.triangle[sample] == kBackground)
            continue;
        isDrawn[sample] = true;
        samples.push_back(uint32_t(sample));
    }

    PointPairs list;
    std::vector<uint64_t> framePair; // of the frame, by pair of the list
    for (const uint32_t sample : samples) {
        const uint32_t triangle = gbuffer.triangle[sample];
        Point point{gbuffer.positionWorld[sample],
                    gbuffer.normalWorld[sample],
                    triangle,
                    cornersOf(inputs.triangles, triangle),
                    {},
                    uint32_t(list.pairs.count()),
                    0};
        point.barycentric = barycentricOf(point.corners, point.positionWorld);
        list.addPoint(point.positionWorld, point.normalWorld, triangle);
        for (uint64_t p = inputs.pairs.sampleStart[sample];
             p < inputs.pairs.sampleStart[sample + 1]; ++p) {
            list.addPair(inputs.pairs.light[p], inputs.visibility[p], inputs.pairServer[p]);
            framePair.push_back(p);
            ++point.answerCount;
        }
        list.endPoint();
        points_.push_back(point);
    }
    const std::vector<uint8_t> truth =
        truth_.visibility(list.gbuffer(), listOf(inputs.lights), list.pairs);
    const PairJudge judge(inputs, truth_, seed_);
    answers_.resize(list.pairs.count());
    cpuParallelRanges(points_.size(), 64, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            for (uint64_t p = list.pairs.sampleStart[i]; p < list.pairs.sampleStart[i + 1]; ++p) {
                const bool dark = isDark(list.visibility[p]), truthDark = isDark(truth[p]);
                answers_[p] = {list.pairs.light[p], servedBy(inputs, list.server[p]), dark,
                               truthDark,
                               dark == truthDark ? PairVerdict::kRight
                                                 : judge.judge(samples[i], framePair[p], dark)};
            }
    });
}

FlickerCounts FlickerMeter::follow(const FlickerFrame& frame) const {
    FlickerCounts counts;
    if (points_.empty())
        return counts;
    const ErrorInputs& inputs = frame.inputs;
    const GBufferView& gbuffer = inputs.gbuffer;
    const ViewRays view = makeViewRays(frame.camera, gbuffer.width, gbuffer.height);

    // The current positions of the points, and whether they are visible.
    std::vector<Point> now = points_;
    std::vector<uint8_t> isSeen(now.size());
    std::vector<std::pair<uint32_t, uint32_t>> pixel(now.size());
    cpuParallelRanges(now.size(), 256, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            Point& point = now[i];
            const std::array<glm::vec3, 3> corners = cornersOf(inputs.triangles, point.triangle);
            // Static points keep the exact bits of their position.
            if (corners != point.corners) {
                const auto side = [](const Point& p, const std::array<glm::vec3, 3>& c) {
                    return glm::dot(glm::cross(c[1] - c[0], c[2] - c[0]), p.normalWorld) < 0.0f;
                };
                const bool wasFlipped = side(point, point.corners);
                point.positionWorld = glm::vec3(point.barycentric.x * glm::dvec3(corners[0]) +
                                                point.barycentric.y * glm::dvec3(corners[1]) +
                                                point.barycentric.z * glm::dvec3(corners[2]));
                point.normalWorld = normalTowards(corners, glm::dvec3(point.positionWorld),
                                                  frame.camera.positionWorld);
                if (side(point, corners) != wasFlipped)
                    continue; // its other face is seen now
            }
            if (!(glm::dot(point.normalWorld, frame.camera.positionWorld - point.positionWorld) >
                  0.0f) ||
                !projectToPixel(view, point.positionWorld, pixel[i].first, pixel[i].second))
                continue;
            const TruthRay toCamera = truth_.pairRay(point.positionWorld, point.normalWorld,
                                                     point.triangle, frame.camera.positionWorld);
            uint8_t isHidden = 0;
            truth_.traceBlocked(&toCamera, 1, &isHidden);
            isSeen[i] = isHidden == 0;
        }
    });

    // The first visible ones, with the results of this frame.
    PointPairs list;
    std::vector<uint32_t> before; // the result before, by pair of the list
    for (size_t i = 0; i < now.size() && counts.pointCount < pointCount_; ++i) {
        if (!isSeen[i])
            continue;
        ++counts.pointCount;
        const Point& point = now[i];
        list.addPoint(point.positionWorld, point.normalWorld, point.triangle);
        const std::vector<uint32_t> beside =
            samplesBeside(gbuffer, pixel[i].first, pixel[i].second, point.positionWorld);
        for (uint32_t a = point.firstResult; a < point.firstResult + point.answerCount; ++a) {
            const uint32_t lightIndex = answers_[a].light;
            const Light& light = inputs.lights[lightIndex];
            if (!isPair(light, point.positionWorld, point.normalWorld))
                continue;
            uint64_t pair = inputs.pairs.count();
            for (size_t s = 0; s < beside.size() && pair == inputs.pairs.count(); ++s)
                pair = pairOf(inputs.pairs, beside[s], lightIndex);
            if (pair == inputs.pairs.count()) {
                ++counts.missingResultCount;
                continue;
            }
            VisibilityCounts asked;
            const uint8_t visibility = computePairResultOnHost(
                inputs.method, inputs.pairServer[pair], lightIndex, light, point.positionWorld,
                point.normalWorld, point.triangle, asked);
            if (asked.missingTapCount > 0) {
                ++counts.missingTapCount;
                continue;
            }
            list.addPair(lightIndex, visibility, inputs.pairServer[pair]);
            before.push_back(a);
        }
        list.endPoint();
    }

    const std::vector<uint8_t> truth =
        truth_.visibility(list.gbuffer(), listOf(inputs.lights), list.pairs);
    const ErrorInputs pointInputs = list.inputs(inputs);
    const PairJudge judge(pointInputs, truth_, seed_);
    for (size_t i = 0; i + 1 < list.pairs.sampleStart.size(); ++i)
        for (uint64_t p = list.pairs.sampleStart[i]; p < list.pairs.sampleStart[i + 1]; ++p) {
            const Answer& was = answers_[before[p]];
            if (was.isTruthDark != isDark(truth[p])) {
                ++counts.truthChangeCount;
                continue;
            }
            const bool dark = isDark(list.visibility[p]);
            FlickerCounts::Class& of = counts.byChange[size_t(
                changeBetween(was.servedBy, servedBy(inputs, list.server[p])))];
            ++of.answerCount;
            if (dark == was.isDark)
                continue;
            ++of.flickerCount;
            const PairVerdict verdict =
                was.isDark != was.isTruthDark ? was.verdict : judge.judge(uint32_t(i), p, dark);
            of.explainedCount += verdict == PairVerdict::kExplained;
            of.contactCount += verdict == PairVerdict::kContact;
            of.acneCount += verdict == PairVerdict::kAcne;
            of.magnifiedCount += verdict == PairVerdict::kMagnified;
        }
    return counts;
}

} // namespace shadowdag
