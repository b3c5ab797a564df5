// SPDX-License-Identifier: Apache-2.0
// Floors of pages hide only what cannot change a texel, and are read again only where that is paid
// for.
#include "shadowmap/page_floors.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace shadowdag {
namespace {

constexpr int32_t kSide = 16;

/// One page of texels that start at 0, and its floor.
struct Page {
    std::vector<uint32_t> texels = std::vector<uint32_t>(kSide * kSide, 0);
    std::vector<PageFloor> storage{{0, PageFloors::kUnknownRows}};
    PageFloors floors{viewOf(storage)};

    bool isHidden(uint32_t bits, int32_t columns = kSide, int32_t rows = kSide) {
        return floors.refreshed(0, bits, texels.data(), kSide, columns, rows);
    }
    /// Stores the greater bits in so many columns and rows, and notes it.
    void draw(uint32_t bits, int32_t columns, int32_t rows) {
        for (int32_t y = 0; y < rows; ++y)
            for (int32_t x = 0; x < columns; ++x) {
                uint32_t& texel = texels[size_t(y * kSide + x)];
                texel = std::max(texel, bits);
            }
        floors.noteRows(0, rows);
    }
};

TEST(PageFloors, AnUnknownPageIsReadOnceAndHidesWhatIsBehindAll) {
    Page page;
    std::fill(page.texels.begin(), page.texels.end(), 700u);
    page.texels[37] = 500;
    EXPECT_FALSE(page.floors.hides(0, 500)); // nothing was read yet
    EXPECT_TRUE(page.isHidden(500));
    EXPECT_FALSE(page.isHidden(501));
    EXPECT_TRUE(page.floors.hides(0, 500));
}

TEST(PageFloors, TexelsBeyondTheFaceDoNotCount) {
    Page page;
    page.draw(9, 5, 3);
    EXPECT_TRUE(page.isHidden(9, 5, 3));
    Page other;
    other.draw(9, 5, 3);
    EXPECT_FALSE(other.isHidden(9, 6, 3)); // a texel of the face is empty
}

TEST(PageFloors, APageIsReadAgainOnlyAfterAsManyRowsAsItHas) {
    Page page;
    EXPECT_FALSE(page.isHidden(3)); // read: empty, in vain
    page.draw(3, kSide, kSide);
    EXPECT_FALSE(page.isHidden(3)); // four times the rows are due after that
    for (int32_t i = 0; i < 3; ++i)
        page.draw(3, kSide, kSide);
    EXPECT_TRUE(page.isHidden(3));
    page.draw(8, kSide, kSide - 1);
    page.draw(8, kSide, 1);
    EXPECT_FALSE(page.isHidden(8)); // all but the last row, twice its first
    page.floors.raise(0, 5);
    EXPECT_TRUE(page.isHidden(5));
}

// Whatever was drawn and whenever the page was read: what is hidden would change no texel.
TEST(PageFloors, NothingThatWouldChangeATexelIsHidden) {
    const uint32_t seed = 11;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    size_t hidden = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        Page page;
        const int32_t columns = 1 + int32_t(rng() % kSide), rows = 1 + int32_t(rng() % kSide);
        for (int step = 0; step < 60; ++step) {
            const uint32_t bits = rng() % 50;
            if (page.isHidden(bits, columns, rows)) {
                ++hidden;
                for (int32_t y = 0; y < rows; ++y)
                    for (int32_t x = 0; x < columns; ++x)
                        ASSERT_GE(page.texels[size_t(y * kSide + x)], bits);
                continue;
            }
            const bool isWhole = rng() % 3 == 0;
            page.draw(bits, isWhole ? columns : 1 + int32_t(rng() % uint32_t(columns)),
                      isWhole ? rows : 1 + int32_t(rng() % uint32_t(rows)));
            if (isWhole)
                page.floors.raise(0, bits);
        }
    }
    EXPECT_GT(hidden, 10000u);
}

} // namespace
} // namespace shadowdag
