// SPDX-License-Identifier: Apache-2.0
#include "hybrid/routing/pair_server.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

TEST(PairServer, HoldsTheMethodAndTheGreatestMap) {
    EXPECT_EQ(PairServer{}.by(), ServedBy::kRays);
    EXPECT_EQ(PairServer::rays().by(), ServedBy::kRays);
    EXPECT_EQ(PairServer::proof().by(), ServedBy::kProof);
    EXPECT_FALSE(PairServer::rays().isMap());
    EXPECT_FALSE(PairServer::proof().isMap());
    for (const uint32_t map : {0u, 1u, 12345u, PairServer::kMostMaps - 1}) {
        EXPECT_TRUE(PairServer::drawnMap(map).isMap());
        EXPECT_EQ(PairServer::drawnMap(map).map(), map);
    }
    EXPECT_FALSE(PairServer::drawnMap(0) == PairServer::rays());
}

} // namespace
} // namespace shadowdag::test
