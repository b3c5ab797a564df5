// SPDX-License-Identifier: Apache-2.0
// The windows of suns: the clusters that ask for one lie in it.
#include "hybrid/frame/frame_state.h"

#include <algorithm>
#include <bit>

namespace shadowdag {

void fitSunWindows(const FrameState& state, const FrameOptions& options,
                   std::vector<MapRecord>& records) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const auto isSun = [&](const MapRecord& record) {
        return lights[record.quantities.light].kind == Light::kSun;
    };
    if (std::none_of(records.begin(), records.end(), isSun))
        return;
    std::vector<SunFrame> frames(records.size());
    for (size_t r = 0; r < records.size(); ++r)
        if (isSun(records[r]))
            frames[r] = makeSunFrame(lights[records[r].quantities.light]);

    const std::vector<Box> boxes = state.clusters.boxesWorld.download();
    const std::vector<uint32_t> start = state.lists.start.download();
    const std::vector<uint32_t> recordOf = state.lists.record.download();
    std::vector<SunRect> rects(records.size());
    for (size_t cluster = 0; cluster + 1 < start.size(); ++cluster)
        for (uint32_t i = start[cluster]; i < start[cluster + 1]; ++i) {
            const uint32_t r = recordOf[i];
            if (r != kProvenLit && isSun(records[r]))
                rects[r].add(frames[r], boxes[cluster]);
        }

    // A window spans what the four side faces of a cube do.
    const uint32_t maxTexels =
        std::clamp(std::bit_floor(4 * options.maxFaceTexels), 64u, kMaxFaceTexels);
    for (size_t r = 0; r < records.size(); ++r) {
        if (!isSun(records[r]))
            continue;
        const SunMap map = fitSunWindow(frames[r], rects[r], records[r].heldTexels, maxTexels);
        records[r].window = map.window;
        records[r].quantities.faceTexels = map.faceTexels;
        records[r].quantities.texels = float(map.widthTexels);
    }
}

} // namespace shadowdag
