// SPDX-License-Identifier: Apache-2.0
// What dag_stream.cpp hands to the files that are compiled for one kind of processor each. Plain
// pointers: such a file must not instantiate inline functions of other headers, because the linker
// keeps one copy of each for the whole program, which may be one that needs a newer processor.
#pragma once

#include <cstddef>
#include <cstdint>

namespace shadowdag::stream {

/// As WideCell.
struct Start {
    uint32_t address, level;
    float corner[3];
};

/// One call of traceStream. starts: where rays enter the wide form.
struct Work {
    const uint32_t* words;
    const Start* starts;
    size_t startCount;
    float resolution;
    const float* segments; ///< from x, y, z, to x, y, z
    size_t count;
    uint8_t* blocked;
};

void tracePortable(const Work& work);
void traceAvx2(const Work& work);   ///< only where hasStreamIsa(StreamIsa::kAvx2)
void traceAvx512(const Work& work); ///< only where hasStreamIsa(StreamIsa::kAvx512)

} // namespace shadowdag::stream
