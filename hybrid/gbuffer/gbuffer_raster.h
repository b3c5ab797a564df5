// SPDX-License-Identifier: Apache-2.0
// The visibility buffer: triangles to pixels by homogeneous edge functions, and pixels back to
// surface points. Source: Olano, Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates,
// Graphics Hardware 1997: no clipping, so triangles may pass through the camera. Depth comes from
// the plane, not from interpolation.
//
// Fill rule: a pixel is covered by every triangle that its sample's ray meets, borders included; of
// the triangles met between the near and the far plane the nearest wins, of equally near ones (as
// floats) the one with the lowest index. An edge function of two triangles at a shared edge is the
// same number with opposite sign, bit for bit, so there are no cracks.
#pragma once

#include "cuda/atomics.h"
#include "cuda/pass.h"
#include "cuda/split_work_view.h"
#include "hybrid/gbuffer/gbuffer.h"
#include "hybrid/gbuffer/view_rays.h"
#include "scenes/batches.h"

#include <bit>

namespace shadowdag {

/// A pixel of the visibility buffer: bits 32..63 the depth's float bits (positive floats order as
/// integers), bits 0..31 the triangle. All ones: background.
constexpr uint64_t kNothingSeen = ~uint64_t(0);

/// The cross product of parallel sides a, b rounds to at most about 1e-15 |a| |b|, not always to
/// zero: if its square is no more than this part of theirs, a triangle has no area.
constexpr double kParallelSides = 1e-28;

/// A triangle relative to the camera.
struct ViewTriangle {
    glm::dvec3 corner[3]; ///< world axes, camera at the origin
    glm::dvec3 normal;    ///< cross product of two sides, not unit
    bool isDegenerate;    ///< has no area within double rounding: never visible
};

/// Returns triangle `index` relative to the camera.
SDAG_HD inline ViewTriangle loadViewTriangle(const TriangleView& triangles, uint32_t index,
                                             const glm::dvec3& origin) {
    ViewTriangle t;
    for (int i = 0; i < 3; ++i)
        t.corner[i] = glm::dvec3(triangles.vertex(index, i)) - origin;
    const glm::dvec3 a = t.corner[1] - t.corner[0];
    const glm::dvec3 b = t.corner[2] - t.corner[0];
    t.normal = glm::cross(a, b);
    t.isDegenerate =
        !(glm::dot(t.normal, t.normal) > kParallelSides * glm::dot(a, a) * glm::dot(b, b));
    return t;
}

/// Pixels [minX, maxX] x [minY, maxY]; empty when min > max.
struct PixelRect {
    int minX, minY, maxX, maxY;
};

/// Rectangles of triangles are so much larger, in pixels: far more than the rounding of their
/// computation.
constexpr double kPixelMargin = 0.01;

/// Returns the pixels that may see the part of a triangle beyond the near plane.
/// @param nearest receives the depth of its nearest corner
SDAG_HD inline PixelRect boundPixels(const ViewTriangle& t, const ViewRays& view, float& nearest) {
    double minX = 1e30, minY = 1e30, maxX = -1e30, maxY = -1e30;
    glm::dvec3 p[3]; // right, up, forward
    for (int i = 0; i < 3; ++i)
        p[i] = {glm::dot(t.corner[i], view.right), glm::dot(t.corner[i], view.up),
                glm::dot(t.corner[i], view.forward)};
    nearest = glm::min(float(p[0].z), glm::min(float(p[1].z), float(p[2].z)));
    const auto add = [&](double x, double y, double z) {
        minX = glm::min(minX, x / z);
        maxX = glm::max(maxX, x / z);
        minY = glm::min(minY, y / z);
        maxY = glm::max(maxY, y / z);
    };
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3& a = p[i];
        const glm::dvec3& b = p[i == 2 ? 0 : i + 1];
        if (a.z >= view.znear)
            add(a.x, a.y, a.z);
        if ((a.z >= view.znear) != (b.z >= view.znear)) {
            const double s = (view.znear - a.z) / (b.z - a.z);
            add(a.x + s * (b.x - a.x), a.y + s * (b.y - a.y), view.znear);
        }
    }
    const double scale = 1.0 / view.pixelSize;
    const double left = (minX - view.firstX) * scale - kPixelMargin;
    const double right = (maxX - view.firstX) * scale + kPixelMargin;
    const double top = (view.firstY - maxY) * scale - kPixelMargin;
    const double bottom = (view.firstY - minY) * scale + kPixelMargin;
    const double lastX = double(view.width) - 1.0, lastY = double(view.height) - 1.0;
    if (!(left <= lastX && right >= 0.0 && top <= lastY && bottom >= 0.0))
        return {0, 0, -1, -1};
    return {int(glm::ceil(glm::max(left, 0.0))), int(glm::ceil(glm::max(top, 0.0))),
            int(glm::floor(glm::min(right, lastX))), int(glm::floor(glm::min(bottom, lastY)))};
}

