// SPDX-License-Identifier: Apache-2.0
// What the host asks for happens in the order in which it asked: a device does it later, while the
// host already changes, releases and reuses what it gave.
#include "cuda/buffer.h"
#include "cuda/device.h"
#include "tests/cuda/backends.h"
#include "tests/cuda/probe_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace shadowdag {
namespace {

class QueueOrderOn : public OnBackend {
protected:
    /// Runs a pass that gives `value` for arrays of it and of zeros.
    void probeValues(const Buffer<float>& values, Buffer<float>& out) {
        zeros_.resize(values.size());
        zeros_.fill(0);
        out.resize(values.size());
        probe(GetParam(), values.view(), std::as_const(zeros_).view(), out.view());
    }

    Buffer<float> zeros_{GetParam(), "test/zeros"};
};

// Small uploads pass through memory that is used again, in one part or in several, large ones do not.
constexpr size_t kSmall = 1000, kStaged = 200'000, kLarge = 600'000;

TEST_P(QueueOrderOn, UploadsTakeTheContentsAtTheTimeOfTheCall) {
    constexpr uint32_t kUploadCount = 64;
    for (const size_t count : {kSmall, kStaged, kLarge}) {
        std::vector<Buffer<uint32_t>> buffers;
        std::vector<uint32_t> host(count);
        for (uint32_t i = 0; i < kUploadCount; ++i) {
            std::fill(host.begin(), host.end(), i);
            buffers.emplace_back(GetParam(), "test/upload");
            buffers.back().upload(host);
        }
        std::fill(host.begin(), host.end(), ~0u);
        for (uint32_t i = 0; i < kUploadCount; ++i)
            ASSERT_EQ(buffers[i].download(), std::vector<uint32_t>(count, i)) << count;
    }
}

TEST_P(QueueOrderOn, PassesReadWhatWasThereWhenTheyWereQueued) {
    for (const size_t count : {kSmall, kStaged, kLarge}) {
        Buffer<float> values(GetParam(), "test/values"), first(GetParam(), "test/first"),
            second(GetParam(), "test/second"), third(GetParam(), "test/third");
        values.upload(std::vector<float>(count, 1.0f));
        probeValues(values, first);
        values.upload(std::vector<float>(count, 2.0f));
        probeValues(values, second);
        values.fill(0);
        probeValues(values, third);
        EXPECT_EQ(first.download(), std::vector<float>(count, 1.0f));
        EXPECT_EQ(second.download(), std::vector<float>(count, 2.0f));
        EXPECT_EQ(third.download(), std::vector<float>(count, 0.0f));
    }
}

TEST_P(QueueOrderOn, ReleasedMemoryServesTheWorkQueuedBefore) {
    Buffer<float> out(GetParam(), "test/out");
    {
        Buffer<float> values(GetParam(), "test/values");
        values.upload(std::vector<float>(kSmall, 3.0f));
        probeValues(values, out);
    }
    Buffer<float> other(GetParam(), "test/other", kSmall); // perhaps in the same place
    other.fill(0xff);
    EXPECT_EQ(out.download(), std::vector<float>(kSmall, 3.0f));
}

TEST_P(QueueOrderOn, CopiesOnABackendAreCompleteAndInOrder) {
    Buffer<uint32_t> from(GetParam(), "test/from"), to(GetParam(), "test/to", 7);
    from.upload({1, 2, 3, 4, 5, 6, 7});
    detail::copyBytes(GetParam(), to.view().data, GetParam(), from.view().data, from.bytes());
    from.fill(0);
    EXPECT_EQ(to.download(), (std::vector<uint32_t>{1, 2, 3, 4, 5, 6, 7}));
    EXPECT_EQ(from.download(), std::vector<uint32_t>(7, 0));
}

// Around the sizes of warps and blocks.
TEST_P(QueueOrderOn, PassesReachEveryItemAndNoneBeyond) {
    for (const size_t count : {0, 1, 31, 32, 33, 127, 128, 129, 1000, 4097}) {
        Buffer<float> values(GetParam(), "test/values"), zeros(GetParam(), "test/zeros"),
            out(GetParam(), "test/out", count + 1);
        values.upload(std::vector<float>(count, 5.0f));
        zeros.upload(std::vector<float>(count, 0.0f));
        out.fill(0);
        probe(GetParam(), values.view(), zeros.view(), {out.view().data, count});
        std::vector<float> expected(count + 1, 5.0f);
        expected[count] = 0.0f;
        EXPECT_EQ(out.download(), expected) << count;
    }
}

INSTANTIATE_TEST_SUITE_P(Both, QueueOrderOn, kBothBackends, backendSuffix);

/// Words of pinned memory, 0 before; skips without a device.
class CudaQueue : public OnBackend {
protected:
    void SetUp() override {
        OnBackend::SetUp();
        if (IsSkipped())
            return;
        pinned = static_cast<uint32_t*>(device::allocatePinned(kSmall * sizeof(uint32_t)));
        ASSERT_NE(pinned, nullptr);
        std::fill_n(pinned, kSmall, 0u);
        words.upload(std::vector<uint32_t>(kSmall, 6));
        device::downloadLater(pinned, words.view().data, words.bytes());
    }
    void TearDown() override { device::releasePinned(pinned); }
    std::vector<uint32_t> found() const { return {pinned, pinned + kSmall}; }

    Buffer<uint32_t> words{Backend::kCuda, "test/words"};
    uint32_t* pinned = nullptr;
};

TEST_P(CudaQueue, SynchronizeWaitsForAllThatWasQueued) {
    device::synchronize();
    EXPECT_EQ(found(), std::vector<uint32_t>(kSmall, 6));
}

TEST_P(CudaQueue, MarksPassAfterTheWorkInFrontOfThem) {
    void* const mark = device::recordMark();
    words.fill(0); // behind it
    device::waitForMark(mark);
    EXPECT_EQ(found(), std::vector<uint32_t>(kSmall, 6));
    device::releaseMark(mark);
}

INSTANTIATE_TEST_SUITE_P(Device, CudaQueue, testing::Values(Backend::kCuda), backendSuffix);

} // namespace
} // namespace shadowdag
