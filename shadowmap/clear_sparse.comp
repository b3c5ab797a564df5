// SPDX-License-Identifier: Apache-2.0
// Clears pages of one sparse texture, one group per page.
layout(local_size_x = 64) in;
#include "gl/groups.glsl"

struct Page { // GlSparseDrawer::Place
    uint pool, array, layer, x, y;
};
layout(std430, binding = 0) readonly buffer Pages { Page pages[]; };
#ifdef SDAG_LAYERED
layout(r32f, binding = 0) writeonly uniform image2DArray sparseLayers;
#else
layout(r32ui, binding = 0) writeonly uniform uimage2DArray sparseLayers;
#endif
uniform uint pageTexelsLog2, firstPage, endPage;

void main() {
    uint group = groupIndex() + firstPage;
    if (group >= endPage)
        return;
    Page page = pages[group];
    uint side = 1u << pageTexelsLog2;
    for (uint i = gl_LocalInvocationID.x; i < side * side; i += gl_WorkGroupSize.x)
        imageStore(sparseLayers,
                   ivec3(page.x * side + (i & (side - 1u)), page.y * side + (i >> pageTexelsLog2), page.layer),
#ifdef SDAG_LAYERED
                   vec4(0.0));
#else
                   uvec4(0u));
#endif
}
