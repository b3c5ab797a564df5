// SPDX-License-Identifier: Apache-2.0
// Depths drawn by OpenGL compared texel by texel with the CPU's, in the atlas and in sparse
// textures. Bounds were measured on Mesa 22.3 and 25.0 (llvmpipe, zink) and rounded up.
#include "shadowmap/rasterize_gl.h"

#include "shadowmap/sparse_gl.h"
#include "tests/gl/gl_device.h"
#include "tests/shadowmap/small_scene.h"

#include <epoxy/gl.h>

#include <bit>
#include <string>

namespace shadowdag {
namespace {

using test::SmallScene;

struct DepthParity {
    uint64_t texelCount = 0;    ///< covered on either
    uint64_t coverageCount = 0; ///< covered on one of the two
    uint64_t unlikeCount = 0;   ///< covered on both, with other bits
    double largestRelative = 0; ///< between such depths

    double coveragePercent() const { return 100.0 * double(coverageCount) / double(texelCount); }
    double unlikePercent() const { return 100.0 * double(unlikeCount) / double(texelCount); }
};

std::ostream& operator<<(std::ostream& out, const DepthParity& p) {
    return out << p.texelCount << " texels, covered on one " << p.coveragePercent()
               << " %, other bits " << p.unlikePercent() << " %, by at most " << p.largestRelative;
}

/// Where pages are: as GlPages says, or in dense layers, which every device has.
enum class Where { kAtlas, kSparse, kDense };

void PrintTo(Where where, std::ostream* out) {
    *out << (where == Where::kAtlas ? "atlas" : where == Where::kSparse ? "sparse" : "dense");
}

class RasterizeGl : public test::NeedsGl, public testing::WithParamInterface<Where> {
protected:
    void SetUp() override {
        test::NeedsGl::SetUp();
        if (IsSkipped())
            return;
        context = std::make_unique<GlContext>();
        const bool isSparse = GetParam() == Where::kSparse;
        try {
            chooseGlPages(isSparse ? GlPages::kSparse : GlPages::kAtlas, context->info());
        } catch (const Error& error) {
            GTEST_SKIP() << error.what();
        }
        current = std::make_unique<GlContext::Current>(*context);
        geometry = std::make_unique<GlGeometry>();
        makeDrawer();
        options = test::freshMaps();
        options.pageTexels = isSparse                      ? context->info().sparsePageTexels
                             : GetParam() == Where::kDense ? kDensePageTexels
                                                           : 16;
    }

    /// Begins with a drawer that has drawn nothing.
    void makeDrawer() {
        gl.reset();
        drawer.reset();
        drawer = GlMapDrawer::make(GetParam() == Where::kAtlas    ? GlPages::kAtlas
                                   : GetParam() == Where::kSparse ? GlPages::kSparse
                                                                  : GlPages::kDenseLayers,
                                   *context, *geometry);
        gl = std::make_unique<ShadowMaps>(Backend::kCpu, drawer.get());
    }

    void build(ShadowMaps& maps, const SmallScene& scene, const BatchView& batches,
               const std::vector<MapRequest>& requests) {
        geometry->set(scene.view(), batches.triangles);
        const std::vector<Box> boxes{{glm::vec3(-20), glm::vec3(20)}};
        std::vector<MapReceiver> receivers;
        for (uint32_t m = 0; m < requests.size(); ++m)
            receivers.push_back({0, m});
        StageTimes ignored;
        maps.build(requests, boxes, receivers, scene.view(), batches, options, ignored);
    }

    /// Builds on both, from the same requests, and compares what all pages hold.
    DepthParity compare(const SmallScene& scene, const std::vector<MapRequest>& requests) {
        const BatchSet batches = scene.batches();
        for (ShadowMaps* maps : {&cpu, gl.get()})
            build(*maps, scene, batches.view(), requests);
        ShadowMapView a = cpu.view(), b = gl->view();
        const std::vector<uint32_t> depths = drawer->downloadDepths();
        b.depths = viewOf(depths);
        DepthParity parity;
        for (const ShadowMapInfo& map : a.maps)
            for (uint32_t face = 0; face < kFaceCount; ++face)
                for (uint32_t y = 0; y < map.faceTexels; ++y)
                    for (uint32_t x = 0; x < map.faceTexels; ++x)
                        count(depthAt(a, map, {face, x, y}), depthAt(b, map, {face, x, y}), parity);
        return parity;
    }
    static void count(uint32_t a, uint32_t b, DepthParity& parity) {
        EXPECT_EQ(a == kNoPage, b == kNoPage);
        if ((a == 0 && b == 0) || a == kNoPage)
            return;
        ++parity.texelCount;
        if (a == 0 || b == 0) {
            ++parity.coverageCount;
        } else if (a != b) {
            ++parity.unlikeCount;
            const double x = std::bit_cast<float>(a), y = std::bit_cast<float>(b);
            parity.largestRelative = std::max(parity.largestRelative, std::abs(x - y) / x);
        }
    }

