// SPDX-License-Identifier: Apache-2.0
// Numerical stability: rays of all 26 directions through and past a voxel's corners, edges and
// faces, and texels across the edges of a cube map, compared with exact integers.
#include "tools/studies/stability.h"
#include "tools/workspace/cube_texel.h"

#include "shadowmap/shadow_map_lookup.h"
#include "voxel/dag_builder.h"
#include "voxel/dag_stream.h"
#include "voxel/dag_trace.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

namespace shadowdag {

namespace {

/// Returns the DAG of a single voxel in a grid of 2^log2 an axis, world space being voxel space.
Dag singleVoxel(uint32_t log2, const Int3& voxel) {
    DagBuilder builder(log2);
    const auto octant = [&](uint32_t level) {
        return uint32_t((voxel[0] >> level & 1) | (voxel[1] >> level & 1) << 1 |
                        (voxel[2] >> level & 1) << 2);
    };
    uint32_t node = builder.addLeaf(uint64_t(1) << (8 * octant(1) + octant(0)));
    for (uint32_t level = kLeafLog2 + 1; level <= log2; ++level) {
        uint32_t children[8];
        std::fill(std::begin(children), std::end(children), kNoNode);
        children[octant(level - 1)] = node;
        node = builder.addInner(level, children);
    }
    VoxelGrid grid;
    grid.resolutionLog2 = log2;
    return builder.finish(log2, node, grid);
}

/// Returns twice the least amount by which the box must grow on all sides for a line to touch it, 0
/// if it does; all in the same integer unit. Per axis the line is within the grown box between two
/// times; with components of -1, 0 and 1 those are integers, and two axes' intervals that are
/// separated by a gap meet when each has grown by half of it.
int64_t twiceTheGrowth(const Int3& lo, const Int3& hi, const Int3& point, const Int3& direction) {
    int64_t twice = 0, latestEntry = 0, earliestExit = 0;
    bool hasInterval = false;
    for (size_t a = 0; a < 3; ++a) {
        if (direction[a] == 0) {
            twice = std::max({twice, 2 * (lo[a] - point[a]), 2 * (point[a] - hi[a])});
            continue;
        }
        const int64_t entry = direction[a] > 0 ? lo[a] - point[a] : point[a] - hi[a];
        const int64_t exit = direction[a] > 0 ? hi[a] - point[a] : point[a] - lo[a];
        latestEntry = hasInterval ? std::max(latestEntry, entry) : entry;
        earliestExit = hasInterval ? std::min(earliestExit, exit) : exit;
        hasInterval = true;
    }
    return std::max(twice, latestEntry - earliestExit);
}

struct Ray {
    DagSegment segment;
    int64_t twiceGrowth; ///< in eighths of the grid's margin
    int feature;         ///< 1 face, 2 edge, 3 corner
};

/// Lines in all 26 directions past every corner, edge and face of the voxel, from a margin inside
/// to three outside in eighths of it: 2^log2 / 2^23 each, which is exact in floats below 2^(log2 +
/// 1).
std::vector<Ray> linesPast(uint32_t log2, const Int3& voxel) {
    const int64_t unit = int64_t(1) << 23 >> log2; // units a voxel
    Int3 lo, hi;
    for (size_t a = 0; a < 3; ++a) {
        lo[a] = voxel[a] * unit;
        hi[a] = lo[a] + unit;
    }
    const int64_t length = int64_t(1) << 21; // a quarter of the grid to both sides
    const auto world = [&](const Int3& p) {
        return glm::vec3(float(double(p[0]) / double(unit)), float(double(p[1]) / double(unit)),
                         float(double(p[2]) / double(unit)));
    };
    const auto digits = [](int i) { return Int3{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1}; };
    std::vector<Ray> rays;
    for (int f = 0; f < 27; ++f)
        for (int d = 0; d < 27; ++d) {
            if (f == 13 || d == 13)
                continue;
            const Int3 feature = digits(f), direction = digits(d);
            for (int64_t step = -8; step <= 24; ++step) {
                Int3 point, from, to;
                for (size_t a = 0; a < 3; ++a) {
                    const int64_t middle = lo[a] + unit / 2;
                    point[a] = feature[a] > 0   ? hi[a] + step
                               : feature[a] < 0 ? lo[a] - step
                                                : middle;
                    from[a] = point[a] - length * direction[a];
                    to[a] = point[a] + length * direction[a];
                }
                rays.push_back(
                    {{world(from), world(to)},
                     std::max<int64_t>(twiceTheGrowth(lo, hi, point, direction), 0),
                     int(std::abs(feature[0]) + std::abs(feature[1]) + std::abs(feature[2]))});
            }
        }
    return rays;
}

void measureRays(const StabilityTable& table, const StabilityGroup& group, Json& results) {
    const char* const features[4] = {"", "face", "edge", "corner"};
    for (const uint32_t size : group.sizes) {
        const uint32_t log2 = uint32_t(std::countr_zero(size));
        const int64_t half = int64_t(1) << (log2 - 1);
        const Int3 voxel{half - 3, half + 1, half + 2};
        const Dag dag = singleVoxel(log2, voxel);
        const WideDag wide = buildWideDag(dag);
        DagView view = dag.view();
        view.wide = wide.view();
        const std::vector<Ray> rays = linesPast(log2, voxel);
        std::vector<DagSegment> segments;
        for (const Ray& ray : rays)
            segments.push_back(ray.segment);
        // One by one through the canonical form, then in every other way, with the same bits.
        std::vector<uint8_t> dark(rays.size()), other(rays.size());
        for (size_t i = 0; i < rays.size(); ++i)
            dark[i] = occluded(dag.view(), segments[i]);
        uint64_t mismatch = 0;
        Json ways = {"wide form"};
        for (size_t i = 0; i < rays.size(); ++i)
            mismatch += occluded(view, segments[i]) != bool(dark[i]);
        for (const StreamIsa isa : {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512}) {
            if (!hasStreamIsa(isa))
                continue;
            ways.push_back(std::string("stream, ") + streamIsaName(isa));
            traceStream(view, viewOf(segments), viewOf(other), isa);
            for (size_t i = 0; i < rays.size(); ++i)
                mismatch += other[i] != dark[i];
        }
        uint64_t lostCount = 0, farCount = 0, extraCount = 0, touchCount = 0;
        for (size_t i = 0; i < rays.size(); ++i) {
            const double margins = double(rays[i].twiceGrowth) / 16.0;
            const float scale = segmentScale(dag.grid, segments[i]);
            const double own = double(slabMargin(scale)) * double(1 << 20) / double(1u << log2);
            touchCount += margins == 0;
            lostCount += margins == 0 && !dark[i];
            farCount += margins > 2.0 * own && dark[i];
            extraCount += margins > 0 && dark[i];
        }
        Json curves = Json::object();
        for (int f = 1; f <= 3; ++f) {
            std::array<uint64_t, 49> all{}, blocked{};
            for (size_t i = 0; i < rays.size(); ++i)
                if (rays[i].feature == f && rays[i].twiceGrowth < 49) {
                    ++all[size_t(rays[i].twiceGrowth)];
                    blocked[size_t(rays[i].twiceGrowth)] += dark[i];
                }
            Json curve = Json::array();
            for (size_t g = 0; g < all.size(); ++g)
                if (all[g] > 0)
                    curve.push_back({{"margins", double(g) / 16.0},
                                     {"ray_count", all[g]},
                                     {"dark_count", blocked[g]}});
            curves[features[f]] = std::move(curve);
        }
        Json row = {{"group", group.name},
                    {"case", "2^" + std::to_string(log2)},
                    {"kind", group.kind},
                    {"method", kMatrixMethodNames[size_t(MatrixMethod::kDagAll)]},
                    {"judged_count", rays.size()},
                    {"touching_count", touchCount},
                    {"lost_count", lostCount},
                    {"too_far_count", farCount},
                    {"grown_count", extraCount},
                    {"ways", ways},
                    {"mismatch_count", mismatch},
                    {"curves", curves}};
        for (const char* measure : {"lost_count", "too_far_count", "mismatch_count"})
            addChecks(table, results["checks"], group.part, row, measure,
                      row[measure].get<double>(), {});
        results["numeric"].push_back(std::move(row));
    }
}

void measureFaces(const StabilityTable& table, const StabilityGroup& group, Json& results) {
    for (const uint32_t size : group.sizes) {
        const int32_t n = int32_t(size);
        uint64_t judged = 0, ties = 0, mismatch = 0;
        const int32_t reach = std::min(n, 2); // as far as a filter's taps reach beyond a face
        for (uint32_t face = 0; face < kFaceCount; ++face)
            for (int32_t y = -reach; y < n + reach; ++y)
                for (int32_t x = -reach; x < n + reach; ++x) {
                    if (x == 0 && y >= 0 && y < n)
                        x = n; // the face's own texels are certain
                    const CubeTexel got = wrapTexel(face, x, y, uint32_t(n));
                    const ExactTexel exact = exactTexel(face, x, y, n);
                    ++judged;
                    ties += exact.x.isTie() || exact.y.isTie();
                    mismatch +=
                        got.face != exact.face || !exact.x.holds(got.x) || !exact.y.holds(got.y);
                }
        Json row = {{"group", group.name},       {"case", std::to_string(n) + " texels"},
                    {"kind", group.kind},        {"method", "maps"},
                    {"judged_count", judged},    {"tie_count", ties},
                    {"mismatch_count", mismatch}};
        addChecks(table, results["checks"], group.part, row, "mismatch_count", double(mismatch),
                  {});
        results["numeric"].push_back(std::move(row));
    }
}

} // namespace

void measureNumeric(const StabilityTable& table, const StabilityGroup& group, Json& results) {
    (group.kind == "rays" ? measureRays : measureFaces)(table, group, results);
}

} // namespace shadowdag
