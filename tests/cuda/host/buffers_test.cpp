// SPDX-License-Identifier: Apache-2.0
// Buffers, read-backs and sorts on the device that the host plays: what they leave behind, and what
// they do when a call of the runtime fails.
#include "cuda/buffer.h"
#include "cuda/device.h"
#include "cuda/readback.h"
#include "cuda/scan_sort.h"
#include "tests/cuda/host/faults.h"
#include "tests/cuda/probe_pass.h"

#include <cuda_runtime.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <vector>

namespace shadowdag::cuda_host {
namespace {

/// Uploads of both ways, passes, scans, sorts, copies back of both ways, and marks. Throws what
/// they throw; checks what they give.
void useEverything() {
    constexpr size_t kCount = 600'000; // uploads that are too large to be staged
    Buffer<uint32_t> words(Backend::kCuda, "test/words"), sums(Backend::kCuda, "test/sums", kCount);
    std::vector<uint32_t> host(kCount);
    std::iota(host.rbegin(), host.rend(), 0u);
    words.upload(host);
    words.upload({host.begin(), host.begin() + 500});
    words.upload(host);
    EXPECT_EQ(exclusiveScan(Backend::kCuda, std::as_const(words).view(), sums.view()),
              uint64_t(kCount) * (kCount - 1) / 2);
    sortPairs(Backend::kCuda, words.view(), sums.view());
    Readback readback(Backend::kCuda, 10);
    readback.request({words.view().data, 10});
    Buffer<float> values(Backend::kCuda, "test/values", 1000),
        out(Backend::kCuda, "test/out", 1000);
    values.fill(0);
    probe(Backend::kCuda, values.view(), values.view(), out.view());
    EXPECT_EQ(out.download(), std::vector<float>(1000, 0.0f));
    EXPECT_EQ(readback.wait()[9], 9u);
    std::sort(host.begin(), host.end());
    EXPECT_EQ(words.download(), host);
    device::synchronize();
}

TEST(CudaHostBuffers, ReleaseAllMemoryThatTheyTook) {
    useEverything(); // what is kept between calls is there now
    const LiveCounts before = liveCounts();
    const uint64_t availableBefore = availableBytes(Backend::kCuda);
    useEverything();
    EXPECT_EQ(liveCounts().device, before.device);
    EXPECT_EQ(liveCounts().pinned, before.pinned);
    EXPECT_EQ(availableBytes(Backend::kCuda), availableBefore);
}

/// Makes the n-th call fail, for n = 1, 2, ... until none is left; returns how many there were.
uint64_t failEach(const std::string& function, cudaError_t error, ErrorKind expected) {
    useEverything();
    const LiveCounts before = liveCounts();
    for (uint64_t n = 1;; ++n) {
        const FailCall fail(function, n, error);
        try {
            useEverything();
            if (!fail.wasReached())
                return n - 1;
            ADD_FAILURE() << function << " failed as call " << n << ", and nobody was told";
        } catch (const Error& thrown) {
            EXPECT_EQ(thrown.kind(), expected) << n << ": " << thrown.what();
        }
        device::synchronize();
        // Memory that is kept between calls may have been lost to the failure, and no other left.
        EXPECT_LE(liveCounts().device, before.device) << function << " failed as call " << n;
        EXPECT_LE(liveCounts().pinned, before.pinned) << function << " failed as call " << n;
    }
}

TEST(CudaHostBuffers, AllocationsThatFailAreResourceErrorsAndLeaveNothing) {
    EXPECT_GE(failEach("cudaMallocAsync", cudaErrorMemoryAllocation, ErrorKind::kResource), 4u);
    EXPECT_GE(failEach("cudaHostAlloc", cudaErrorMemoryAllocation, ErrorKind::kResource), 1u);
}

TEST(CudaHostBuffers, EveryOtherCallThatFailsIsADeviceErrorAndLeavesNothing) {
    for (const auto& [function, least] :
         std::vector<std::pair<const char*, uint64_t>>{{"cudaMallocAsync", 4},
                                                       {"cudaMemcpy", 2},
                                                       {"cudaMemcpyAsync", 5},
                                                       {"cudaMemsetAsync", 1},
                                                       {"cudaLaunchKernelEx", 1},
                                                       {"cudaStreamSynchronize", 3},
                                                       {"cudaEventRecord", 2},
                                                       {"cudaDeviceSynchronize", 1}})
        EXPECT_GE(failEach(function, cudaErrorLaunchFailure, ErrorKind::kDevice), least)
            << function;
}

// Threads of a kernel need memory for what they spill; the error is not left for the next call.
TEST(CudaHostBuffers, ALaunchWithoutMemoryIsAResourceErrorThatIsToldOnce) {
    EXPECT_GE(failEach("cudaLaunchKernelEx", cudaErrorMemoryAllocation, ErrorKind::kResource), 1u);
    EXPECT_EQ(cudaGetLastError(), cudaSuccess);
}

TEST(CudaHostBuffers, AnEventThatIsNotMadeIsADeviceErrorAfterAllKeptOnesAreTaken) {
    void* const first = device::recordMark();
    device::releaseMark(first);
    std::vector<void*> marks{device::recordMark()};
    EXPECT_EQ(marks[0], first);
    {
        const FailCall fail("cudaEventCreate", 1, cudaErrorLaunchFailure);
        try {
            while (marks.size() < 1000)
                marks.push_back(device::recordMark());
            ADD_FAILURE() << "nobody was told";
        } catch (const Error& thrown) {
            EXPECT_EQ(thrown.kind(), ErrorKind::kDevice) << thrown.what();
        }
    }
    marks.push_back(device::recordMark());
    for (void* const mark : marks)
        device::releaseMark(mark);
    device::synchronize();
}

TEST(CudaHostBuffers, AnAbsentDeviceIsNamedByTheDriver) {
    std::string why;
    {
        const FailCall fail("cudaGetDeviceCount", 1, cudaErrorInsufficientDriver);
        EXPECT_FALSE(device::isPresent(why));
        EXPECT_THAT(why, testing::HasSubstr("driver version is insufficient"));
    }
    {
        const FailCall fail("cudaGetDeviceCount", 1, cudaErrorNoDevice);
        EXPECT_FALSE(device::isPresent(why));
        EXPECT_THAT(why, testing::HasSubstr("found no device"));
    }
    {
        const FailCall fail("cudaFuncGetAttributes", 1, cudaErrorNoKernelImageForDevice);
        EXPECT_FALSE(device::isPresent(why));
        EXPECT_THAT(why, testing::HasSubstr("sm_75, runs no kernel of this build"));
        EXPECT_THAT(why, testing::HasSubstr("CMAKE_CUDA_ARCHITECTURES=75"));
    }
    EXPECT_EQ(cudaGetLastError(), cudaSuccess);
    EXPECT_TRUE(device::isPresent(why));
    EXPECT_EQ(deviceName(Backend::kCuda), "CUDA played by the host");
    EXPECT_EQ(driverVersion(Backend::kCuda), "13.0");
}

} // namespace
} // namespace shadowdag::cuda_host