/// Returns whether a box may be seen: false only when it lies wholly outside one plane of the view.
SDAG_HD inline bool mayBeSeen(const Box& box, const ViewRays& view) {
    if (box.empty())
        return false;
    const glm::dvec3 center = (glm::dvec3(box.min) + glm::dvec3(box.max)) * 0.5 - view.origin;
    const glm::dvec3 half = (glm::dvec3(box.max) - glm::dvec3(box.min)) * 0.5;
    const auto farthest = [&](const glm::dvec3& n) { // largest n . p over the box
        return glm::dot(n, center) + glm::dot(glm::abs(n), half);
    };
    const double x = -view.firstX + view.pixelSize, y = view.firstY + view.pixelSize;
    return farthest(view.forward) >= view.znear && farthest(-view.forward) >= -view.zfar &&
           farthest(x * view.forward + view.right) >= 0.0 &&
           farthest(x * view.forward - view.right) >= 0.0 &&
           farthest(y * view.forward + view.up) >= 0.0 &&
           farthest(y * view.forward - view.up) >= 0.0;
}

/// A triangle set up for the view. edge k (3: the plane) at pixel (x, y) = start + y * perY + x *
/// perX; the sign of an edge is the side on which the pixel's ray passes.
struct SeenTriangle {
    double start[4], perX[4], perY[4];
    double plane;
    uint32_t triangle;
    PixelRect rect; ///< pixels that may see it
    float nearest;  ///< depth of its nearest corner

    /// Returns the depth at which a pixel sees it. Where its plane passes through the eye, to
    /// rounding, the quotient is arbitrary; nothing is seen before its nearest corner. @param along
    /// the function of the plane
    SDAG_HD double depthAt(double along) const { return glm::max(plane / along, double(nearest)); }
};

/// Returns whether a triangle may be seen, and its setup.
SDAG_HD inline bool setUpSeen(const TriangleView& triangles, uint32_t index, const ViewRays& view,
                              SeenTriangle& seen) {
    const ViewTriangle t = loadViewTriangle(triangles, index, view.origin);
    if (t.isDegenerate)
        return false;
    seen.rect = boundPixels(t, view, seen.nearest);
    if (seen.rect.minX > seen.rect.maxX || seen.rect.minY > seen.rect.maxY)
        return false;
    for (int i = 0; i < 4; ++i) {
        const glm::dvec3 n =
            i == 3 ? t.normal : glm::cross(t.corner[i], t.corner[i == 2 ? 0 : i + 1]);
        seen.start[i] = glm::dot(n, view.first);
        seen.perX[i] = glm::dot(n, view.stepX);
        seen.perY[i] = glm::dot(n, view.stepY);
    }
    seen.plane = glm::dot(t.normal, t.corner[0]);
    seen.triangle = index;
    return true;
}

/// Draws the pixels of `rect` that a triangle covers into the visibility buffer, without those that
/// its alpha mask cuts out.
SDAG_HD inline void coverPixels(const TriangleView& triangles, const SeenTriangle& seen,
                                const PixelRect& rect, const ViewRays& view,
                                View<uint64_t> visibility) {
    const bool isCut = triangles.masks.isCut(seen.triangle);
    for (int y = rect.minY; y <= rect.maxY; ++y) {
        double row[4];
        for (int i = 0; i < 4; ++i)
            row[i] = seen.start[i] + double(y) * seen.perY[i];
        for (int x = rect.minX; x <= rect.maxX; ++x) {
            const double e0 = row[0] + double(x) * seen.perX[0];
            const double e1 = row[1] + double(x) * seen.perX[1];
            const double e2 = row[2] + double(x) * seen.perX[2];
            const bool isInside =
                (e0 >= 0.0 && e1 >= 0.0 && e2 >= 0.0) || (e0 <= 0.0 && e1 <= 0.0 && e2 <= 0.0);
            if (!isInside)
                continue;
            const double depth = seen.depthAt(row[3] + double(x) * seen.perX[3]);
            if (!(depth >= view.znear && depth <= view.zfar)) // NaN: seen edge on
                continue;
            // A corner's weight is the function of the edge opposite to it.
            if (isCut && !triangles.masks.isOpaque(seen.triangle, e1, e2, e0))
                continue;
            const uint64_t bits = std::bit_cast<uint32_t>(float(depth));
            atomicMinRelaxed(&visibility[size_t(y) * view.width + x], bits << 32 | seen.triangle);
        }
    }
}

