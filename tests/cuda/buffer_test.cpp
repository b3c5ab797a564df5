// SPDX-License-Identifier: Apache-2.0
#include "cuda/buffer.h"

#include "cuda/fill_pass.h"
#include "tests/cuda/backends.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace shadowdag {
namespace {

using testing::HasSubstr;

// Returns the ledger's line, or zeros.
LedgerEntry entryOf(const std::string& name, Backend backend) {
    for (const LedgerEntry& entry : bufferLedger())
        if (entry.name == name && entry.backend == backend)
            return entry;
    return {name, backend, 0, 0, 0};
}

class BufferOn : public OnBackend {};

TEST_P(BufferOn, UploadThenDownloadReturnsTheSameElements) {
    std::vector<uint64_t> host(1000);
    std::iota(host.begin(), host.end(), 17);
    Buffer<uint64_t> buffer(GetParam(), "test/roundtrip");
    buffer.upload(host);
    EXPECT_EQ(buffer.size(), host.size());
    EXPECT_EQ(buffer.bytes(), 8 * host.size());
    EXPECT_EQ(buffer.download(), host);
    EXPECT_EQ(buffer.at(999), 1016u);
}

TEST_P(BufferOn, FillSetsEveryByte) {
    Buffer<uint32_t> buffer(GetParam(), "test/fill", 77);
    buffer.fill(0xff);
    EXPECT_EQ(buffer.download(), std::vector<uint32_t>(77, ~0u));
}

TEST_P(BufferOn, GrowKeepingKeepsElementsAndUsesTheMemoryThatIsThere) {
    const std::string name = "test/grow keeping";
    const auto allocations = [&] { return entryOf(name, GetParam()).allocationCount; };
    const std::vector<uint32_t> kept = {3, 1, 4};
    Buffer<uint32_t> buffer(GetParam(), name);
    buffer.growKeeping(0);
    EXPECT_EQ(buffer.capacity(), 0u);
    buffer.upload(kept);
    const uint64_t before = allocations();
    buffer.growKeeping(1000);
    EXPECT_EQ(allocations(), before + 1);
    EXPECT_EQ(entryOf(name, GetParam()).bytes, 4000u); // exactly, and the old array is gone
    ASSERT_EQ(buffer.size(), 1000u);
    for (size_t i = 0; i < kept.size(); ++i)
        EXPECT_EQ(buffer.at(i), kept[i]);
    buffer.growKeeping(2); // never shrinks
    EXPECT_EQ(buffer.size(), 1000u);
    buffer.resize(2);
    buffer.growKeeping(1000);
    EXPECT_EQ(buffer.at(1), 1u);
    EXPECT_EQ(allocations(), before + 1);
    buffer.resize(0);
    buffer.growKeeping(2000); // nothing to keep: never both arrays at once
    EXPECT_EQ(entryOf(name, GetParam()).peakBytes, 8000u);
    EXPECT_EQ(entryOf(name, GetParam()).bytes, 8000u);
    buffer.growKeeping(2001, 3000);
    EXPECT_EQ(buffer.size(), 2001u);
    EXPECT_EQ(buffer.capacity(), 3000u);
    buffer.fill(1);
    EXPECT_THROW(buffer.growKeeping(size_t(1) << 50), Error);
    EXPECT_EQ(buffer.size(), 2001u);
    EXPECT_EQ(buffer.at(2000), 0x01010101u);
}

TEST_P(BufferOn, FillFromSetsEveryByteBehind) {
    Buffer<uint32_t> buffer(GetParam(), "test/fill from");
    buffer.upload(std::vector<uint32_t>(5, 7));
    buffer.fillFrom(3, 0);
    EXPECT_EQ(buffer.download(), (std::vector<uint32_t>{7, 7, 7, 0, 0}));
    buffer.fillFrom(5, 1);
    EXPECT_EQ(buffer.at(4), 0u);
}

TEST_P(BufferOn, FillAllSetsEveryByteOfEveryArray) {
    Buffer<uint32_t> zeros(GetParam(), "test/zeros"), none(GetParam(), "test/none", 0),
        ones(GetParam(), "test/ones", 70'000);
    Buffer<uint64_t> wide(GetParam(), "test/wide", 5);
    zeros.upload(std::vector<uint32_t>(40, 7));
    zeros.resize(33);
    fillAll(GetParam(), {zeros, none, {ones, 0xff}, {wide, 0x12}});
    EXPECT_EQ(zeros.download(), std::vector<uint32_t>(33, 0));
    zeros.resize(40); // what lies behind an array is not filled
    for (size_t i = 33; i < 40; ++i)
        EXPECT_EQ(zeros.at(i), 7u);
    EXPECT_EQ(ones.download(), std::vector<uint32_t>(70'000, ~0u));
    EXPECT_EQ(wide.download(), std::vector<uint64_t>(5, 0x1212121212121212u));
    fillAll(GetParam(), {none});
    fillAll(GetParam(), {});
}

TEST_P(BufferOn, EmptyIsAllowedEverywhere) {
    Buffer<uint32_t> buffer(GetParam(), "test/empty", 0);
    buffer.fill(1);
    buffer.upload({});
    EXPECT_TRUE(buffer.download().empty());
    EXPECT_TRUE(buffer.view().empty());
    EXPECT_EQ(buffer.view().data, nullptr);
}

TEST_P(BufferOn, LedgerRecordsHeldBytesAndThePeak) {
    const std::string name = "test/ledger";
    {
        Buffer<uint32_t> a(GetParam(), name, 100);
        {
            Buffer<uint32_t> b(GetParam(), name, 50);
            EXPECT_EQ(entryOf(name, GetParam()).bytes, 600u);
        }
        EXPECT_EQ(entryOf(name, GetParam()).bytes, 400u);
        Buffer<uint32_t> c(GetParam(), name, 1); // less than the peak
        EXPECT_EQ(entryOf(name, GetParam()).peakBytes, 600u);
        Buffer<uint32_t> moved = std::move(a);
        EXPECT_EQ(a.size(), 0u); // NOLINT: a moved-from buffer is empty, and may be used again
        EXPECT_EQ(entryOf(name, GetParam()).bytes, 404u);
    }
    EXPECT_EQ(entryOf(name, GetParam()).bytes, 0u);
    EXPECT_EQ(entryOf(name, GetParam()).peakBytes, 600u);
}

TEST_P(BufferOn, ResizeWithinCapacityAllocatesNothing) {
    Buffer<uint32_t> buffer(GetParam(), "test/capacity", 1000);
    const uint32_t* data = buffer.view().data;
    buffer.resize(10);
    buffer.resize(1000);
    EXPECT_EQ(buffer.view().data, data);
    buffer.resize(1001);
    EXPECT_EQ(entryOf("test/capacity", GetParam()).bytes, 6000u); // half as much again
}

TEST_P(BufferOn, TooLargeIsAResourceErrorThatNamesTheBuffer) {
    Buffer<uint64_t> buffer(GetParam(), "test/too large");
    for (const size_t count :
         {size_t(1) << 50, size_t(1) << 60, (size_t(1) << 61) + 1, ~size_t(0)}) {
        try {
            buffer.resize(count);
            FAIL() << "no error for " << count;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_THAT(error.what(), HasSubstr("'test/too large'"));
            EXPECT_THAT(error.what(), HasSubstr(std::to_string(count) + " x 8 bytes"));
        }
        EXPECT_EQ(buffer.size(), 0u);
    }
    buffer.resize(3); // still usable
    EXPECT_EQ(buffer.size(), 3u);
}

TEST(AvailableBytes, AreRefusedIfTheSystemDoesNotReportThem) {
    EXPECT_EQ(detail::bytesOfPages(3, 4096), 12288u);
    try {
        detail::bytesOfPages(-1, 4096);
        FAIL() << "taken for a number";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDevice);
        EXPECT_THAT(error.what(), HasSubstr("does not report how much memory is available on cpu"));
    }
}

TEST_P(BufferOn, AvailableBytesAreThoseOfTheSystem) {
    const uint64_t bytes = availableBytes(GetParam());
    EXPECT_GT(bytes, 1u << 20);
    EXPECT_LT(bytes, uint64_t(1) << 50);
    EXPECT_NO_THROW(Buffer<uint8_t>(GetParam(), "test/free", size_t(bytes / 64)));
}

TEST_P(BufferOn, CopiesToAndFromTheHostAreCounted) {
    Buffer<uint32_t> buffer(GetParam(), "test/counted"), none(GetParam(), "test/none");
    const HostCopyCounts before = hostCopyCounts();
    buffer.upload({1, 2, 3});
    none.upload({});
    EXPECT_EQ(hostCopyCounts().uploadCount, before.uploadCount + 1);
    EXPECT_EQ(hostCopyCounts().readbackCount, before.readbackCount);
    buffer.download();
    EXPECT_EQ(buffer.at(2), 3u);
    none.download();
    buffer.fill(0);
    buffer.resize(2);
    EXPECT_EQ(hostCopyCounts().uploadCount, before.uploadCount + 1);
    EXPECT_EQ(hostCopyCounts().readbackCount, before.readbackCount + 2);
}

INSTANTIATE_TEST_SUITE_P(Both, BufferOn, kBothBackends, backendSuffix);

TEST(Buffer, HostMemoryIsAlignedToACacheLine) {
    for (size_t count : {1, 3, 65}) {
        Buffer<uint8_t> buffer(Backend::kCpu, "test/alignment", count);
        EXPECT_EQ(reinterpret_cast<uintptr_t>(buffer.view().data) % 64, 0u);
    }
}

TEST(Buffer, LedgerIsSortedByName) {
    Buffer<int> b(Backend::kCpu, "test/b", 1), a(Backend::kCpu, "test/a", 1);
    const std::vector<LedgerEntry> ledger = bufferLedger();
    EXPECT_TRUE(
        std::is_sorted(ledger.begin(), ledger.end(),
                       [](const LedgerEntry& x, const LedgerEntry& y) { return x.name < y.name; }));
}

} // namespace
} // namespace shadowdag
