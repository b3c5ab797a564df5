// SPDX-License-Identifier: Apache-2.0
// Fills several arrays at once: on CUDA one launch, instead of one each.
#pragma once

#include "cuda/buffer.h"
#include "cuda/pass.h"

#include <initializer_list>

namespace shadowdag {

/// Words whose bytes are all set to one value.
struct FilledWords {
    View<uint32_t> words;
    int byteValue = 0;

    /// All elements of a buffer.
    template <class T> FilledWords(Buffer<T>& buffer, int byte = 0) : byteValue(byte) {
        static_assert(sizeof(T) % sizeof(uint32_t) == 0);
        words = {reinterpret_cast<uint32_t*>(buffer.view().data),
                 buffer.bytes() / sizeof(uint32_t)};
    }
};

/// Sets word i of the concatenated arrays.
struct FillArrays {
    static constexpr uint32_t kMostArrays = 8;
    View<uint32_t> arrays[kMostArrays];
    uint32_t values[kMostArrays];
    size_t wordCount = 0;

    size_t itemCount() const { return wordCount; }
    size_t grain() const { return 16384; }
    SDAG_HD void operator()(size_t i) const {
        for (uint32_t array = 0; array < kMostArrays; ++array) {
            if (i < arrays[array].count) {
                arrays[array][i] = values[array];
                return;
            }
            i -= arrays[array].count;
        }
    }
};

/// Sets every byte of each array to its value. @param all at most FillArrays::kMostArrays, on the
/// backend; may be empty
inline void fillAll(Backend backend, std::initializer_list<FilledWords> all) {
    SDAG_ASSERT(all.size() <= FillArrays::kMostArrays);
    FillArrays work{};
    uint32_t count = 0;
    for (const FilledWords& one : all) {
        if (backend != Backend::kCuda) {
            detail::fillBytes(backend, one.words.data, one.byteValue,
                              one.words.count * sizeof(uint32_t));
            continue;
        }
        work.arrays[count] = one.words;
        work.values[count++] = 0x01010101u * uint32_t(uint8_t(one.byteValue));
        work.wordCount += one.words.count;
    }
    if (backend == Backend::kCuda)
        runPass(backend, work);
}

} // namespace shadowdag
