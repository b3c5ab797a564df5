// SPDX-License-Identifier: Apache-2.0
#include "scenes/alpha_mask.h"

#include "scenes/content_hash.h"

namespace shadowdag {

AlphaMask makeAlphaMask(uint32_t width, uint32_t height, MaskWrap wrapU, MaskWrap wrapV) {
    SDAG_ASSERT(width >= 1 && height >= 1);
    return {width, height, wrapU, wrapV,
            std::vector<uint32_t>(size_t(maskRowWords(width)) * height, 0u)};
}

void setOpaque(AlphaMask& mask, uint32_t x, uint32_t y) {
    SDAG_ASSERT(x < mask.width && y < mask.height);
    mask.words[size_t(y) * maskRowWords(mask.width) + x / 32] |= 1u << (x & 31u);
}

bool AlphaMask::isOpaque(uint32_t x, uint32_t y) const {
    SDAG_ASSERT(x < width && y < height);
    return (words[size_t(y) * maskRowWords(width) + x / 32] >> (x & 31u) & 1u) != 0;
}

bool AlphaMask::isAllOpaque() const {
    const uint32_t rowWords = maskRowWords(width);
    const uint32_t lastWord = width % 32 ? (1u << width % 32) - 1u : ~0u;
    for (size_t i = 0; i < words.size(); ++i)
        if (words[i] != (i % rowWords == rowWords - 1 ? lastWord : ~0u))
            return false;
    return true;
}

AlphaMaskSet::AlphaMaskSet(const AlphaMaskView& view)
    : triangleCut(view.triangleCut.begin(), view.triangleCut.end()),
      cuts(view.cuts.begin(), view.cuts.end()), masks(view.masks.begin(), view.masks.end()),
      words(view.words.begin(), view.words.end()) {}

uint32_t AlphaMaskSet::add(const AlphaMask& mask) {
    SDAG_ASSERT(mask.words.size() == size_t(maskRowWords(mask.width)) * mask.height);
    SDAG_ASSERT(words.size() + mask.words.size() <= 0xffffffffu);
    masks.push_back({uint32_t(words.size()), mask.width, mask.height, mask.wrapU, mask.wrapV});
    words.insert(words.end(), mask.words.begin(), mask.words.end());
    return uint32_t(masks.size() - 1);
}

std::array<uint8_t, 16> AlphaMaskSet::contentHash(uint32_t mask) const {
    const MaskInfo& info = masks[mask];
    const uint32_t head[4] = {info.width, info.height, uint32_t(info.wrapU), uint32_t(info.wrapV)};
    ContentHasher hasher;
    hasher.add(head, sizeof head);
    hasher.add(&words[info.firstWord],
               size_t(maskRowWords(info.width)) * info.height * sizeof(uint32_t));
    return hasher.hash();
}

} // namespace shadowdag
