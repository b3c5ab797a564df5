// SPDX-License-Identifier: Apache-2.0
// The boxes of clusters: that of the cell, that of the samples, or one in between that is stored in
// one word per cluster. Source of the last: Olsson et al. 2015, sec. V-E, "Explicit Cluster
// Bounds".
#pragma once

#include "cuda/mutant.h"
#include "hybrid/clusters/clusters.h"
#include "voxel/bits.h"

#include <bit>

namespace shadowdag {

/// Returns the box around a cell: the part of the view behind its tile between its slice's two
/// depths (to the far plane for the last slice), grown by the rounding of sample positions so that
/// it holds every sample of the cell.
SDAG_HD inline Box implicitBounds(const ClusterGridView& grid, const ViewRays& view,
                                  uint32_t cell) {
    const uint32_t tile = grid.tileOfCell(cell), slice = grid.sliceOfCell(cell);
    const double nearZ = slice == 0 ? view.znear : double(grid.sliceStart[slice]);
    const double farZ =
        slice + 1 == grid.sliceCount() ? view.zfar : double(grid.sliceStart[slice + 1]);
    const double x0 = double(tile % grid.tileCountX) * kTileSize - 0.5;
    const double y0 = double(tile / grid.tileCountX) * kTileSize - 0.5;
    const double x1 = glm::min(x0 + kTileSize, double(grid.width) - 0.5);
    const double y1 = glm::min(y0 + kTileSize, double(grid.height) - 0.5);
    glm::dvec3 low(1e300), high(-1e300);
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 d = view.first + ((corner & 1) ? x1 : x0) * view.stepX +
                             ((corner & 2) ? y1 : y0) * view.stepY;
        const glm::dvec3 p = view.origin + ((corner & 4) ? farZ : nearZ) * d;
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    // Positions and depths are rounded to float once each: half a unit in the last place of either;
    // four units are granted because this box is rounded as well.
    constexpr double kGrow = 4.0 / (1 << 23);
    const glm::dvec3 grow = kGrow * (glm::abs(view.origin) +
                                     glm::max(glm::abs(low), glm::abs(high)) + glm::dvec3(farZ));
    Box box;
    box.min = glm::vec3(low - grow);
    box.max = glm::vec3(high + grow);
    return box;
}

/// Which tenths of the implicit box's sides contain samples:
///
///     | 31 30 | 29 .. 20 | 19 .. 10 | 9 .. 0 |
///     |   0   |    z     |    y     |   x    |     bit i of a field: tenth i from the minimum
///
/// The axes are those of the world, along which boxes lie and shadow maps look, so that the box
/// excludes the part of its cell that a floor or a wall leaves empty. (The paper does not name its
/// space; a subdivision of the frustum cell along the screen and the depth would have to be boxed
/// again.)
constexpr uint32_t kTenths = 10;
constexpr uint32_t kTenthsMask = (1u << kTenths) - 1;
static_assert(3 * kTenths <= 32);

SDAG_HD inline uint32_t tenthsOf(uint32_t word, int axis) {
    return word >> (uint32_t(axis) * kTenths) & kTenthsMask;
}
SDAG_HD inline uint32_t tenthBit(int axis, uint32_t tenth) {
    return 1u << (uint32_t(axis) * kTenths + tenth);
}

/// Return the first and the last set bit of a field that is not 0, by counting zeros from either
/// end.
SDAG_HD inline uint32_t firstTenth(uint32_t tenths) {
    return lowestBit32(tenths);
}
SDAG_HD inline uint32_t lastTenth(uint32_t tenths) {
#if defined(__CUDA_ARCH__)
    return 31u - uint32_t(__clz(int(tenths)));
#else
    return 31u - uint32_t(std::countl_zero(tenths));
#endif
}

/// Returns the i-th of the eleven planes between and around the tenths of an interval; plane 0 and
/// plane 10 are its ends exactly, and none lies before the one before it.
SDAG_HD inline float tenthPlane(float low, float high, uint32_t i) {
    if (i >= kTenths)
        return high;
    const float plane = float(double(low) + (double(high) - double(low)) * (i * (1.0 / kTenths)));
    return plane < high ? plane : high;
}

/// Returns the tenth of an interval that contains a coordinate inside of it: the planes around it
/// are those of tenthPlane, including their rounding.
SDAG_HD inline uint32_t tenthOf(float low, float high, float coordinate) {
    const double extent = double(high) - double(low);
    if (!(extent > 0.0))
        return 0;
    const int guess = int((double(coordinate) - double(low)) / extent * kTenths);
    uint32_t tenth = uint32_t(glm::clamp(guess, 0, int(kTenths) - 1));
    while (tenth > 0 && coordinate < tenthPlane(low, high, tenth))
        --tenth;
    while (tenth + 1 < kTenths && coordinate > tenthPlane(low, high, tenth + 1))
        ++tenth;
    return tenth;
}

/// Returns the word of a single sample of the implicit box.
SDAG_HD inline uint32_t tenthsWord(const Box& implicitBox, const glm::vec3& position) {
    uint32_t word = 0;
    for (int axis = 0; axis < 3; ++axis)
        word |=
            tenthBit(axis, tenthOf(implicitBox.min[axis], implicitBox.max[axis], position[axis]));
    return word;
}

/// Returns the box from the first to the last tenth that holds samples, on every axis; it holds all
/// positions whose words were joined. An axis without a bit keeps its side.
SDAG_HD inline Box shrinkToTenths(const Box& implicitBox, uint32_t word) {
    Box box = implicitBox;
    for (int axis = 0; axis < 3; ++axis) {
        const uint32_t tenths = tenthsOf(word, axis);
        if (tenths == 0)
            continue;
        const float low = implicitBox.min[axis], high = implicitBox.max[axis];
        box.min[axis] = tenthPlane(low, high, firstTenth(tenths));
        box.max[axis] = tenthPlane(low, high, lastTenth(tenths) + 1);
    }
    return box;
}

/// Bounds of every cluster by its cell.
struct BoundByCell {
    ClusterGridView grid;
    ViewRays view;
    View<const uint32_t> cell;
    View<Box> boxesWorld;

