// SPDX-License-Identifier: Apache-2.0
// Ties compared with integers: segments of all 26 directions through and past corners, edges and
// faces of voxels, by every tracer.
#include "tests/voxel/exact_geometry.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/dag_trace.h"
#include "voxel/shaft.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag {
namespace {

glm::ivec3 digits(int i) {
    return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

/// Occupied voxels around one another in every way: by faces, by an edge, by a corner alone, with a
/// hollow that a ray may pass through, and in the grid's own corners.
const std::vector<glm::uvec3> kVoxels = {{9, 9, 9},    {10, 9, 9},   {11, 10, 9},  {12, 11, 10},
                                         {16, 16, 16}, {15, 15, 15}, {16, 15, 17}, {15, 17, 16},
                                         {7, 24, 8},   {8, 23, 8},   {31, 31, 31}, {0, 0, 0}};

Dag clusterDag() {
    DenseGrid grid(5);
    for (const glm::uvec3& v : kVoxels)
        grid.set(v.x, v.y, v.z);
    return dagOf(grid);
}

/// Segments in all 26 directions, and in 48 that climb one voxel in two, through every corner, edge
/// and face of the occupied voxels, ending there, short of it by an eighth or beyond.
std::vector<DagSegment> tyingSegments() {
    std::vector<DagSegment> segments;
    for (const glm::uvec3& voxel : kVoxels)
        for (int f = 0; f < 27; ++f)
            for (int d = 0; d < 27; ++d) {
                if (d == 13)
                    continue;
                const glm::vec3 at = glm::vec3(voxel) + 0.5f + 0.5f * glm::vec3(digits(f));
                glm::vec3 way(digits(d));
                if ((f + d) % 3 == 0)
                    way[f % 3] *= 2.0f;
                switch ((f + 5 * d) % 4) {
                case 0: // ends on it
                    segments.push_back({at - 8.0f * way, at});
                    break;
                case 1: // ends before it
                    segments.push_back({at - 8.0f * way, at - 0.125f * way});
                    break;
                case 2: // starts an eighth behind it
                    segments.push_back({at + 0.125f * way, at + 6.0f * way});
                    break;
                default:
                    segments.push_back({at - 16.0f * way, at + 16.0f * way});
                }
            }
    return segments;
}

/// Whether the closed segment touches an occupied voxel grown by `grow`, without rounding.
bool touchesExactly(const DagSegment& segment, double grow) {
    const exact::Point p = exact::point(segment.from), q = exact::point(segment.to);
    const glm::vec3 low = glm::min(segment.from, segment.to) - 1.5f,
                    high = glm::max(segment.from, segment.to) + 1.5f;
    for (const glm::uvec3& voxel : kVoxels) {
        const glm::vec3 c(voxel);
        if (glm::any(glm::lessThan(c, low)) || glm::any(glm::greaterThan(c, high)))
            continue;
        exact::Point lo, hi;
        for (int a = 0; a < 3; ++a) {
            lo[size_t(a)] = exact::scaled(double(c[a]) - grow, 149);
            hi[size_t(a)] = exact::scaled(double(c[a]) + 1 + grow, 149);
        }
        if (exact::hullTouchesBox({p, q}, lo, hi))
            return true;
    }
    return false;
}

TEST(ExactTies, EveryTracerBlocksExactlyTheTouchingSegments) {
    const TwoForms forms(clusterDag());
    const std::vector<DagSegment> segments = tyingSegments();
    std::vector<uint8_t> expected(segments.size());
    size_t dark = 0, undecided = 0;
    for (size_t i = 0; i < segments.size(); ++i) {
        const double margin = slabMargin(segmentScale(forms.dag.grid, segments[i]));
        expected[i] = touchesExactly(segments[i], 0);
        // No segment lies within the margin: all coordinates are eighths.
        undecided += !expected[i] && touchesExactly(segments[i], 2 * margin);
        dark += expected[i];
    }
    EXPECT_EQ(undecided, 0u);
    EXPECT_GT(dark, 1000u);
    EXPECT_GT(segments.size() - dark, 500u);
    for (size_t i = 0; i < segments.size(); ++i) {
        ASSERT_EQ(occluded(forms.dag.view(), segments[i]), bool(expected[i])) << "segment " << i;
        ASSERT_EQ(occluded(forms.view(), segments[i]), bool(expected[i])) << "wide, segment " << i;
        // The other way round it is the same segment.
        ASSERT_EQ(occluded(forms.view(), {segments[i].to, segments[i].from}), bool(expected[i]))
            << "backwards, segment " << i;
    }
    for (const StreamIsa isa : {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512}) {
        if (!hasStreamIsa(isa))
            continue;
        std::vector<uint8_t> blocked(segments.size(), 7);
        traceStream(forms.view(), viewOf(segments), viewOf(blocked), isa);
        EXPECT_EQ(blocked, expected) << streamIsaName(isa);
    }
}

// A shaft around starts in a plane of voxel faces, to a light on a lattice point, in all 26
// directions: what it proves holds exactly, ties included.
TEST(ExactTies, ShaftsProveNoBlockedSegmentLit) {
    const TwoForms forms(clusterDag());
    size_t lit = 0, made = 0;
    for (const glm::vec3 target : {glm::vec3(10, 10, 10), {16, 16, 16}, {8, 24, 9}, {24, 8, 24}})
        for (int d = 0; d < 27; ++d) {
            if (d == 13)
                continue;
            const glm::vec3 way(digits(d));
            ShadowStarts starts;
            starts.reset(forms.dag.grid, 0.0f);
            const glm::vec3 normal = glm::normalize(way);
            for (int i = 0; i < 9; ++i) {
                glm::vec3 p = target - 5.0f * way;
                p[(d + 1) % 3] += 0.5f * float(i % 3);
                p[(d + 2) % 3] += 0.5f * float(i / 3);
                starts.add(p, normal);
            }
            const glm::vec3 light = target + 5.0f * way;
            const std::vector<uint32_t> all{0, 1, 2, 3, 4, 5, 6, 7, 8};
            std::vector<DagSegment> segments(all.size());
            starts.segments(light, viewOf(all), segments.data());
            glm::dvec3 low(1e300), high(-1e300);
            for (size_t i = 0; i < all.size(); ++i) {
                low = glm::min(low, starts.liftedStart(i));
                high = glm::max(high, starts.liftedStart(i));
            }
            AbovePlane above;
            ShaftBase base;
            base.normal = starts.normal(0);
            base.normalSpread = 1e-9;
            for (int c = 0; c < 8; ++c)
                base.corner[c] = {(c & 1) ? high.x : low.x, (c & 2) ? high.y : low.y,
                                  (c & 4) ? high.z : low.z};
            for (int a = 0; a < 3; ++a) {
                base.side[a] = glm::dvec3(0.0);
                base.side[a][a] = 1;
            }
            above.make(glm::vec3(base.normal));
            base.above = &above;
            Shaft shaft;
            if (!shaft.make(starts, base, viewOf(all), light))
                continue;
            ++made;
            if (!shaft.isEmpty(forms.wide.view()))
                continue;
            ++lit;
            for (const DagSegment& s : segments)
                EXPECT_EQ(touchesExactly(s, 0), 0u) << "direction " << d;
        }
    EXPECT_GT(made, 60u);
    EXPECT_GT(lit, 10u);
}

} // namespace
} // namespace shadowdag
