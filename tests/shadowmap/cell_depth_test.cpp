// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/cell_depth.h"

#include "cuda/buffer.h"
#include "cuda/pass.h"
#include "shadowmap/cull.h"

#include <gtest/gtest.h>

#include <random>

namespace shadowdag {
namespace {

TEST(CellDepth, BitsAreOrderedAsDepthsAndNeverZero) {
    EXPECT_EQ(depthBits(0.0f), 1u);
    float before = 0.0f;
    for (const float depth : {1e-30f, 0.5f, 1.0f, 1.0000001f, 7.0f, 3e38f}) {
        EXPECT_LT(depthBits(before), depthBits(depth));
        EXPECT_EQ(bitsFloat(depthBits(depth)), depth);
        before = depth;
    }
}

TEST(CellDepth, RectangleCoversTheCellsItTouches) {
    const CellRect whole = cellsOf({-1.0f, 1.0f, -1.0f, 1.0f, 0.0f, 1.0f});
    EXPECT_EQ(whole.u0 | whole.v0, 0u);
    EXPECT_EQ(whole.u1 & whole.v1, 31u);
    const CellRect middle = cellsOf({-1.0f / 16, 0.0f, 0.25f, 0.26f, 0.0f, 1.0f});
    EXPECT_EQ(middle.u0, 15u);
    EXPECT_EQ(middle.u1, 16u); // half open: the border belongs to the upper cell
    EXPECT_EQ(middle.v0, 20u);
    EXPECT_EQ(middle.v1, 20u);
}

// Rectangles of receivers raise, rectangles of batches ask: the blocks must not change an answer.
TEST(CellDepth, QueriesEqualATestOfEveryCell) {
    for (const uint32_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 rng(seed);
        const auto below = [&](uint32_t n) { return uint32_t(rng() % n); };
        const auto randomRect = [&](uint32_t side) {
            const uint32_t u = below(32), v = below(32);
            return CellRect{u, std::min(31u, u + below(side)), v, std::min(31u, v + below(side))};
        };
        constexpr uint32_t kMaps = 2;
        Buffer<uint32_t> cells(Backend::kCpu, "cells", kMaps * kCellsPerMap);
        Buffer<uint32_t> blocks(Backend::kCpu, "blocks", kMaps * kBlocksPerMap);
        cells.fill(0);
        blocks.fill(0);
        std::vector<uint32_t> expectedCells(cells.size(), 0);
        for (int i = 0; i < 60; ++i) {
            const uint32_t map = below(kMaps), face = below(kFaceCount);
            const CellRect rect = randomRect(i % 5 ? 8 : 32);
            const uint32_t bits = depthBits(float(1 + below(100)));
            raiseCells(cells.view(), blocks.view(), map, face, rect, bits);
            for (uint32_t v = rect.v0; v <= rect.v1; ++v)
                for (uint32_t u = rect.u0; u <= rect.u1; ++u) {
                    uint32_t& cell = expectedCells[cellIndex(map, face, u, v)];
                    cell = std::max(cell, bits);
                }
        }
        runPass(Backend::kCpu, GatherBlock{cells.view(), blocks.view()});
        const CellDepthView view{std::as_const(cells).view(), std::as_const(blocks).view()};
        ASSERT_EQ(cells.download(), expectedCells);
        size_t yes = 0, no = 0;
        for (int i = 0; i < 20000; ++i) {
            const uint32_t map = below(kMaps), face = below(kFaceCount);
            const CellRect rect = randomRect(i % 4 ? 6 : 32);
            const uint32_t bits = depthBits(float(below(120)));
            bool expected = false;
            uint32_t asked = 0;
            for (uint32_t v = rect.v0; v <= rect.v1; ++v)
                for (uint32_t u = rect.u0; u <= rect.u1; ++u)
                    if (view.cells[cellIndex(map, face, u, v)] >= bits) {
                        expected = true;
                        ++asked;
                    }
            ASSERT_EQ(view.reaches(map, face, rect, bits), expected);
            uint32_t visited = 0;
            view.any(map, face, rect, bits, [&](uint32_t cell, uint32_t depth) {
                EXPECT_EQ(depth, view.cells[cell]);
                ++visited;
                return false;
            });
            ASSERT_EQ(visited, asked);
            ++(expected ? yes : no);
        }
        EXPECT_GT(yes, 1000u);
        EXPECT_GT(no, 1000u);
    }
}

} // namespace
} // namespace shadowdag
