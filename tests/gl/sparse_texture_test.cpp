// SPDX-License-Identifier: Apache-2.0
#include "gl/sparse_texture.h"

#include "gl/draw.h"
#include "tests/gl/gl_device.h"

#include <random>

namespace shadowdag {
namespace {

class GlSparseArrayTest : public test::NeedsGl {
protected:
    void SetUp() override {
        test::NeedsGl::SetUp();
        if (IsSkipped())
            return;
        context = std::make_unique<GlContext>();
        if (context->info().sparsePageTexels == 0)
            GTEST_SKIP() << context->info().renderer << " has no ARB_sparse_texture";
        current = std::make_unique<GlContext::Current>(*context);
    }
    std::unique_ptr<GlContext> context;
    std::unique_ptr<GlContext::Current> current;
};

constexpr char kHead[] =
    "layout(local_size_x = 64) in;\n#include \"gl/groups.glsl\"\nuniform uint side, pageSide;\n"
    "layout(std430, binding = 0) readonly buffer On { uint on[]; };\n"
    "layout(std430, binding = 1) buffer Wrong { uint wrong[]; };\n"
    "layout(r32ui, binding = 0) writeonly uniform uimage2DArray written;\n"
    "uniform usampler2DArray read;\n"
    "void main() {\n"
    "    uint i = itemIndex();\n"
    "    ivec3 at = ivec3(i % side, i / side % side, i / (side * side));\n"
    "    uint pages = side / pageSide;\n"
    "    uint page = (uint(at.z) * pages + uint(at.y) / pageSide) * pages + uint(at.x) / "
    "pageSide;\n"
    "    if (page >= on.length() || on[page] == 0u) return;\n";

// What has memory keeps its texels while others are given memory and lose it. Not the first layer:
// Mesa 25.0's zink loses its first page, and sparse_gl.cpp leaves it alone.
TEST_F(GlSparseArrayTest, PagesKeepTheirTexelsWhileOthersComeAndGo) {
    const uint32_t pageSide = context->info().sparsePageTexels, pages = 4, layers = 8;
    const uint32_t side = pages * pageSide, count = pages * pages * layers;
    GlSparseArray array(side, layers, pageSide, GlSparseArray::kBits);
    const std::string writeText =
        std::string(kHead) + "    imageStore(written, at, uvec4(i + 1u));\n}\n";
    const std::string readText =
        std::string(kHead) +
        "    if (texelFetch(read, at, 0).r != i + 1u) atomicAdd(wrong[page], 1u);\n}\n";
    const GlProgram write("write", {{GlStage::kCompute, "w"}},
                          glGlsl() + GlslTexts{{"w", writeText.c_str()}});
    const GlProgram read("read", {{GlStage::kCompute, "r"}},
                         glGlsl() + GlslTexts{{"r", readText.c_str()}});
    std::mt19937 rng(3);
    std::vector<uint32_t> has(count, 0);
    for (int round = 0; round < 12; ++round) {
        std::vector<uint32_t> fresh(count, 0);
        for (uint32_t page = pages * pages; page < count; ++page) {
            const uint32_t wants = rng() % 2;
            if (wants == has[page])
                continue;
            array.commit(page / (pages * pages), page % pages, page / pages % pages, 1, wants != 0);
            fresh[page] = has[page] = wants;
        }
        GlBuffer on("test on"), wrong("test wrong");
        on.upload(fresh);
        wrong.upload(std::vector<uint32_t>(count, 0));
        on.bindStorage(0);
        wrong.bindStorage(1);
        array.bindImage();
        array.bindTexture(0);
        const uint64_t groups = uint64_t(side) * side * layers / 64;
        for (const GlProgram* program : {&write, &read}) {
            program->set("side", side);
            program->set("pageSide", pageSide);
            program->setSampler("read", 0);
            if (program == &read) {
                on.upload(has);
                on.bindStorage(0);
            }
            program->dispatch(groups);
            context->finish("sparse pages");
        }
        context->finish("sparse pages");
        const std::vector<uint32_t> found = wrong.download<uint32_t>();
        for (uint32_t page = pages * pages; page < count; ++page)
            ASSERT_EQ(found[page], 0u) << "page " << page << ", round " << round;
    }
}

TEST_F(GlSparseArrayTest, DrawingIntoLayersIsTested) {
    EXPECT_EQ(context->info().drawsSparseLayers,
              GlSparseArray::canBeDrawnInto(context->info().layerExtension));
    RecordProperty("drawsSparseLayers", context->info().drawsSparseLayers);
}

} // namespace
} // namespace shadowdag
