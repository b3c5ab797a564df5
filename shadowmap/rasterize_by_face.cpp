// SPDX-License-Identifier: Apache-2.0
// The CPU's own rasterization kernel: the set-up and fill of rasterize.h, a face of a map at a
// time, so that texels need no atomics.
#include "shadowmap/rasterize_pass.h"

#include "cuda/parallel_for.h"

#include <algorithm>
#include <numeric>

namespace shadowdag {

void rasterizeByFace(const RasterView& view, const std::vector<uint32_t>& drawStart) {
    const size_t mapCount = view.maps.count;
    SDAG_ASSERT(drawStart.size() == mapCount + 1);
    // Longest first, so that the last thread is not left alone with a big one.
    std::vector<uint32_t> order(mapCount);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        return drawStart[a + 1] - drawStart[a] > drawStart[b + 1] - drawStart[b];
    });
    cpuParallelRanges(mapCount * kFaceCount, 1, [&](size_t begin, size_t end) {
        for (size_t item = begin; item < end; ++item) {
            const uint32_t mapIndex = order[item / kFaceCount];
            const uint32_t face = uint32_t(item % kFaceCount);
            const ShadowMapInfo map = view.maps[mapIndex];
            uint32_t* const depths = view.depths.data;
            for (uint32_t i = drawStart[mapIndex]; i < drawStart[mapIndex + 1]; ++i) {
                const BatchDraw& draw = view.draws[i];
                if (!(draw.faces >> face & 1u))
                    continue;
                const Batch& batch = view.batches[draw.batch];
                for (uint32_t inBatch = 0; inBatch < batch.count; ++inBatch) {
                    const uint32_t triangle = view.batchTriangles[batch.first + inBatch];
                    glm::dvec3 corners[3];
                    for (int corner = 0; corner < 3; ++corner)
                        corners[corner] =
                            faceFromLight(face, cornerFromLight(view.geometry, triangle, corner,
                                                                map.lightPositionWorld));
                    FaceTriangle t;
                    if (!setUpTriangle(corners[0], corners[1], corners[2], map, t))
                        continue;
                    // Written always, so that the compiler may take several texels at once.
                    coverTexels(view, map, face, t, t.y0, t.y1,
                                [depths](size_t texel, uint32_t bits) {
                                    depths[texel] = depths[texel] > bits ? depths[texel] : bits;
                                });
                }
            }
        }
    });
}

} // namespace shadowdag
