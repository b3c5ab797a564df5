// SPDX-License-Identifier: Apache-2.0
// The pages of the face that a thread draws into.
#pragma once

#include "shadowmap/page_floors.h"
#include "shadowmap/rasterize.h"

#include <bit>
#include <vector>

namespace shadowdag {

/// The pages of a face that is drawn into. Rows of v, u fastest.
class FacePages {
public:
    /// @param floors of the view's pages; those of this face are read and written by one thread
    FacePages(const RasterView& view, PageFloors& floors) : view(view), floors(floors) {}

    /// Chooses a face; `map` is kept by reference.
    void set(const ShadowMapInfo& ofMap, uint32_t ofFace) {
        map = &ofMap;
        face = ofFace;
        across = int32_t(ofMap.facePages);
        table = &view.pageTable[pageTableIndex(ofMap, ofFace, 0, 0)];
        words_ = (across + 63) / 64;
        present_.assign(size_t(words_) * size_t(across), 0);
        for (int32_t y = 0; y < across; ++y)
            for (int32_t x = 0; x < across; ++x)
                present_[size_t(y * words_ + x / 64)] |= uint64_t(table[y * across + x] != kNoPage)
                                                         << x % 64;
    }

    /// Calls test(x, page) for the pages [xFirst, xLast] of row y that have memory, as long as it
    /// holds. Returns whether it held for all.
    template <class Test>
    bool forPresentWhile(int32_t y, int32_t xFirst, int32_t xLast, const Test& test) const {
        for (int32_t word = xFirst / 64; word <= xLast / 64; ++word) {
            uint64_t bits = present_[size_t(y * words_ + word)];
            if (word == xFirst / 64)
                bits &= ~uint64_t(0) << xFirst % 64;
            if (word == xLast / 64)
                bits &= ~uint64_t(0) >> (63 - xLast % 64);
            for (; bits; bits &= bits - 1) {
                const int32_t x = word * 64 + std::countr_zero(bits);
                if (!test(x, table[y * across + x]))
                    return false;
            }
        }
        return true;
    }

    const RasterView& view;
    PageFloors& floors;
    const ShadowMapInfo* map = nullptr;
    uint32_t face = 0;
    int32_t across = 0;              ///< side of the face in pages
    const uint32_t* table = nullptr; ///< of the face

private:
    int32_t words_ = 0; ///< of a row
    std::vector<uint64_t> present_;
};

} // namespace shadowdag
