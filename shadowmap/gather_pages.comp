// SPDX-License-Identifier: Apache-2.0
// Copies pages of sparse textures into a pool with the CPU's layout, starting at page firstPool. One
// group per page.
layout(local_size_x = 64) in;
#include "gl/groups.glsl"
#include "shadowmap/sparse_depth.glsl"

struct Page { // GlSparseDrawer::Place
    uint pool, array, layer, x, y;
};
layout(std430, binding = 0) readonly buffer Pages { Page pages[]; };
layout(std430, binding = SDAG_DEPTHS_BINDING) writeonly buffer Depths { uint depths[]; };
uniform uint pageTexelsLog2, pageCount, firstPool;

void main() {
    uint group = groupIndex();
    if (group >= pageCount)
        return;
    Page page = pages[group];
    uint side = 1u << pageTexelsLog2, texels = side * side;
    for (uint i = gl_LocalInvocationID.x; i < texels; i += gl_WorkGroupSize.x) {
        ivec3 at = ivec3(page.x * side + (i & (side - 1u)), page.y * side + (i >> pageTexelsLog2), page.layer);
        depths[(page.pool - firstPool) * texels + i] = floatBitsToUint(sparseTexel(page.array, at));
    }
}
