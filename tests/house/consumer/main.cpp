// SPDX-License-Identifier: Apache-2.0
// Calls into the installed libraries: a scan, a missing asset, and the frame's symbols.
#include "cuda/buffer.h"
#include "cuda/scan_sort.h"
#if defined(HAS_sdag_hybrid)
#include "hybrid/frame.h"
#endif
#if defined(HAS_sdag_voxel)
#include "voxel/asset.h"
#endif

#include <cstdio>

int main() {
    using namespace shadowdag;
    Buffer<uint32_t> counts(Backend::kCpu, "consumer/counts");
    counts.upload({3, 1, 4, 1, 5});
    const uint64_t total = exclusiveScan(Backend::kCpu, counts.view(), counts.view());
    std::printf("total %d on %d threads\n", int(total), threadCount());
#if defined(HAS_sdag_voxel)
    try {
        readAsset("there is no such file.svdag");
        return 2;
    } catch (const Error& error) {
        std::printf("as expected: %s\n", error.what());
    }
#endif
#if defined(HAS_sdag_hybrid)
    // Linking is the test: through a volatile, so that the linker must find the whole frame.
    FrameResult (FrameRenderer::*volatile render)(
        const Camera&, const CostModel&, const FrameOptions&, const std::function<void()>&) =
        &FrameRenderer::render;
    if (!render)
        return 3;
#endif
    return total == 14 && counts.at(4) == 9 ? 0 : 1;
}