    ShadowMapOptions options;
    ShadowMaps cpu{Backend::kCpu};
    std::unique_ptr<GlContext> context;
    std::unique_ptr<GlContext::Current> current;
    std::unique_ptr<GlGeometry> geometry;
    std::unique_ptr<GlMapDrawer> drawer;
    std::unique_ptr<ShadowMaps> gl;
};

// Large faces: the same bits in every texel, whatever the resolution.
TEST_P(RasterizeGl, AClosedBoxIsDrawnToTheSameBits) {
    SmallScene scene;
    scene.addBox(glm::vec3(-3, -2, -4), glm::vec3(3, 2, 4));
    for (const uint32_t texels : {16u, 100u, 256u, 700u}) {
        const DepthParity p = compare(scene, {{{0.3f, 0.1f, -0.7f}, 12.0f, 0, texels}});
        EXPECT_EQ(p.texelCount, 6ull * texels * texels) << p;
        EXPECT_EQ(p.coverageCount, 0u) << p;
        EXPECT_EQ(p.unlikeCount, 0u) << p;
    }
}

TEST_P(RasterizeGl, ManyMapsOfManySizesDifferAtOutlinesOnly) {
    std::mt19937 rng(5);
    SmallScene scene = test::randomScene(rng, 600, 6.0f, 0.8f);
    scene.addSphere({1, 1, 1}, 1.0f, 24);
    scene.addBox(glm::vec3(-7), glm::vec3(7), 3);
    std::vector<MapRequest> requests;
    for (uint32_t m = 0; m < 9; ++m)
        requests.push_back({test::randomDirection(rng) * 4.0f, 14.0f, m, 24u + 61u * m});
    const DepthParity p = compare(scene, requests);
    EXPECT_EQ(p.coverageCount, 0u) << p;      // the box around all leaves no texel empty
    EXPECT_LE(p.unlikePercent(), 0.006) << p; // measured 0.0048, at outlines: another triangle
    // Again, into the same memory.
    const DepthParity again = compare(scene, requests);
    EXPECT_EQ(again.unlikeCount, p.unlikeCount) << again;
}

// Nothing around: what only one of the two covers.
TEST_P(RasterizeGl, SeparateTrianglesCoverTheSameTexelsExceptAtOutlines) {
    std::mt19937 rng(9);
    const SmallScene scene = test::randomScene(rng, 800, 5.0f, 0.5f);
    const DepthParity p = compare(scene, {{{0, 0, 0}, 12.0f, 0, 500}, {{1, 2, 0}, 12.0f, 1, 90}});
    EXPECT_GT(p.texelCount, 100000u);
    EXPECT_LE(p.coveragePercent(), 0.02) << p; // measured 0.017
    EXPECT_LE(p.unlikePercent(), 0.005) << p;  // and 0.0035
}

// More texels than shaders reach of one buffer: the atlas goes on in another, and what lies in
// textures is gathered piece by piece.
TEST_P(RasterizeGl, PoolsLargerThanABufferAreDrawn) {
    const uint64_t limit = context->info().maxStorageBytes / sizeof(uint32_t);
    if (GetParam() == Where::kSparse || limit > 1u << 26)
        GTEST_SKIP() << "a pool of " << limit << " texels fits a buffer";
    SmallScene scene;
    scene.addBox(glm::vec3(-3), glm::vec3(3));
    options.poolBytes = 2 * context->info().maxStorageBytes;
    const uint32_t texels = 2048; // 6 faces of 2^22: two maps are over 2^25
    const DepthParity p =
        compare(scene, {{{0.5f, 0, 0}, 9.0f, 0, texels}, {{0, 1, 0}, 9.0f, 1, texels}});
    EXPECT_GT(p.texelCount, limit);
    EXPECT_EQ(p.coverageCount + p.unlikeCount, 0u) << p;
}

TEST_P(RasterizeGl, MemoryIsCommittedForThePagesThatAreNeeded) {
    SmallScene scene;
    scene.addBox(glm::vec3(-3), glm::vec3(3));
    compare(scene, {{{0, 0, 0}, 9.0f, 0, 300}, {{0, 1, 0}, 9.0f, 1, 600}});
    const uint64_t both = gl->counts().pagesCommittedCount;
    EXPECT_EQ(both, gl->counts().pageCount);
    compare(scene, {{{0, 0, 0}, 9.0f, 0, 300}});
    const ShadowMapCounts& one = gl->counts();
    if (GetParam() == Where::kAtlas) { // the pool's bookkeeping: all pages of the frame before go
        EXPECT_EQ(one.pagesCommittedCount, one.pageCount);
        EXPECT_EQ(one.pagesFreedCount, both);
    } else { // the driver's: what is committed still is not committed again
        EXPECT_EQ(one.pagesCommittedCount, 0u);
        EXPECT_EQ(one.pagesFreedCount, both - one.pageCount);
    }
}

// Slow growth neither uses up the textures that a shader may read nor loses what is kept.
TEST_P(RasterizeGl, AnAdditionalMapInEveryBuildFits) {
    SmallScene scene;
    scene.addBox(glm::vec3(-3, -2, -4), glm::vec3(3, 2, 4));
    const BatchSet batches = scene.batches();
    for (const bool keeps : {true, false}) {
        SCOPED_TRACE(keeps ? "kept" : "drawn anew");
        makeDrawer();
        options.useStaticOptimization = keeps;
        std::vector<MapRequest> requests;
        const uint32_t last = keeps ? 99 : 39;
        for (uint32_t m = 0; m < last; ++m) {
            requests.push_back({{0.3f, 0.01f * float(m), -0.7f}, 12.0f, m, 24});
            build(*gl, scene, batches.view(), requests);
            gl->countSkipped();
            EXPECT_EQ(gl->counts().batchFaceKeptCount > 0, keeps && m > 0);
            if (keeps) { // textures grow, and what moves is not freed
                EXPECT_EQ(gl->counts().pagesFreedCount, 0u) << m;
            }
        }
        requests.push_back({{0.3f, 0.1f, 0.7f}, 12.0f, last, 24});
        const DepthParity p = compare(scene, requests);
        EXPECT_EQ(p.texelCount, (last + 1ull) * 6 * 24 * 24);
        EXPECT_EQ(p.coverageCount + p.unlikeCount, 0u) << p;
    }
}

// A camera's path through sizes of maps: each is requested for a while, then not again.
TEST_P(RasterizeGl, UnusedTexturesAreDropped) {
    SmallScene scene;
    scene.addBox(glm::vec3(-3, -2, -4), glm::vec3(3, 2, 4));
    const BatchSet batches = scene.batches();
    for (uint32_t round = 1; round <= 3; ++round)
        for (const uint32_t texels : {24u, 150u, 260u, 520u}) {
            std::vector<MapRequest> requests;
            for (uint32_t m = 0; m < round; ++m)
                requests.push_back({{0.3f, 0.1f * float(m), -0.7f}, 12.0f, m, texels});
            build(*gl, scene, batches.view(), requests);
        }
    const auto* sparse = dynamic_cast<const GlSparseDrawer*>(drawer.get());
    if (sparse) {
        EXPECT_LE(sparse->textureCount(), 4u); // one a size
    }
    for (uint32_t b = 0; b < GlSparseDrawer::kIdleBuilds; ++b)
        build(*gl, scene, batches.view(), {{{0.3f, 0.1f, -0.7f}, 12.0f, 0, 24}});
    if (sparse) {
        EXPECT_EQ(sparse->textureCount(), 1u);
    }
    EXPECT_EQ(compare(scene, {{{0.3f, 0.1f, -0.7f}, 12.0f, 0, 24}}).unlikeCount, 0u);
}

// A driver that refuses memory: what it gave is not known, so nothing is taken for given.
TEST_P(RasterizeGl, RefusedPagesAreCommittedLater) {
    if (GetParam() == Where::kAtlas)
        GTEST_SKIP() << "an atlas commits nothing";
    SmallScene scene;
    scene.addBox(glm::vec3(-3), glm::vec3(3));
    const std::vector<MapRequest> requests{{{0, 0, 0}, 9.0f, 0, 300}};
    EXPECT_EQ(compare(scene, requests).unlikeCount, 0u);
    const auto& sparse = dynamic_cast<const GlSparseDrawer&>(*drawer);
    ASSERT_EQ(sparse.textureCount(), 1u);
    glEnable(0x1234); // an error that is found where commits are waited for
    try {
        build(*gl, scene, scene.batches().view(), requests);
        FAIL() << "no error";
    } catch (const Error& error) {
        ASSERT_NE(std::string(error.what()).find("committing pages"), std::string::npos)
            << error.what();
    }
    EXPECT_EQ(sparse.textureCount(), 0u);
    const DepthParity p = compare(scene, requests);
    EXPECT_EQ(p.coverageCount + p.unlikeCount, 0u) << p;
    EXPECT_EQ(gl->counts().pagesCommittedCount, gl->counts().pageCount);
}

INSTANTIATE_TEST_SUITE_P(Pages, RasterizeGl,
                         testing::Values(Where::kAtlas, Where::kSparse, Where::kDense),
                         testing::PrintToStringParamName());

} // namespace
} // namespace shadowdag
