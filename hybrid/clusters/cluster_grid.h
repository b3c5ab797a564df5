// SPDX-License-Identifier: Apache-2.0
// The grid of cells that contain the view samples: screen tiles times self-similar slices along
// depth. Source: Olsson, Billeter, Assarsson, Clustered Deferred and Forward Shading, HPG 2012,
// sec. 3.1.
#pragma once

#include "cuda/view.h"
#include "hybrid/gbuffer/view_rays.h"

#include <vector>

namespace shadowdag {

constexpr uint32_t kTileSizeLog2 = 5;
constexpr uint32_t kTileSize = 1u << kTileSizeLog2; ///< pixels a side

/// Larger grids are refused: their tables take 4 bytes per cell each, and a cell's number has 32
/// bits.
constexpr uint64_t kMaxCellCount = 1ull << 28;

/// Slice k holds the depths [sliceStart[k], sliceStart[k + 1]), half open; the last slice also
/// holds all beyond it. sliceStart: sliceCount floats, ascending; sliceStart[0] is the near plane.
struct ClusterGridView {
    View<const float> sliceStart;
    uint32_t width, height;
    uint32_t tileCountX, tileCountY;

    SDAG_HD uint32_t tileCount() const { return tileCountX * tileCountY; }
    SDAG_HD uint32_t sliceCount() const { return uint32_t(sliceStart.count); }
    SDAG_HD size_t cellCount() const { return size_t(tileCount()) * sliceCount(); }

    /// Returns the slice of a depth: the last one that starts at or before it (slice 0 for any
    /// before).
    SDAG_HD uint32_t sliceOf(float depthView) const {
        uint32_t first = 0, count = sliceCount() - 1; // the result is in [first, first + count]
        while (count > 0) {
            const uint32_t half = (count + 1) / 2;
            if (sliceStart[first + half] <= depthView) {
                first += half;
                count -= half;
            } else {
                count = half - 1;
            }
        }
        return first;
    }
    SDAG_HD uint32_t tileOf(uint32_t x, uint32_t y) const {
        return (y >> kTileSizeLog2) * tileCountX + (x >> kTileSizeLog2);
    }
    /// Returns the cell's number: by tile, slices from near to far within a tile.
    SDAG_HD uint32_t cellOf(uint32_t tile, uint32_t slice) const {
        return tile * sliceCount() + slice;
    }
    SDAG_HD uint32_t tileOfCell(uint32_t cell) const { return cell / sliceCount(); }
    SDAG_HD uint32_t sliceOfCell(uint32_t cell) const { return cell % sliceCount(); }
};

/// Throws Error kResource if the grid of a view would have more than kMaxCellCount cells. It
/// depends on the camera and the size alone, so it can be checked before any pixel is drawn.
void checkClusterGrid(const ViewRays& view);

/// Returns the slice starts of a view: each slice is deeper than the one before by the factor that
/// makes a cell as deep as its tile is high, z[k + 1] = z[k] * (1 + kTileSize * pixelSize),
/// multiplied up in double, rounded once. Throws as checkClusterGrid does.
std::vector<float> makeSliceTable(const ViewRays& view);

/// Returns the grid of a view over a slice table, which must outlive it.
ClusterGridView clusterGrid(const ViewRays& view, View<const float> sliceStart);

} // namespace shadowdag
