// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/method.h"

#include "tools/settings/experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <stdexcept>

namespace shadowdag {
namespace {

using testing::ElementsAre;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(Method, IsFoundByItsNameAlone) {
    EXPECT_THAT(methodNames(), ElementsAre("truth", "dag", "maps", "hybrid", "embree"));
    EXPECT_THAT(measuredMethodNames(), ElementsAre("dag", "maps", "hybrid", "embree"));
    for (const Method* method : methods())
        EXPECT_EQ(findMethod(method->name()), method);
    EXPECT_EQ(findMethod("dag-"), nullptr);
    EXPECT_THROW(methodOf(""), std::logic_error);
}

TEST(Method, NeedsAreThoseOfAFrame) {
    EXPECT_TRUE(methodOf("dag").needs().rays);
    EXPECT_FALSE(methodOf("maps").needs().rays);
    EXPECT_TRUE(methodOf("hybrid").needs().rays && methodOf("hybrid").needs().maps);
    EXPECT_TRUE(methodOf("hybrid").needs().routing);
    EXPECT_TRUE(methodOf("truth").isTruth());
    EXPECT_FALSE(methodOf("embree").isTruth() || methodOf("embree").needs().rays);
}

TEST(Method, EmbreeTakesOverTheOptionsOfRays) {
    RayOptions rays;
    rays.level = 3;
    rays.offset = 7;
    methodOf("dag").takeOver(rays);
    EXPECT_EQ(rays.level, 3u);
    methodOf("embree").takeOver(rays);
    EXPECT_EQ(rays.level, 0u);
    EXPECT_TRUE(rays.believesNone());
    EXPECT_EQ(rays.triangleRays, TriangleRays::kEmbree);
}

TEST(Method, OneMethodServesEachThresholdOfASweep) {
    for (const auto& [threshold, name] :
         {std::pair<float, const char*>{0.0f, "maps"}, {96.0f, "hybrid"}, {kInfinity, "dag"}}) {
        std::set<std::string> found;
        for (const Method* method : methods())
            if (method->isRunAtThreshold(threshold))
                found.insert(method->name());
        EXPECT_THAT(found, ElementsAre(name)) << threshold;
    }
}

TEST(Method, ComplexitiesThatFitComparesDiffer) {
    std::set<int> seen;
    for (const Method* method : methods()) {
        if (method->complexity() >= 0) {
            EXPECT_TRUE(seen.insert(method->complexity()).second) << method->name();
        }
    }
    EXPECT_EQ(seen.size(), methods().size() - 2) << "all but the truth and Embree";
}

TEST(Method, ModelsAreThoseOfTheMethod) {
    EXPECT_EQ(methodOf("hybrid").modelText(""), "texels:96");
    EXPECT_EQ(methodOf("hybrid").modelText("cost"), "cost");
    EXPECT_EQ(methodOf("dag").modelText("cost"), "texels:inf");
    EXPECT_EQ(methodOf("maps").modelText(""), "texels:0");
}

} // namespace
} // namespace shadowdag
