// SPDX-License-Identifier: Apache-2.0
// Names of unexplained errors, each by a test of the pair's geometry that it can fail.
#include "hybrid/judge/clip_to_cube.h"
#include "hybrid/judge/explain.h"
#include "hybrid/judge/pair_question.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shadowdag {

namespace {

/// Where the part of a triangle in a cell lies, as seen along a ray.
struct Reach {
    bool isBehind = true;  ///< behind the ray's start or beyond its end
    bool isEdgeOn = false; ///< seen edge-on to within c
    double aside = 1e300;  ///< the least distance of a corner from the ray's line
};

} // namespace

const char* failureNameText(FailureName name) {
    switch (name) {
    case FailureName::kNone:
        return "";
    case FailureName::kSurfaceBehind:
        return "surface-behind";
    case FailureName::kSurfaceEdgeOn:
        return "surface-edge-on";
    case FailureName::kSurfaceOutOfReach:
        return "surface-out-of-reach";
    case FailureName::kLightInPlane:
        return "light-in-plane";
    case FailureName::kCoarserThanAsked:
        return "coarser-than-asked";
    }
    return "";
}

bool isTestedFailure(std::string_view name) {
    for (int i = 1; i <= int(FailureName::kCoarserThanAsked); ++i)
        if (name == failureNameText(FailureName(i)))
            return true;
    return false;
}

FailureName PairJudge::nameOf(uint32_t sample, uint64_t pair, bool isDark) const {
    const Question q = ask(sample, pair, isDark);
    const double clearance = truth_.clearance(q.position, q.receiver);
    if (q.receiver != kBackground) {
        const glm::dvec3 a(inputs_.triangles.vertex(q.receiver, 0)),
            b(inputs_.triangles.vertex(q.receiver, 1)), c(inputs_.triangles.vertex(q.receiver, 2));
        const glm::dvec3 cross = glm::cross(b - a, c - a);
        if (std::fabs(glm::dot(cross, glm::dvec3(q.light) - a)) <= clearance * glm::length(cross))
            return FailureName::kLightInPlane;
    }
    if (q.route == Route::kMap) {
        Question own = q;
        own.rhoWorld = q.ownRhoWorld;
        return q.isCoarserThanAsked && anyShiftAgrees(own, isDark) ? FailureName::kCoarserThanAsked
                                                                   : FailureName::kNone;
    }
    if (q.isExact || !isDark)
        return FailureName::kNone;
    const TruthRay ray = truth_.pairRay(q.position, q.normal, q.receiver, q.light);
    const glm::dvec3 start = glm::dvec3(ray.startLocal) + truth_.originWorld(),
                     whole(ray.direction), way = glm::normalize(whole);
    const VoxelGrid& grid = inputs_.method.rays.dag.grid;
    const glm::dvec3 low(q.hit.cell), high = low + double(1u << q.hit.level);
    std::vector<Reach> parts;
    forTrianglesInCell(q, [&](uint32_t triangle) {
        if (triangle == q.receiver)
            return;
        std::vector<glm::dvec3> part;
        for (int corner = 0; corner < 3; ++corner)
            part.push_back(
                grid.voxelFromWorld(glm::dvec3(inputs_.triangles.vertex(triangle, corner))));
        const glm::dvec3 cross = glm::cross(part[1] - part[0], part[2] - part[0]);
        part = clipToCube(std::move(part), low, high);
        if (part.empty()) // it touches the cell by the margin of the voxels alone
            return;
        Reach reach;
        double extent = 0.0;
        for (const glm::dvec3& corner : part) {
            const glm::dvec3 to = grid.worldFromVoxel(corner) - start;
            const double along = glm::dot(to, way);
            reach.isBehind =
                reach.isBehind && (along <= clearance || along >= glm::length(whole) - clearance);
            reach.aside = std::min(reach.aside, glm::length(to - way * along));
            extent = std::max(extent, glm::length(corner - part[0]) * grid.voxelSizeWorld);
        }
        reach.isEdgeOn = std::fabs(glm::dot(cross, way)) * extent <= clearance * glm::length(cross);
        parts.push_back(reach);
    });
    if (parts.empty())
        return FailureName::kNone; // a voxel with nothing in it: a fault
    const auto all = [&](const auto& test) {
        return std::all_of(parts.begin(), parts.end(), test);
    };
    if (all([](const Reach& r) { return r.isBehind; }))
        return FailureName::kSurfaceBehind;
    if (all([](const Reach& r) { return r.isEdgeOn; }))
        return FailureName::kSurfaceEdgeOn;
    const double rho = q.rhoWorld;
    return all([&](const Reach& r) { return r.isBehind || r.isEdgeOn || r.aside > rho; })
               ? FailureName::kSurfaceOutOfReach
               : FailureName::kNone;
}

} // namespace shadowdag
