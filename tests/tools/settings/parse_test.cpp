// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/parse.h"

#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag {

namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Returns the message of the usage error that `call` throws; fails the test when it throws none.
template <class F> std::string usageMessage(const F& call) {
    try {
        call();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        return error.what();
    }
    ADD_FAILURE() << "no error";
    return "";
}

} // namespace

TEST(Parse, ListsTakeBlanksAroundTheirParts) {
    const std::vector<std::string> parts = {"acne", "full pool", "expr:max(1, 2)"};
    EXPECT_EQ(parseList("--only", "acne,full pool,expr:max(1, 2)"), parts);
    EXPECT_EQ(parseList("--only", "  acne ,\tfull pool,  expr:max(1, 2) "), parts);
    EXPECT_THROW(parseList("--only", "acne, ,leak"), Error);
    EXPECT_THROW(parseList("--only", "acne, acne"), Error);
    EXPECT_THROW(parseList("--only", ""), Error);
}

TEST(Parse, SizeTakesSidesWithinLimitsOnly) {
    EXPECT_EQ(parseSize("--size", "640x360"), std::make_pair(640u, 360u));
    EXPECT_EQ(parseSize("--size", "1x1"), std::make_pair(1u, 1u));
    for (const char* text :
         {"0x0", "0x1", "1x0", "1000000x1000000", "16384x16384", "640", "640x", "x360", "640x360x2",
          "-1x5", "6.4x3", "640 x 360", "99999999999999999999x1", ""}) {
        const std::string message = usageMessage([&] { parseSize("--size", text); });
        EXPECT_THAT(message, HasSubstr(std::string("--size '") + text + "'"));
        EXPECT_THAT(message, HasSubstr("as in 640x360"));
    }
}

TEST(Parse, PowerOfTwoIsRefusedWithTheNearest) {
    EXPECT_EQ(parsePowerOfTwo("--resolution", "1024", 4, 131072), 10u);
    EXPECT_EQ(parsePowerOfTwo("--resolution", "131072", 4, 131072), 17u);
    EXPECT_THAT(usageMessage([] { parsePowerOfTwo("--resolution", "1000", 4, 131072); }),
                HasSubstr("the nearest are 512 and 1024"));
    EXPECT_THAT(usageMessage([] { parsePowerOfTwo("--resolution", "262144", 4, 131072); }),
                HasSubstr("from 4 to 131072"));
    usageMessage([] { parsePowerOfTwo("--resolution", "0", 4, 131072); });
    usageMessage([] { parsePowerOfTwo("--resolution", "1e3", 4, 131072); });
}

TEST(Parse, FramesIncludeBothEnds) {
    EXPECT_THAT(parseFrames("--frames", "7"), ElementsAre(7));
    EXPECT_THAT(parseFrames("--frames", "2:5"), ElementsAre(2, 3, 4, 5));
    EXPECT_THAT(parseFrames("--frames", "0:7:3"), ElementsAre(0, 3, 6));
    EXPECT_THAT(parseFrames("--frames", "9,0:2,1"), ElementsAre(0, 1, 2, 9));
    for (const char* text : {"", "5:2", "a", "1:2:0", "1:2:3:4", "0:99999999", "-1", "1,", ":"})
        EXPECT_THAT(usageMessage([&] { parseFrames("--frames", text); }), HasSubstr("--frames"));
    EXPECT_EQ(parseFrames("--frames", "0:1000000").size(), 1000001u);
    EXPECT_THAT(usageMessage([] { parseFrames("--frames", "0:1000000,00:999999"); }),
                HasSubstr("lists more than 1000001 frames"));
}

TEST(Parse, ThresholdsAscendAndReachInfinity) {
    const std::vector<float> thresholds = parseThresholds("--thresholds", "inf,96,0,8");
    ASSERT_EQ(thresholds.size(), 4u);
    EXPECT_THAT(std::vector<float>(thresholds.begin(), thresholds.begin() + 3),
                ElementsAre(0, 8, 96));
    EXPECT_TRUE(std::isinf(thresholds[3]));
    for (const char* text : {"-1", "nan", "8,8", "8,,9", "infinity", "1e9"})
        usageMessage([&] { parseThresholds("--thresholds", text); });
}

TEST(Parse, BytesAcceptBinaryMultiples) {
    EXPECT_EQ(parseBytes("--pool", "256M"), 256ull << 20);
    EXPECT_EQ(parseBytes("--pool", "1.5G"), 3ull << 29);
    EXPECT_EQ(parseBytes("--pool", "4096"), 4096u);
    for (const char* text : {"", "M", "1T", "-1M", "nanG", "1e30G"})
        usageMessage([&] { parseBytes("--pool", text); });
}

TEST(Parse, NumbersAreWholeTextsWithinBounds) {
    EXPECT_EQ(parseInteger("--threads", "3", 0, 8), 3);
    EXPECT_THAT(usageMessage([] { parseInteger("--threads", "9", 0, 8); }),
                HasSubstr("from 0 to 8"));
    for (const char* text : {"", "3x", " 3", "3.0", "0x3"})
        usageMessage([&] { parseInteger("--threads", text, 0, 8); });
    EXPECT_EQ(parseNumber("--bias", "0.5", 0, 1), 0.5);
    for (const char* text : {"nan", "inf", "1.5", "-0.1", "1,0"})
        usageMessage([&] { parseNumber("--bias", text, 0, 1); });
}

TEST(Parse, NumberTextReadsAsWritten) {
    EXPECT_EQ(numberText(96), "96");
    EXPECT_EQ(numberText(double(0.1f)), "0.1");
    EXPECT_EQ(numberText(0.25), "0.25");
    EXPECT_EQ(numberText(INFINITY), "inf");
    EXPECT_EQ(bytesText(1536), "1.50 KiB");
    EXPECT_EQ(bytesText(12), "12 B");
}

} // namespace shadowdag
