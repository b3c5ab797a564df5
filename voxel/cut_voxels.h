// SPDX-License-Identifier: Apache-2.0
// Which voxels the opaque part of a triangle touches that an alpha mask cuts: of the voxels that
// the triangle touches those in which the mask is opaque somewhere. The part of the triangle within
// a voxel is clipped, its texture coordinates are bounded by a rectangle, and the mask is asked for
// any opaque texel in it. So a voxel may stay that the triangle's opaque part misses by less than
// the rectangle exceeds the part (never one voxel further); none is lost that an opaque point
// touches.
#pragma once

#include "voxel/mask_pyramid.h"
#include "voxel/triangle_voxels.h"

namespace shadowdag {

/// A cut triangle made ready: its texture coordinates, in texels, as affine functions of voxel
/// coordinates along the setup's axes u and v.
///
/// Error: with det the doubled area seen along d, and E the longest edge, a derivative is off by
/// 16 eps E T / |det| (T the extent of the coordinates) and det by 8 eps E^2. Triangles with |det|
/// < 1e-6 E^2 are taken as opaque. For the others a derivative G is off by 2e-9 |G|, over a lever
/// of E + 3 voxels; positions are off by slack and slackPlane (triangle_voxels.h). Rectangles are
/// grown by |G| (1e-8 (E + 3) + 4 slack).
struct CutSetup {
    const MaskPyramid* mask = nullptr; ///< null: opaque
    glm::dvec2 origin{0.0}, perU{0.0}, perV{0.0};
    glm::dvec2 least{0.0}, most{0.0}; ///< of the texels that its points lie in (TexelSpan)
    glm::dvec2 grow{0.0};

    glm::dvec2 at(const TriangleSetup& s, double u, double v) const {
        return origin + perU * (u - s.p[0][0]) + perV * (v - s.p[1][0]);
    }
    /// Returns the cover of the mask over a rectangle, as far as points of the triangle lie in it.
    MaskCover cover(const glm::dvec2& lo, const glm::dvec2& hi) const {
        return mask->cover(glm::clamp(lo - grow, least, most), glm::clamp(hi + grow, least, most));
    }
};

/// @param uv texture coordinates of the setup's corners
CutSetup setupCut(const TriangleSetup& s, const glm::vec2 uv[3], const MaskPyramid& mask);

/// Returns the cover of the mask over the part of the triangle within column (u, v), all of it.
MaskCover coverOfColumn(const TriangleSetup& s, const CutSetup& cut, double u, double v);

/// Returns whether the mask may be opaque somewhere on the part of the triangle within the closed
/// voxel whose least corner is (u, v, d) along the setup's axes.
bool isOpaqueInVoxel(const TriangleSetup& s, const CutSetup& cut, double u, double v, double d);

} // namespace shadowdag