/// Draws one triangle into the visibility buffer.
SDAG_HD inline void rasterizeTriangle(const TriangleView& triangles, uint32_t index,
                                      const ViewRays& view, View<uint64_t> visibility) {
    SeenTriangle seen;
    if (setUpSeen(triangles, index, view, seen))
        coverPixels(triangles, seen, seen.rect, view, visibility);
}

/// What is drawn, and where.
struct BatchesInView {
    TriangleView triangles;
    View<const Batch> batches;
    View<const Box> batchBoxes;
    View<const uint32_t> batchTriangles;
    ViewRays view;
    View<uint64_t> visibility;
};

/// Triangles whose rectangle has more pixels than this are split into tiles of so many pixels per
/// side, one column per lane.
constexpr int kSmallTrianglePixels = 256;
constexpr int kPartPixels = int(kGroupLanes);

/// Draws triangle i % slotsPerBatch of batch i / slotsPerBatch, or, if it is large, puts it on the
/// list. A GPU does the same for 32 triangles at once (gbuffer_cuda.cu).
struct RasterizeSlots {
    BatchesInView batches;
    uint32_t slotsPerBatch;    ///< no batch holds more triangles
    SplitWorkView large;       ///< a: the triangle
    View<SeenTriangle> setups; ///< by item of the list, as long as it

    size_t itemCount() const { return batches.batches.count * slotsPerBatch; }
    SDAG_HD void operator()(size_t i) const {
        const size_t b = i / slotsPerBatch;
        const uint32_t slot = uint32_t(i % slotsPerBatch);
        const Batch batch = batches.batches[b];
        if (slot >= batch.count || !mayBeSeen(batches.batchBoxes[b], batches.view))
            return;
        SeenTriangle seen;
        if (!setUpSeen(batches.triangles, batches.batchTriangles[batch.first + slot], batches.view,
                       seen))
            return;
        const PixelRect& rect = seen.rect;
        const int width = rect.maxX - rect.minX + 1, height = rect.maxY - rect.minY + 1;
        uint32_t index;
        if (int64_t(width) * height > kSmallTrianglePixels &&
            large.add(seen.triangle, 0, partsOf(width) * partsOf(height), index)) {
            setups[index] = seen;
            return;
        }
        coverPixels(batches.triangles, seen, rect, batches.view, batches.visibility);
    }

    SDAG_HD static constexpr uint32_t partsOf(int pixels) {
        return uint32_t(pixels + kPartPixels - 1) / uint32_t(kPartPixels);
    }
};
void launchPass(CudaTag, const RasterizeSlots& work); ///< by warps

/// Returns whether no pixel of `rect` is inside a triangle. An edge function is rounded alike for
/// all pixels and each operation is monotone, so its values at the corners of the rectangle bound
/// the others, exactly as they are computed.
SDAG_HD inline bool isOutside(const SeenTriangle& seen, const PixelRect& rect) {
    bool isBelow = false, isAbove = false; // an edge is negative, or positive, at all pixels
    for (int i = 0; i < 3; ++i) {
        const double top = seen.start[i] + double(rect.minY) * seen.perY[i],
                     bottom = seen.start[i] + double(rect.maxY) * seen.perY[i],
                     left = double(rect.minX) * seen.perX[i],
                     right = double(rect.maxX) * seen.perX[i];
        isBelow |= glm::max(top, bottom) + glm::max(left, right) < 0.0;
        isAbove |= glm::min(top, bottom) + glm::min(left, right) > 0.0;
    }
    return isBelow && isAbove;
}

