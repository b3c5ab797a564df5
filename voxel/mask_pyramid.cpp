// SPDX-License-Identifier: Apache-2.0
#include "voxel/mask_pyramid.h"

#include "cuda/error.h"

#include <algorithm>
#include <string>

namespace shadowdag {

MaskPyramids::MaskPyramids(View<const MaskInfo> ofMasks, View<const uint32_t> ofWords) {
    const auto bitOf = [&](uint32_t first, uint32_t width, uint32_t x, uint32_t y) {
        return (words[first + size_t(y) * maskRowWords(width) + x / 32] >> (x & 31u) & 1u) != 0;
    };
    for (const MaskInfo& info : ofMasks) {
        const size_t count = size_t(maskRowWords(info.width)) * info.height;
        SDAG_ASSERT(info.firstWord + count <= ofWords.count);
        // The pyramid above the texels takes less memory than they do if rows are longer than a
        // word.
        if (words.size() + 4 * count + 64 * size_t(info.height) > 0xffffffffull)
            throw Error(ErrorKind::kResource,
                        "alpha masks of " + std::to_string(ofWords.count) +
                            " words are too large to voxelize; use smaller textures");
        const uint32_t firstLevel = uint32_t(levels.size());
        levels.push_back({info.width, info.height, uint32_t(words.size()), uint32_t(words.size())});
        words.insert(words.end(), ofWords.data + info.firstWord,
                     ofWords.data + info.firstWord + count);
        while (levels.back().width > 1 || levels.back().height > 1) {
            const MaskLevel below = levels.back();
            MaskLevel level{(below.width + 1) / 2, (below.height + 1) / 2, uint32_t(words.size()),
                            0};
            const uint32_t rowWords = maskRowWords(level.width);
            level.firstAll = level.firstAny + rowWords * level.height;
            words.resize(words.size() + 2 * size_t(rowWords) * level.height, 0u);
            for (uint32_t y = 0; y < level.height; ++y)
                for (uint32_t x = 0; x < level.width; ++x) {
                    bool any = false, all = true;
                    for (uint32_t cy = 2 * y; cy < std::min(2 * y + 2, below.height); ++cy)
                        for (uint32_t cx = 2 * x; cx < std::min(2 * x + 2, below.width); ++cx) {
                            any |= bitOf(below.firstAny, below.width, cx, cy);
                            all &= bitOf(below.firstAll, below.width, cx, cy);
                        }
                    const size_t word = size_t(y) * rowWords + x / 32;
                    words[level.firstAny + word] |= uint32_t(any) << (x & 31u);
                    words[level.firstAll + word] |= uint32_t(all) << (x & 31u);
                }
            levels.push_back(level);
        }
        masks.push_back({info.width, info.height, info.wrapU, info.wrapV, firstLevel,
                         uint32_t(levels.size()) - firstLevel});
    }
}

} // namespace shadowdag
