// SPDX-License-Identifier: Apache-2.0
// The depths of tiles: bounds that hold, and are found again when pixels have changed.
#include "hybrid/gbuffer/tile_depths.h"

#include "tests/hybrid/seen_soup.h"

#include <gtest/gtest.h>

#include <bit>
#include <vector>

namespace shadowdag::test {
namespace {

constexpr uint32_t kWidth = 19, kHeight = 10; // tiles at the edges are smaller

uint32_t bitsOfDepth(float depth) {
    return std::bit_cast<uint32_t>(depth);
}

struct TileDepthsTest : testing::Test {
    std::vector<uint64_t> pixels = std::vector<uint64_t>(kWidth * kHeight, kNothingSeen);
    ViewRays view = makeViewRays(frontCamera(), kWidth, kHeight);
    TileDepths tiles{view, viewOf(std::as_const(pixels))};

    /// Lets all pixels of a rectangle see a depth.
    void see(const PixelRect& rect, float depth) {
        for (int y = rect.minY; y <= rect.maxY; ++y)
            for (int x = rect.minX; x <= rect.maxX; ++x)
                pixels[size_t(y) * kWidth + size_t(x)] = uint64_t(bitsOfDepth(depth)) << 32;
    }
};

TEST_F(TileDepthsTest, NothingIsHiddenAtFirst) {
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 3; ++x)
            EXPECT_FALSE(tiles.isTileHidden(x, y, bitsOfDepth(1e30f)));
}

TEST_F(TileDepthsTest, ATileThatWasWrittenHidesWhatIsBehindAllItsPixels) {
    see({16, 8, 18, 9}, 3.0f); // the corner tile has 3 x 2 pixels
    pixels[9 * kWidth + 18] = uint64_t(bitsOfDepth(5.0f)) << 32;
    tiles.note(2, 1, 64);
    EXPECT_TRUE(tiles.isTileHidden(2, 1, bitsOfDepth(5.1f)));
    EXPECT_FALSE(tiles.isTileHidden(2, 1, bitsOfDepth(5.0f))); // as near as a pixel
    EXPECT_FALSE(tiles.isTileHidden(2, 1, bitsOfDepth(4.0f)));
    EXPECT_FALSE(tiles.isTileHidden(1, 1, bitsOfDepth(1e30f)));
}

TEST_F(TileDepthsTest, PixelsAreReadAgainAfterEnoughChanges) {
    see({0, 0, 7, 7}, 9.0f);
    tiles.note(0, 0, 64);
    EXPECT_TRUE(tiles.isTileHidden(0, 0, bitsOfDepth(10.0f)));
    see({0, 0, 7, 7}, 2.0f);
    EXPECT_FALSE(tiles.isTileHidden(0, 0, bitsOfDepth(4.0f))); // not known yet
    tiles.note(0, 0, 64);
    EXPECT_TRUE(tiles.isTileHidden(0, 0, bitsOfDepth(4.0f)));
}

TEST_F(TileDepthsTest, ALowerBoundReplacesAHigherOne) {
    tiles.lowerTo(1, 0, bitsOfDepth(6.0f));
    tiles.lowerTo(1, 0, bitsOfDepth(7.0f));
    EXPECT_TRUE(tiles.isTileHidden(1, 0, bitsOfDepth(6.5f)));
    EXPECT_FALSE(tiles.isTileHidden(1, 0, bitsOfDepth(6.0f)));
}

TEST_F(TileDepthsTest, ARectangleIsHiddenIfAllItsTilesAre) {
    for (int x = 0; x < 3; ++x)
        tiles.lowerTo(x, 1, bitsOfDepth(2.0f));
    EXPECT_TRUE(tiles.isRectHidden({3, 8, 18, 9}, bitsOfDepth(3.0f)));
    EXPECT_FALSE(tiles.isRectHidden({3, 7, 18, 9}, bitsOfDepth(3.0f)));
}

} // namespace
} // namespace shadowdag::test
