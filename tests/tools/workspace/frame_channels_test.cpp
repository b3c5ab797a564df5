// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/frame_channels.h"

#include <gtest/gtest.h>

#include <map>

namespace shadowdag {

namespace {

/// Two pixels: one of two pairs, one of none.
struct TwoPixels {
    std::vector<glm::vec3> color{{1, 2, 3}, {4, 5, 6}};
    std::vector<float> depth{7, 8};
    PairList pairs{{0, 2, 2}, {0, 1}};
    std::vector<uint8_t> visibility{0, 255}, truth{255, 255};
    std::vector<Route> routes{Route::kRays, Route::kMap};

    std::map<std::string, std::vector<float>> channels(const std::string& prefix,
                                                       const std::vector<Route>& byRoutes,
                                                       const std::vector<uint8_t>& byTruth) const {
        GBufferView gbuffer;
        gbuffer.depthView = viewOf(depth);
        gbuffer.width = 2;
        gbuffer.height = 1;
        std::map<std::string, std::vector<float>> found;
        for (const ExrChannel& channel :
             frameChannels({prefix, color, ExrChannel::Type::kFloat, gbuffer, pairs, visibility,
                            byRoutes, byTruth}))
            EXPECT_TRUE(found.emplace(channel.name, channel.values).second) << channel.name;
        return found;
    }
};

using Values = std::vector<float>;

TEST(FrameChannels, ContainTheDataOfAFrame) {
    const TwoPixels f;
    auto all = f.channels("", f.routes, f.truth);
    EXPECT_EQ(all.size(), 10u);
    EXPECT_EQ(all["R"], (Values{1, 4}));
    EXPECT_EQ(all["G"], (Values{2, 5}));
    EXPECT_EQ(all["B"], (Values{3, 6}));
    EXPECT_EQ(all["visibility.mean"], (Values{0.5f, 1}));
    EXPECT_EQ(all["method.rayShare"], (Values{0.5f, 0}));
    EXPECT_EQ(all["depth.Z"], (Values{7, 8}));
    EXPECT_EQ(all["error.pairCount"], (Values{2, 0}));
    EXPECT_EQ(all["error.falseShadowCount"], (Values{1, 0}));
    EXPECT_EQ(all["error.falseLightCount"], (Values{0, 0}));
    EXPECT_EQ(all["error.truthVisibility"], (Values{1, 1}));
}

TEST(FrameChannels, OmitMissingDataAndStartWithThePrefix) {
    const TwoPixels f;
    EXPECT_EQ(f.channels("", f.routes, {}).size(), 6u);
    const auto truthItself = f.channels("right.", {}, {});
    EXPECT_EQ(truthItself.size(), 5u);
    for (const auto& [name, values] : truthItself)
        EXPECT_EQ(name.rfind("right.", 0), 0u) << name;
}

} // namespace

} // namespace shadowdag
