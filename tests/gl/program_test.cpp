// SPDX-License-Identifier: Apache-2.0
#include "gl/program.h"

#include "gl/buffer.h"
#include "tests/gl/gl_device.h"

#include <gmock/gmock.h>

#include <cmath>

namespace shadowdag {
namespace {

class GlProgramTest : public test::NeedsGl {};

constexpr char kItems[] =
    "layout(local_size_x = 64) in;\n#include \"gl/groups.glsl\"\n"
    "layout(std430, binding = 0) buffer Words { uint words[]; };\n"
    "uniform uint count;\n"
    "void main() { if (itemIndex() < count) words[itemIndex()] += itemIndex() + FIRST; }\n";

TEST_F(GlProgramTest, RunsEveryItemOnceBeyondOneAxis) {
    const GlContext context;
    const GlContext::Current current(context);
    const GlProgram program("items", {{GlStage::kCompute, "items.comp"}},
                            glGlsl() + GlslTexts{{"items.comp", kItems}}, {{"FIRST", "10u"}});
    constexpr uint32_t kCount = 64 * 65535 + 130; // of groups along x
    GlBuffer words("test items");
    words.resize(uint64_t(kCount) * sizeof(uint32_t));
    words.fill(0);
    words.bindStorage(0);
    program.set("count", kCount);
    program.dispatch((kCount + 63) / 64);
    const std::vector<uint32_t> found = words.download<uint32_t>();
    for (uint32_t i = 0; i < kCount; ++i)
        ASSERT_EQ(found[i], i + 10u);
}

// Pieces of a list that each go beyond one axis: a filled-up last row would be the next one's.
TEST_F(GlProgramTest, AdjacentDispatchesRunEveryItemOnce) {
    const GlContext context;
    const GlContext::Current current(context);
    constexpr char kText[] = "layout(local_size_x = 1) in;\n#include \"gl/groups.glsl\"\n"
                             "layout(std430, binding = 0) buffer Words { uint words[]; };\n"
                             "uniform uint count;\n"
                             "void main() { if (itemIndex() < count)\n"
                             "  atomicAdd(words[itemIndex()], 1u); }\n";
    const GlProgram program("pieces", {{GlStage::kCompute, "pieces.comp"}},
                            glGlsl() + GlslTexts{{"pieces.comp", kText}});
    constexpr uint32_t kPiece = 70000, kCount = 2 * kPiece;
    GlBuffer words("test items");
    words.resize(uint64_t(kCount) * sizeof(uint32_t));
    words.fill(0);
    words.bindStorage(0);
    program.set("count", kCount);
    program.dispatch(kPiece);
    program.dispatch(kPiece, kPiece);
    const std::vector<uint32_t> found = words.download<uint32_t>();
    for (uint32_t i = 0; i < kCount; ++i)
        ASSERT_EQ(found[i], 1u) << i;
}

TEST_F(GlProgramTest, ARefusalContainsTheFileAndTheCompilersMessage) {
    const GlContext context;
    const GlContext::Current current(context);
    const GlslTexts texts{{"main.comp", "#include \"part.glsl\"\nlayout(local_size_x = 1) in;\n"
                                        "void main() {}\n"},
                          {"part.glsl", "\nfloat broken = ;\n"}};
    try {
        GlProgram("broken", {{GlStage::kCompute, "main.comp"}}, texts);
        FAIL() << "compiled";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDevice);
        EXPECT_THAT(error.what(), testing::HasSubstr("part.glsl:2"));
        EXPECT_THAT(error.what(), testing::HasSubstr("'broken'"));
    }
}

// What gl/numerics.glsl promises, whichever way this device takes: the processor's bits.
TEST_F(GlProgramTest, NumericsAreThoseOfTheCpu) {
    const GlContext context;
    const GlContext::Current current(context);
    constexpr char kText[] =
        "layout(local_size_x = 64) in;\n#include \"gl/groups.glsl\"\n#include "
        "\"gl/numerics.glsl\"\n"
        "layout(std430, binding = 0) readonly buffer Given { vec4 given[]; };\n"
        "layout(std430, binding = 1) writeonly buffer Found { vec4 found[]; };\n"
        "void main() { vec4 g = given[itemIndex()];\n"
        "  found[itemIndex()] = vec4(fusedMultiplyAdd(g.x, g.y, g.z), quotient(g.x, g.w),\n"
        "                            dotInOrder(g.xyz, g.yzw), 0.0); }\n";
    GlDefines defines;
    if (context.info().hasFusedMultiplyAdd)
        defines.emplace_back("SDAG_FUSED_MULTIPLY_ADD", "1");
    if (context.info().hasExactDivision)
        defines.emplace_back("SDAG_EXACT_DIVISION", "1");
    const GlProgram program("numerics", {{GlStage::kCompute, "n.comp"}},
                            glGlsl() + GlslTexts{{"n.comp", kText}}, defines);
    constexpr uint32_t kCount = 1 << 16;
    std::vector<glm::vec4> given(kCount);
    uint32_t state = 7;
    const auto next = [&] {
        return float(int32_t(state = state * 1664525u + 1013904223u)) * 1e-7f;
    };
    for (glm::vec4& g : given) {
        g = {next(), next(), 0.0f, next() + 300.0f};
        g.z = -(g.x * g.y); // what the product rounds is what is left
    }
    GlBuffer in("test given"), out("test found");
    in.upload(given);
    out.resize(in.bytes());
    in.bindStorage(0);
    out.bindStorage(1);
    program.dispatch(kCount / 64);
    const std::vector<glm::vec4> found = out.download<glm::vec4>();
    for (uint32_t i = 0; i < kCount; ++i) {
        const glm::vec4& g = given[i];
        ASSERT_EQ(found[i].x, std::fmaf(g.x, g.y, g.z)) << i;
        ASSERT_EQ(found[i].y, g.x / g.w) << i;
        ASSERT_EQ(found[i].z, g.x * g.y + g.y * g.z + g.z * g.w) << i;
    }
    RecordProperty("fused", context.info().hasFusedMultiplyAdd);
    RecordProperty("division", context.info().hasExactDivision);
}

} // namespace
} // namespace shadowdag
