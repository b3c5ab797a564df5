// SPDX-License-Identifier: Apache-2.0
// Frames built by hand, voxel by voxel and texel by texel, in which the class of every pair is
// known.
#pragma once

#include "hybrid/judge/error.h"
#include "tests/hybrid/triangle_soup.h"

#include <cstring>
#include <vector>

namespace shadowdag::test {

/// Returns the DAG of a list of voxels, by the layout of dag.h, without merging (nothing here needs
/// it).
inline uint32_t addNode(std::vector<uint32_t>& words, const std::vector<glm::uvec3>& voxels,
                        const glm::uvec3& corner, uint32_t level) {
    const auto inside = [](const glm::uvec3& v, const glm::uvec3& c, uint32_t l) {
        return v.x >> l == c.x >> l && v.y >> l == c.y >> l && v.z >> l == c.z >> l;
    };
    if (level == kLeafLog2) {
        uint64_t bits = 0;
        for (const glm::uvec3& v : voxels)
            if (inside(v, corner, level)) {
                const uint32_t o = (v.x >> 1 & 1) | (v.y >> 1 & 1) << 1 | (v.z >> 1 & 1) << 2;
                const uint32_t s = (v.x & 1) | (v.y & 1) << 1 | (v.z & 1) << 2;
                bits |= 1ull << (8 * o + s);
            }
        words.push_back(uint32_t(bits));
        words.push_back(uint32_t(bits >> 32));
        return uint32_t(words.size() - 2);
    }
    uint32_t mask = 0;
    std::vector<uint32_t> children;
    for (uint32_t c = 0; c < 8; ++c) {
        const glm::uvec3 child = corner + (glm::uvec3(c & 1, c >> 1 & 1, c >> 2) << (level - 1));
        bool isThere = false;
        for (const glm::uvec3& v : voxels)
            isThere |= inside(v, child, level - 1);
        if (isThere) {
            mask |= 1u << c;
            children.push_back(addNode(words, voxels, child, level - 1));
        }
    }
    const auto address = uint32_t(words.size());
    words.push_back(mask);
    words.insert(words.end(), children.begin(), children.end());
    return address;
}

inline Dag makeDag(uint32_t resolutionLog2, const std::vector<glm::uvec3>& voxels) {
    Dag dag;
    dag.grid.resolutionLog2 = resolutionLog2;
    if (!voxels.empty())
        dag.rootAddress = addNode(dag.words, voxels, glm::uvec3(0), resolutionLog2);
    return dag;
}

/// Samples and lights of one pair each, and the method's and the truth's answers.
struct HandFrame {
    TriangleSoup soup;
    SampleRow row;
    std::vector<Light> lights;
    PairList pairs;
    std::vector<uint8_t> visibility;
    std::vector<Route> route;
    std::vector<PairServer> pairServer;
    Dag dag;
    std::vector<ShadowMapInfo> maps;
    std::vector<uint32_t> pageTable, depths;
    uint32_t pageTexelsLog2 = 4;
    RayOptions rays;
    RayDetail detail; ///< pixels of unknown size
    ShadowMapBias bias{0.0f, 1};

    HandFrame() { pairs.sampleStart.push_back(0); }
    void add(const glm::vec3& sample, const glm::vec3& light, uint32_t receiver,
             PairServer server = PairServer::rays()) {
        row.add(sample, {0, 1, 0}, receiver);
        pairs.light.push_back(uint32_t(lights.size()));
        pairs.sampleStart.push_back(pairs.light.size());
        lights.push_back(pointLight(light));
        pairServer.push_back(server);
        route.push_back(server.isMap() ? Route::kMap : Route::kRays);
    }
    ErrorInputs inputs() const {
        return {row.view(),
                soup.view(),
                viewOf(lights),
                pairs,
                visibility,
                route,
                pairServer,
                {RayInputs{dag.view(), rays, {}, {}, detail},
                 {viewOf(maps), viewOf(pageTable), viewOf(depths), pageTexelsLog2},
                 bias}};
    }
    /// Asks the method, as the shading pass does.
    void answer() {
        VisibilityCounts counts;
        visibility.clear();
        for (size_t i = 0; i < lights.size(); ++i)
            visibility.push_back(computePairResult(inputs().method, pairServer[i], uint32_t(i),
                                                   lights[i], row.position[i], row.normal[i],
                                                   row.triangle[i], counts));
    }
    ErrorReport judge(std::vector<uint8_t>* truthVisibility = nullptr, uint64_t seed = 1) const {
        const Truth truth(soup.view());
        const std::vector<uint8_t> right = truth.visibility(row.view(), lights, pairs);
        if (truthVisibility)
            *truthVisibility = right;
        ErrorOptions options;
        options.seed = seed;
        options.nullSampleCount = 500;
        return computeError(inputs(), truth, right, options);
    }
};

/// A map of 16 x 16 texels a face around (0, 10, 0), a floor at y = 0: texels of 1.25 m on it.
/// Empty but for what tests put in.
struct MapFrame : HandFrame {
    static constexpr uint32_t kTexels = 16;

    MapFrame() {
        soup.addLevelSquare({0, 0, 0}, 9.9f);
        maps.push_back({{0, 10, 0}, pointLight({}).rangeWorld, kTexels, 1, 0});
        for (uint32_t face = 0; face < 6; ++face)
            pageTable.push_back(face);
        depths.assign(6 * kTexels * kTexels, 0);
        dag = makeDag(6, {});
    }
    /// Returns the texel of the face towards -Y that looks at (x, 0, z); u runs along z and v along
    /// x.
    uint32_t texel(float x, float z) const {
        const auto cell = [](float s) { return uint32_t((s / 10.0f + 1.0f) * 8.0f); };
        return 3 * kTexels * kTexels + cell(x) * kTexels + cell(z);
    }
    void addPair(float x, float z) {
        add({x, 0, z}, {0, 10, 0}, z >= x ? 0 : 1, PairServer::drawnMap(0));
    }
    /// Stores a surface at depth z below the light.
    void store(float x, float z, float depth) {
        const float w = 1.0f / depth;
        memcpy(&depths[texel(x, z)], &w, sizeof w);
    }
};

} // namespace shadowdag::test
