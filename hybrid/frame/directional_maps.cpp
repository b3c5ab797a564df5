// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/directional_maps.h"

#include <algorithm>
#include <bit>

namespace shadowdag {

void fitDirectionalWindows(const FrameClusters& clusters, const std::vector<Light>& lights,
                           const FrameOptions& options, std::vector<MapRecord>& records) {
    const auto isDirectional = [&](const MapRecord& record) {
        return lights[record.quantities.light].kind == Light::kSun;
    };
    if (std::none_of(records.begin(), records.end(), isDirectional))
        return;
    std::vector<DirectionalFrame> frames(records.size());
    for (size_t r = 0; r < records.size(); ++r)
        if (isDirectional(records[r]))
            frames[r] = makeDirectionalFrame(lights[records[r].quantities.light]);

    const std::vector<Box> boxes = clusters.clusters().boxesWorld.download();
    const std::vector<uint32_t> start = clusters.lights().start.download();
    const std::vector<uint32_t> recordOf = clusters.lights().record.download();
    std::vector<DirectionalRect> rects(records.size());
    for (size_t cluster = 0; cluster + 1 < start.size(); ++cluster)
        for (uint32_t i = start[cluster]; i < start[cluster + 1]; ++i) {
            const uint32_t r = recordOf[i];
            if (r != kProvenLit && isDirectional(records[r]))
                rects[r].add(frames[r], boxes[cluster]);
        }

    // A window covers as much as the four side faces of a cube.
    const uint32_t maxTexels =
        std::clamp(std::bit_floor(4 * options.maxFaceTexels), 64u, kMaxFaceTexels);
    for (size_t r = 0; r < records.size(); ++r) {
        if (!isDirectional(records[r]))
            continue;
        const FittedWindow map =
            fitDirectionalWindow(frames[r], rects[r], records[r].heldTexels, maxTexels);
        records[r].window = map.window;
        records[r].quantities.faceTexels = map.faceTexels;
        records[r].quantities.texels = float(map.widthTexels);
    }
}

} // namespace shadowdag
