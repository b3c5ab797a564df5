// SPDX-License-Identifier: Apache-2.0
// How far the pixels of a visibility buffer see, by tile, so that what lies behind is not drawn.
// Source: Greene, Kass, Miller, Hierarchical Z-Buffer Visibility, SIGGRAPH 1993.
#pragma once

#include "cuda/error.h"
#include "hybrid/gbuffer/gbuffer_raster.h"

#include <algorithm>
#include <vector>

namespace shadowdag {

/// Returns the bits of the depth that a pixel sees.
inline uint32_t depthSeen(uint64_t pixel) {
    return uint32_t(pixel >> 32);
}

/// An upper bound, by tile, of the depths that pixels see so far, on the CPU. Each tile and its
/// pixels are of one thread at a time. Depths are bits of floats that are not negative.
class TileDepths {
public:
    static constexpr int kSideLog2 = 3, kSide = 1 << kSideLog2; ///< pixels of a tile

    TileDepths(const ViewRays& view, View<const uint64_t> visibility)
        : width_(int(view.width)), height_(int(view.height)),
          across_((width_ + kSide - 1) >> kSideLog2), visibility_(visibility),
          tiles_(size_t(across_) * size_t((height_ + kSide - 1) >> kSideLog2)) {}

    /// Returns whether all pixels of the tile in column x and row y see something nearer than this
    /// depth; may be false if few came to do so lately.
    bool isTileHidden(int x, int y, uint32_t depthBits) {
        SDAG_ASSERT(depthBits >> 31 == 0);
        Tile& tile = at(x, y);
        if (tile.farthest >= depthBits && tile.writtenCount >= kStale)
            tile = {farthestIn(x, y), 0};
        return tile.farthest < depthBits;
    }
    /// Returns whether they do in all tiles that a rectangle touches.
    bool isRectHidden(const PixelRect& rect, uint32_t depthBits) {
        for (int y = rect.minY >> kSideLog2; y <= rect.maxY >> kSideLog2; ++y)
            for (int x = rect.minX >> kSideLog2; x <= rect.maxX >> kSideLog2; ++x)
                if (!isTileHidden(x, y, depthBits))
                    return false;
        return true;
    }
    /// Notes that about so many pixels of a tile now see something nearer than before.
    void note(int x, int y, uint32_t count) { at(x, y).writtenCount += count; }
    /// Notes that all pixels of a tile see something at this depth, or nearer.
    void lowerTo(int x, int y, uint32_t depthBits) {
        Tile& tile = at(x, y);
        tile.farthest = std::min(tile.farthest, depthBits);
    }

private:
    struct Tile {
        uint32_t farthest = 0xffffffffu; ///< bits of a depth
        uint32_t writtenCount = 0;       ///< about, since `farthest` was found
    };
    static constexpr uint32_t kStale = kSide * kSide / 2;

    Tile& at(int x, int y) { return tiles_[size_t(y) * size_t(across_) + size_t(x)]; }

    uint32_t farthestIn(int x, int y) const {
        const int x1 = std::min((x + 1) << kSideLog2, width_),
                  y1 = std::min((y + 1) << kSideLog2, height_);
        uint32_t farthest = 0;
        for (int py = y << kSideLog2; py < y1; ++py) {
            const uint64_t* const row = &visibility_[size_t(py) * size_t(width_)];
            for (int px = x << kSideLog2; px < x1; ++px)
                farthest = std::max(farthest, depthSeen(row[px]));
        }
        return farthest;
    }

    int width_, height_, across_;
    View<const uint64_t> visibility_;
    std::vector<Tile> tiles_;
};

} // namespace shadowdag
