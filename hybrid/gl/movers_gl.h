// SPDX-License-Identifier: Apache-2.0
// The moving geometry as one array of words for hybrid/gl/mover_rays.glsl.
#pragma once

#include "gl/program.h"
#include "hybrid/rays/mover_rays.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Returns the words; empty without moving geometry.
///
///     0        levels of the hierarchy
///     1 .. 4   where boxes, items, lights and words of masks start
///     5 ..     levelStart of the hierarchy
///     boxes    6 floats each: least, greatest corner
///     items    first word of its triangles, number of triangles
///     lights   1 if moving triangles may shadow the light, else 0
///     triangles  world triangle, word of its cut or kNotCut
///     cuts     MaskInfo, then the texture coordinates of the corners
///     masks    AlphaMaskView::words, where a moving triangle is cut
///
/// @param movers on the host
std::vector<uint32_t> packMovers(const MoverView& movers);

/// Returns the definitions of hybrid/gl/mover_rays.glsl: the bindings of the world's positions and
/// triangles and of the words, and the offsets in these.
GlDefines moverDefines(uint32_t positionsBinding, uint32_t trianglesBinding,
                       uint32_t moversBinding);

} // namespace shadowdag