/// Returns whether all pixels of a column see something nearer than a triangle. Its depth is its
/// plane over a function that is monotone along the column, as rounded: the ends bound it. Pixels
/// only see nearer things meanwhile, so a value that is no longer current hides less.
SDAG_HD inline bool isHidden(const SeenTriangle& seen, const PixelRect& column,
                             const ViewRays& view, View<const uint64_t> visibility) {
    const auto depth = [&](int y) {
        return seen.plane /
               (seen.start[3] + double(y) * seen.perY[3] + double(column.minX) * seen.perX[3]);
    }; // depthAt is no nearer
    const double top = depth(column.minY), bottom = depth(column.maxY);
    if (!(top > 0.0 && bottom > 0.0)) // its plane passes through the camera's between them
        return false;
    const uint32_t nearest = std::bit_cast<uint32_t>(float(glm::min(top, bottom)));
    bool isBehind = true;
    for (int y = column.minY; y <= column.maxY; ++y)
        isBehind &=
            uint32_t(loadPast(&visibility[size_t(y) * view.width + column.minX]) >> 32) < nearest;
    return isBehind;
}

/// Draws a column of a tile of a triangle that RasterizeSlots put on the list.
struct RasterizeLarge {
    BatchesInView batches;
    SplitWorkView parts;
    View<const SeenTriangle> setups; ///< of RasterizeSlots

    SDAG_HD bool wants(const SplitItem& item, uint32_t part) const {
        const SeenTriangle& seen = setups[item.index];
        return !isOutside(seen, tileOf(seen, part));
    }
    SDAG_HD void operator()(const SplitItem& item, uint32_t part, uint32_t lane) const {
        const SeenTriangle& seen = setups[item.index];
        PixelRect column = tileOf(seen, part);
        column.minX += int(lane);
        if (column.minX > column.maxX)
            return;
        column.maxX = column.minX;
        if (!isHidden(seen, column, batches.view, batches.visibility))
            coverPixels(batches.triangles, seen, column, batches.view, batches.visibility);
    }

private:
    SDAG_HD static PixelRect tileOf(const SeenTriangle& seen, uint32_t part) {
        const PixelRect& all = seen.rect;
        const uint32_t across = RasterizeSlots::partsOf(all.maxX - all.minX + 1);
        const int x = all.minX + int(part % across) * kPartPixels,
                  y = all.minY + int(part / across) * kPartPixels;
        return {x, y, glm::min(x + kPartPixels - 1, all.maxX),
                glm::min(y + kPartPixels - 1, all.maxY)};
    }
};

/// Turns a pixel of the visibility buffer into a view sample: the point where its ray meets the
/// triangle's plane, computed in double, rounded once.
struct ResolveSamples {
    TriangleView triangles;
    ViewRays view;
    View<const uint64_t> visibility;
    View<glm::vec3> positionWorld;
    View<glm::vec3> normalWorld;
    View<float> depthView;
    View<uint32_t> triangle;

    size_t itemCount() const { return visibility.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (visibility[i] == kNothingSeen) {
            positionWorld[i] = normalWorld[i] = glm::vec3(0.0f);
            depthView[i] = 0.0f;
            triangle[i] = kBackground;
            return;
        }
        const uint32_t index = uint32_t(visibility[i]);
        const ViewTriangle t = loadViewTriangle(triangles, index, view.origin);
        const glm::dvec3 d = view.direction(uint32_t(i % view.width), uint32_t(i / view.width));
        const double along = glm::dot(t.normal, d);
        const float seen = std::bit_cast<float>(uint32_t(visibility[i] >> 32));
        double depth = glm::dot(t.normal, t.corner[0]) / along;
        // In a plane through the eye, to rounding, this is a quotient of rounding errors: another
        // one than that of the visibility buffer, which is in range.
        if (!(glm::abs(depth - double(seen)) <= double(seen) * 0x1p-20))
            depth = double(seen);
        const double toUnit = (along > 0.0 ? -1.0 : 1.0) / glm::sqrt(glm::dot(t.normal, t.normal));
        positionWorld[i] = glm::vec3(view.origin + depth * d);
        normalWorld[i] = glm::vec3(t.normal * toUnit);
        depthView[i] = seen;
        triangle[i] = index;
    }
};

void launchPass(CpuTag, const ResolveSamples& work); ///< in lanes

} // namespace shadowdag