    size_t itemCount() const { return cell.count; }
    size_t grain() const { return 256; }
    SDAG_HD void operator()(size_t cluster) const {
        Box box = cell[cluster] == kNoCluster ? Box{} : implicitBounds(grid, view, cell[cluster]);
        if (isMutant(Mutant::kBoxShrunk))
            box.max = glm::mix(box.min, box.max, 0.9f);
        boxesWorld[cluster] = box;
    }
};

/// Bounds of every cluster: the smallest box of its samples. A minimum does not depend on order if
/// all its zeros have the same sign.
struct BoundBySamples {
    GBufferView gbuffer;
    ClusterView clusters; ///< boxesWorld not read
    View<Box> boxesWorld;

    /// Returns the box of every n-th sample.
    SDAG_HD Box part(size_t cluster, uint32_t first, uint32_t stride) const {
        Box box;
        const uint32_t end = clusters.sampleStart[cluster + 1];
        for (uint32_t i = clusters.sampleStart[cluster] + first; i < end; i += stride)
            box.add(gbuffer.positionWorld[clusters.samples[i]]);
        return box;
    }
    SDAG_HD void store(size_t cluster, const Box& box) const {
        boxesWorld[cluster].min = box.min + 0.0f;
        boxesWorld[cluster].max = box.max + 0.0f;
        if (isMutant(Mutant::kBoxShrunk))
            boxesWorld[cluster].max = glm::mix(box.min, box.max, 0.9f);
    }
    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const { store(cluster, part(cluster, 0, 1)); }
};

/// Joins the word of entry i of clusters.samples to that of its cluster (0 before).
struct JoinTenths {
    GBufferView gbuffer;
    ClusterView clusters; ///< boxesWorld: implicit
    View<uint32_t> words; ///< clusterCount

    size_t itemCount() const { return clusters.samples.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (!clusters.isEntry(i))
            return;
        const uint32_t sample = clusters.samples[i];
        const uint32_t cluster = clusters.clusterOfSample[sample];
        atomicOrRelaxed(&words[cluster],
                        tenthsWord(clusters.boxesWorld[cluster], gbuffer.positionWorld[sample]));
    }
};

/// Shrinks the implicit box of every cluster by its word.
struct ShrinkBounds {
    View<const uint32_t> words;
    View<Box> boxesWorld; ///< implicit before

    size_t itemCount() const { return boxesWorld.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t cluster) const {
        boxesWorld[cluster] = shrinkToTenths(boxesWorld[cluster], words[cluster]);
    }
};

} // namespace shadowdag
