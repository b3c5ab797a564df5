// SPDX-License-Identifier: Apache-2.0
#include "gl/draw.h"

#include "tests/gl/gl_device.h"

#include <gmock/gmock.h>

namespace shadowdag {
namespace {

class GlDrawTest : public test::NeedsGl {};

// Item i covers the columns [i, i + 2) of the picture at depth 0.1 (i + 1), in vertices that say
// which command they belong to.
constexpr char kVertex[] =
    "layout(location = 0) in uint item;\nflat out uint seen;\nuniform float columns;\n"
    "void main() {\n"
    "  int v = gl_VertexID % 6;\n"
    "  vec2 at = vec2(v == 1 || v == 2 || v == 4 ? 1.0 : 0.0, v == 2 || v == 4 || v == 5 ? 1.0 : "
    "0.0);\n"
    "  float x = (float(item) + 2.0 * at.x) / columns * 2.0 - 1.0;\n"
    "  gl_Position = vec4(x, at.y * 2.0 - 1.0, 0.1 * float(item + 1u), 1.0);\n"
    "  seen = item * 100u + uint(gl_VertexID) / 6u;\n}\n";
constexpr char kFragment[] = "flat in uint seen;\nlayout(location = 0) out uint color;\n"
                             "void main() { color = seen; }\n";
constexpr char kCounting[] = "flat in uint seen;\n"
                             "layout(std430, binding = 0) buffer Counts { uint counts[]; };\n"
                             "void main() { atomicAdd(counts[seen / 100u], 1u); }\n";

TEST_F(GlDrawTest, CommandsGiveItemsAndGreaterDepthsWin) {
    const GlContext context;
    const GlContext::Current current(context);
    const GlProgram program("columns", {{GlStage::kVertex, "v"}, {GlStage::kFragment, "f"}},
                            {{"v", kVertex}, {"f", kFragment}});
    GlCommands commands("test columns");
    commands.set({{6, 1, 0, 0}, {6, 1, 6, 2}, {6, 1, 18, 1}}); // item 2 is nearest, drawn before 1
    GlIndexTarget target;
    target.bind(5, 2, 77);
    program.set("columns", 5.0f);
    commands.draw(program, 0, 3);
    std::vector<uint32_t> pixels;
    target.read(pixels);
    context.finish("columns");
    EXPECT_THAT(pixels, testing::ElementsAre(0, 103, 201, 201, 77, 0, 103, 201, 201, 77));
    target.bind(5, 2, 77);
    commands.draw(program, 1, 2);
    target.read(pixels);
    EXPECT_THAT(pixels, testing::ElementsAre(77, 77, 201, 201, 77, 77, 77, 201, 201, 77));
}

TEST_F(GlDrawTest, FragmentsWriteBuffersWithoutATarget) {
    const GlContext context;
    const GlContext::Current current(context);
    const GlProgram program("counting", {{GlStage::kVertex, "v"}, {GlStage::kFragment, "f"}},
                            {{"v", kVertex}, {"f", kCounting}});
    GlCommands commands("test counting");
    commands.set({{6, 1, 0, 0}, {6, 1, 0, 1}});
    GlBuffer counts("test counts");
    counts.upload(std::vector<uint32_t>{0, 0});
    counts.bindStorage(0);
    GlNoTarget target;
    target.bind(8, 3);
    program.set("columns", 8.0f);
    commands.draw(program, 0, commands.count());
    EXPECT_THAT(counts.download<uint32_t>(), testing::ElementsAre(6, 6));
    context.finish("counting");
}

} // namespace
} // namespace shadowdag
