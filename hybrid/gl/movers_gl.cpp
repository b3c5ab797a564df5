// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gl/movers_gl.h"

#include <bit>

namespace shadowdag {

namespace {

enum Head : uint32_t { kLevelCount, kBoxes, kItems, kNearLight, kMaskWords, kLevelStart };

} // namespace

std::vector<uint32_t> packMovers(const MoverView& movers) {
    if (movers.isNearLight.empty())
        return {};
    const WideBvhView& bvh = movers.bvh;
    const AlphaMaskView& masks = movers.geometry.masks();
    std::vector<uint32_t> words(kLevelStart + kBvhMaxLevels + 1, 0);
    words[kLevelCount] = bvh.levelCount;
    for (uint32_t level = 0; level <= bvh.levelCount; ++level)
        words[kLevelStart + level] = bvh.levelStart[level];
    words[kBoxes] = uint32_t(words.size());
    for (const Box& box : bvh.boxes)
        for (const glm::vec3& corner : {box.min, box.max})
            for (int axis = 0; axis < 3; ++axis)
                words.push_back(std::bit_cast<uint32_t>(corner[axis]));
    words[kItems] = uint32_t(words.size());
    words.resize(words.size() + 2 * bvh.items.count);
    words[kNearLight] = uint32_t(words.size());
    words.insert(words.end(), movers.isNearLight.begin(), movers.isNearLight.end());

    std::vector<size_t> cutAt; // words of triangles whose second one names a cut, yet to be placed
    for (size_t i = 0; i < bvh.items.count; ++i) {
        const Batch& batch = movers.batches[bvh.items[i]];
        words[words[kItems] + 2 * i] = uint32_t(words.size());
        words[words[kItems] + 2 * i + 1] = batch.count;
        for (uint32_t t = batch.first; t < batch.first + batch.count; ++t) {
            const uint32_t triangle = movers.batchTriangles[t];
            words.push_back(triangle);
            if (masks.isCut(triangle))
                cutAt.push_back(words.size());
            words.push_back(kNotCut);
        }
    }
    for (const size_t at : cutAt) {
        const CutTriangle& cut = masks.cuts[masks.triangleCut[words[at - 1]]];
        const MaskInfo& info = masks.masks[cut.mask];
        words[at] = uint32_t(words.size());
        words.insert(words.end(), {info.firstWord, info.width, info.height, uint32_t(info.wrapU),
                                   uint32_t(info.wrapV)});
        for (const glm::vec2& uv : cut.uv)
            words.insert(words.end(),
                         {std::bit_cast<uint32_t>(uv.x), std::bit_cast<uint32_t>(uv.y)});
    }
    words[kMaskWords] = uint32_t(words.size());
    if (!cutAt.empty())
        words.insert(words.end(), masks.words.begin(), masks.words.end());
    return words;
}

GlDefines moverDefines(uint32_t positionsBinding, uint32_t trianglesBinding,
                       uint32_t moversBinding) {
    GlDefines defines{{"SDAG_POSITIONS_BINDING", std::to_string(positionsBinding)},
                      {"SDAG_TRIANGLES_BINDING", std::to_string(trianglesBinding)},
                      {"SDAG_MOVERS_BINDING", std::to_string(moversBinding)}};
    for (const auto& [name, value] :
         {std::pair<const char*, uint32_t>{"SDAG_HEAD_LEVEL_COUNT", kLevelCount},
          {"SDAG_HEAD_BOXES", kBoxes},
          {"SDAG_HEAD_ITEMS", kItems},
          {"SDAG_HEAD_NEAR_LIGHT", kNearLight},
          {"SDAG_HEAD_MASK_WORDS", kMaskWords},
          {"SDAG_HEAD_LEVEL_START", kLevelStart},
          {"SDAG_BVH_WIDTH", kBvhWidth},
          {"SDAG_BVH_LEVELS", kBvhMaxLevels}})
        defines.emplace_back(name, std::to_string(value) + "u");
    return defines;
}

} // namespace shadowdag
