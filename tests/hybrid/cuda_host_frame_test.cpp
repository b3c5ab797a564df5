// SPDX-License-Identifier: Apache-2.0
// Frames on the device that the host plays while calls of the runtime fail: an error of the right
// kind, no memory left behind, and the next frame is right.
#include "hybrid/frame.h"

#include "tests/cuda/host/faults.h"
#include "tests/hybrid/blocker_stage.h"

#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <functional>

namespace shadowdag::test {
namespace {

using cuda_host::FailCall;
using cuda_host::liveCounts;

class CudaHostFrame : public testing::Test {
protected:
    /// Returns a frame. @param inFrame called when it is finished, before its renderer is destroyed
    FrameResult frame(
        Backend backend, const std::function<void()>& inFrame = [] {}) const {
        FrameOptions options = smallFrame();
        options.width = 64;
        options.height = 40;
        options.maxFaceTexels = 128;
        options.maps.poolBytes = 4ull << 20;
        FrameRenderer renderer(backend, world, dag);
        FrameResult result = renderer.render(roomCamera(), *makeCostModel("texels:48"), options);
        inFrame();
        return result;
    }
    /// Makes the n-th call fail for n = 1, 1 + stride, ...; returns how often one failed.
    uint64_t failSome(const std::string& function, cudaError_t error, uint64_t stride,
                      ErrorKind expected) const {
        const FrameResult wanted = frame(Backend::kCpu);
        frame(Backend::kCuda); // what is kept between frames is there now
        const cuda_host::LiveCounts before = liveCounts();
        uint64_t count = 0;
        for (uint64_t n = 1;; n += stride, ++count) {
            const FailCall fail(function, n, error);
            try {
                // A wait in the renderer's destructor cannot report its error.
                const FrameResult found = frame(Backend::kCuda, [&] {
                    EXPECT_FALSE(fail.wasReached())
                        << fail.reached() << " failed as call " << n << ", and nobody was told";
                });
                EXPECT_EQ(found.visibility, wanted.visibility);
                if (!fail.wasReached())
                    return count;
            } catch (const Error& thrown) {
                EXPECT_EQ(thrown.kind(), expected) << n << ": " << thrown.what();
            }
            EXPECT_LE(liveCounts().device, before.device) << function << ", call " << n;
            EXPECT_LE(liveCounts().pinned, before.pinned) << function << ", call " << n;
        }
    }

    const Scene scene = blockerScene(kManyLights, true);
    const World world{scene, {}};
    const Dag dag = dagOf(world, 6);
};

TEST_F(CudaHostFrame, AllocationsThatFailAreResourceErrorsAndLeaveNothing) {
    EXPECT_GE(failSome("cudaMallocAsync", cudaErrorMemoryAllocation, 1, ErrorKind::kResource), 40u);
    EXPECT_GE(failSome("cudaHostAlloc", cudaErrorMemoryAllocation, 1, ErrorKind::kResource), 1u);
}

TEST_F(CudaHostFrame, EveryNthCallThatFailsIsADeviceErrorAndLeavesNothing) {
    EXPECT_GE(failSome("", cudaErrorLaunchFailure, 13, ErrorKind::kDevice), 30u);
}

} // namespace
} // namespace shadowdag::test
