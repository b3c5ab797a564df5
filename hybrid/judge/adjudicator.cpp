// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/adjudicator.h"

#include "hybrid/judge/exact_sign.h"
#include "hybrid/judge/family_hull.h"
#include "hybrid/judge/mask_patch.h"

#include <algorithm>
#include <numeric>

namespace shadowdag {

namespace {

/// More are not joined to surfaces, which takes the square of their number: only boxes as large as
/// the scene touch so many, those of receivers too thin to have a plane.
constexpr size_t kMostTouched = 512;

/// A triangle that the hull may touch, turned so that the undisturbed segment goes along its
/// normal.
struct Touched {
    glm::dvec3 v[3];
    MaskPatch patch = MaskPatch::kOpaque;
    uint32_t surface = 0; ///< the first of the triangles that it is connected with
};

/// An edge as its triangle goes along it.
struct DirectedEdge {
    glm::dvec3 from, to;
    uint32_t triangle;
};

bool isSameEdge(const DirectedEdge& a, const DirectedEdge& b) {
    return (a.from == b.from && a.to == b.to) || (a.from == b.to && a.to == b.from);
}

std::vector<DirectedEdge> edgesOf(const std::vector<Touched>& touched) {
    std::vector<DirectedEdge> edges;
    for (uint32_t t = 0; t < touched.size(); ++t)
        for (int i = 0; i < 3; ++i)
            edges.push_back({touched[t].v[i], touched[t].v[(i + 1) % 3], t});
    return edges;
}

uint32_t rootOf(const std::vector<Touched>& touched, uint32_t t) {
    while (touched[t].surface != t)
        t = touched[t].surface;
    return t;
}

/// Joins the opaque triangles that share an edge into surfaces.
void joinSurfaces(std::vector<Touched>& touched, const std::vector<DirectedEdge>& edges) {
    for (uint32_t t = 0; t < touched.size(); ++t)
        touched[t].surface = t;
    for (size_t i = 0; i < edges.size(); ++i)
        for (size_t j = i + 1; j < edges.size(); ++j)
            if (touched[edges[i].triangle].patch == MaskPatch::kOpaque &&
                touched[edges[j].triangle].patch == MaskPatch::kOpaque &&
                isSameEdge(edges[i], edges[j])) {
                const uint32_t a = rootOf(touched, edges[i].triangle),
                               b = rootOf(touched, edges[j].triangle);
                touched[std::max(a, b)].surface = std::min(a, b);
            }
    for (uint32_t t = 0; t < touched.size(); ++t)
        touched[t].surface = rootOf(touched, t);
}

/// Returns whether the hull may reach the border of a surface: an edge along which its triangles do
/// not cancel.
bool reachesBorder(const std::vector<Touched>& touched, const std::vector<DirectedEdge>& edges,
                   uint32_t surface, const FamilyHull& hull) {
    for (size_t i = 0; i < edges.size(); ++i) {
        if (touched[edges[i].triangle].surface != surface)
            continue;
        int sum = 0;
        for (const DirectedEdge& other : edges)
            if (touched[other.triangle].surface == surface && isSameEdge(edges[i], other))
                sum += other.from == edges[i].from ? 1 : -1;
        const glm::dvec3 ends[] = {edges[i].from, edges[i].to};
        if (sum != 0 && !hull.misses(ends))
            return true;
    }
    return false;
}

/// Segments of a family, in a fixed order: the undisturbed one, those between corners, others.
constexpr uint32_t kFirstCorners = 1, kFirstOthers = 65;

std::pair<glm::dvec3, glm::dvec3> segmentOf(const SegmentFamily& family, uint32_t index) {
    if (index < kFirstCorners)
        return {family.start.center, family.end.center};
    if (index < kFirstOthers)
        return {family.start.corner(int(index - kFirstCorners) / 8),
                family.end.corner(int(index - kFirstCorners) % 8)};
    const auto between = [](const PointBox& box, uint32_t seed) {
        glm::dvec3 p;
        for (int a = 0; a < 3; ++a) {
            seed = seed * 1664525u + 1013904223u;
            p[a] = box.low[a] + (box.high[a] - box.low[a]) * (double(seed >> 8) * 0x1p-24);
        }
        return glm::clamp(p, box.low, box.high);
    };
    return {between(family.start, 2 * index), between(family.end, 2 * index + 1)};
}

/// Returns how often a segment crosses a surface along its normals less how often against them, in
/// `number`; false when it passes through an edge, where a triangle alone has no number.
bool countCrossings(const std::vector<Touched>& touched, uint32_t surface, const glm::dvec3& a,
                    const glm::dvec3& b, int& number) {
    number = 0;
    for (const Touched& t : touched) {
        if (t.surface != surface)
            continue;
        const int before = orientation(t.v[0], t.v[1], t.v[2], a),
                  after = orientation(t.v[0], t.v[1], t.v[2], b);
        if (before * after > 0)
            continue;
        bool isLeft = false, isRight = false;
        for (int i = 0; i < 3; ++i) {
            const int side = orientation(a, b, t.v[i], t.v[(i + 1) % 3]);
            if (side == 0)
                return false;
            (side > 0 ? isLeft : isRight) = true;
        }
        if (isLeft && isRight)
            continue;
        if (before * after == 0)
            return false;
        number += after > 0 ? 1 : -1;
    }
    return true;
}

/// Returns whether a surface is proven to cross every segment of the family.
bool crossesAll(const std::vector<Touched>& touched, const std::vector<DirectedEdge>& edges,
                uint32_t surface, const SegmentFamily& family, const FamilyHull& hull) {
    const FamilyHull start(family.start, family.start), end(family.end, family.end);
    for (const Touched& t : touched)
        if (t.surface == surface && (!start.misses(t.v) || !end.misses(t.v)))
            return false;
    if (reachesBorder(touched, edges, surface, hull))
        return false;
    constexpr uint32_t kTries = 8;
    for (uint32_t i = 0; i < kTries; ++i) {
        const auto [a, b] = segmentOf(family, i == 0 ? 0 : kFirstOthers + i);
        if (int number = 0; countCrossings(touched, surface, a, b, number))
            return number != 0;
    }
    return false;
}

/// Returns whether segments were found that are crossed, by an opaque triangle, and free. A light
/// that may not be asked at all is as one segment that is free.
bool findWitnesses(const std::vector<Touched>& touched, const SegmentFamily& family) {
    constexpr uint32_t kTries = kFirstOthers + 32;
    bool isCrossed = false, isFree = !family.isSurelyAsked;
    for (uint32_t i = 0; i < kTries && !(isCrossed && isFree); ++i) {
        const auto [a, b] = segmentOf(family, i);
        bool isBlocked = false, mayBeBlocked = false;
        for (const Touched& t : touched)
            if (crossesTriangle(a, b, t.v))
                (t.patch == MaskPatch::kOpaque ? isBlocked : mayBeBlocked) = true;
        isCrossed |= isBlocked;
        isFree |= !isBlocked && !mayBeBlocked;
    }
    return isCrossed && isFree;
}

} // namespace

Adjudicator::Adjudicator(const TriangleView& triangles)
    : triangles_(triangles), families_(triangles), boxes_(triangles) {}

Ruling Adjudicator::rule(const FloatPair& pair, const Light& light) const {
    return rule(families_.make(pair, light));
}

Ruling Adjudicator::rule(const SegmentFamily& family, bool usesTree) const {
    Ruling ruling;
    if (!family.mayBeAsked) {
        ruling.verdict = Verdict::kLit;
        return ruling;
    }
    std::vector<uint32_t> candidates;
    if (usesTree) {
        boxes_.append(family, candidates);
    } else {
        candidates.resize(triangles_.count());
        std::iota(candidates.begin(), candidates.end(), 0u);
    }
    const FamilyHull hull(family.start, family.end);
    const glm::dvec3 way = family.end.center - family.start.center;
    std::vector<Touched> touched;
    for (const uint32_t candidate : candidates) {
        if (candidate == family.receiver)
            continue;
        Touched t;
        for (int i = 0; i < 3; ++i)
            t.v[i] = glm::dvec3(triangles_.vertex(candidate, i));
        if (isWithoutArea(t.v) || hull.misses(t.v))
            continue;
        t.patch = maskPatch(triangles_, candidate, family);
        if (t.patch == MaskPatch::kOpen)
            continue;
        if (glm::dot(glm::cross(t.v[1] - t.v[0], t.v[2] - t.v[0]), way) < 0.0)
            std::swap(t.v[1], t.v[2]);
        touched.push_back(t);
        if (touched.size() > kMostTouched)
            break;
    }
    ruling.touchedCount = uint32_t(touched.size());
    if (touched.size() > kMostTouched)
        return ruling;
    if (touched.empty()) {
        ruling.verdict = Verdict::kLit;
        return ruling;
    }
    const std::vector<DirectedEdge> edges = edgesOf(touched);
    joinSurfaces(touched, edges);
    for (uint32_t t = 0; t < touched.size() && family.isSurelyAsked; ++t)
        if (touched[t].surface == t && touched[t].patch == MaskPatch::kOpaque &&
            crossesAll(touched, edges, t, family, hull)) {
            ruling.verdict = Verdict::kDark;
            return ruling;
        }
    ruling.isWitnessed = findWitnesses(touched, family);
    return ruling;
}

} // namespace shadowdag
