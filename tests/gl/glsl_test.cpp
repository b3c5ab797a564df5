// SPDX-License-Identifier: Apache-2.0
#include "gl/glsl.h"

#include "cuda/error.h"
#include "gl/program.h"

#include <gmock/gmock.h>

namespace shadowdag {
namespace {

const GlslTexts kTexts = {{"a/main.comp", "one\n#include \"b/part.glsl\"\nthree\n"},
                          {"b/part.glsl", "#include \"c/deep.glsl\"\nhere\n"},
                          {"c/deep.glsl", "deep\n#include \"b/part.glsl\"\n"}};

TEST(Glsl, IncludesAreReplacedOnceAndLinesKeepTheirPlaces) {
    const GlslUnit unit = expandGlsl(kTexts, "a/main.comp");
    EXPECT_EQ(unit.text, "#line 1 0\none\n#line 1 1\n#line 1 2\ndeep\n#line 3 2\n#line 2 1\nhere\n"
                         "#line 3 0\nthree\n");
    EXPECT_THAT(unit.paths, testing::ElementsAre("a/main.comp", "b/part.glsl", "c/deep.glsl"));
}

TEST(Glsl, LinesForCppBecomeEmpty) {
    const GlslTexts texts = {{"a_leaf.h", "#pragma once\n#ifdef __cplusplus\n#include \"no.h\"\n"
                                          "#else\n#include \"b\"\n#endif\n#if 1\n#endif\nz\n"},
                             {"b", "#ifdef __cplusplus\nx\n#endif\ny\n"}};
    EXPECT_EQ(expandGlsl(texts, "a_leaf.h").text,
              "#line 1 0\n\n\n\n\n#line 1 1\n\n\n\ny\n#line 6 0\n\n#if 1\n#endif\nz\n");
}

TEST(Glsl, ConstantsKeepEveryBit) {
    EXPECT_EQ(glslConstant(7u), "7u");
    EXPECT_EQ(glslConstant(-2), "(-2)");
    EXPECT_EQ(glslConstant(0.1), "(1.0000000000000001e-01LF)");
    const std::string text = glslConstant(1e-28);
    EXPECT_EQ(std::stod(text.substr(1)), 1e-28);
}

TEST(Glsl, AMissingFileIsReportedByName) {
    try {
        expandGlsl({{"a", "#include \"nowhere.glsl\"\n"}}, "a");
        FAIL() << "expanded";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), testing::HasSubstr("nowhere.glsl"));
    }
}

TEST(Glsl, NumbersThatStartALogsLinesBecomePaths) {
    const std::vector<std::string> paths{"a/main.comp", "b/part.glsl"};
    EXPECT_EQ(nameGlslFiles("1:7(3): error: x\n0(12) : error: y\n", paths),
              "b/part.glsl:7(3): error: x\na/main.comp(12) : error: y\n");
    EXPECT_EQ(nameGlslFiles("9:1: z\n17 errors\n: 1:2\n", paths), "9:1: z\n17 errors\n: 1:2\n");
}

TEST(Glsl, TheFoldersTextsAreEmbedded) {
    EXPECT_THAT(expandGlsl(glGlsl(), "gl/groups.glsl").text, testing::HasSubstr("itemIndex"));
    EXPECT_EQ(glGlsl().size(), 3u);
}

} // namespace
} // namespace shadowdag
