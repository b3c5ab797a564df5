// SPDX-License-Identifier: Apache-2.0
// Clears pages of the pool, one group per page.
layout(local_size_x = 64) in;
#include "gl/groups.glsl"

layout(std430, binding = 0) readonly buffer Pages { uint pages[]; };
layout(std430, binding = SDAG_DEPTHS_BINDING) writeonly buffer Depths { uint depths[]; };
layout(std430, binding = SDAG_MORE_DEPTHS_BINDING) writeonly buffer MoreDepths { uint moreDepths[]; };
uniform uint pageTexelsLog2, pageCount;

void main() {
    uint group = groupIndex();
    if (group >= pageCount)
        return;
    uint texels = 1u << (2u * pageTexelsLog2), first = pages[group] * texels;
    for (uint i = gl_LocalInvocationID.x; i < texels; i += gl_WorkGroupSize.x)
        if (first < SDAG_CHUNK_TEXELS) // no page lies in both buffers
            depths[first + i] = 0u;
        else
            moreDepths[first + i - SDAG_CHUNK_TEXELS] = 0u;
}
