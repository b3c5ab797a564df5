// SPDX-License-Identifier: Apache-2.0
#include "cuda/resident.h"

#include "tests/cuda/backends.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

namespace shadowdag {
namespace {

class ResidentOn : public OnBackend {
protected:
    /// Returns what a pass would read.
    std::vector<uint32_t> read(const Resident<uint32_t>& resident) const {
        std::vector<uint32_t> host(resident.size());
        detail::copyBytes(Backend::kCpu, host.data(), GetParam(), resident.view().data,
                          host.size() * sizeof(uint32_t));
        return host;
    }
    /// Returns the uploads since the last call.
    uint64_t newUploads() {
        const uint64_t before = std::exchange(seen_, hostCopyCounts().uploadCount);
        return seen_ - before;
    }
    void SetUp() override {
        OnBackend::SetUp();
        newUploads();
    }

private:
    uint64_t seen_ = 0;
};

TEST_P(ResidentOn, ArraysThatAreSetAreCopiedAndCountedEveryTime) {
    Resident<uint32_t> resident(GetParam(), "test/resident");
    EXPECT_TRUE(resident.view().empty());
    std::vector<uint32_t> host{3, 1, 4};
    resident.set(host);
    EXPECT_EQ(read(resident), host);
    host[1] = 5; // the same place: the caller says that it changed
    resident.set(host);
    EXPECT_EQ(read(resident), host);
    EXPECT_EQ(newUploads(), 2u);
    resident.set(View<const uint32_t>{});
    EXPECT_TRUE(resident.view().empty());
    EXPECT_EQ(newUploads(), 0u) << "nothing was copied";
}

TEST_P(ResidentOn, ArraysThatAreTakenAreCopiedOnlyWhenTheyDiffer) {
    Resident<uint32_t> resident(GetParam(), "test/resident");
    resident.take({1, 2, 3});
    const View<const uint32_t> view = resident.view();
    resident.take({1, 2, 3});
    EXPECT_EQ(newUploads(), 1u);
    EXPECT_EQ(resident.view().data, view.data);
    EXPECT_EQ(read(resident), (std::vector<uint32_t>{1, 2, 3}));
    resident.take({1, 2, 4});
    resident.take({1, 2});
    EXPECT_EQ(read(resident), (std::vector<uint32_t>{1, 2}));
    EXPECT_EQ(newUploads(), 2u);
}

TEST_P(ResidentOn, AnArrayThatWasSetOrForgottenSinceIsCopiedAgain) {
    Resident<uint32_t> resident(GetParam(), "test/resident");
    const std::vector<uint32_t> other{7, 8, 9};
    resident.take({1, 2, 3});
    resident.set(other);
    resident.take({1, 2, 3});
    EXPECT_EQ(read(resident), (std::vector<uint32_t>{1, 2, 3}));
    EXPECT_EQ(newUploads(), 3u);
    resident.forget();
    EXPECT_EQ(read(resident), (std::vector<uint32_t>{1, 2, 3})) << "what is there stays";
    resident.take({1, 2, 3});
    EXPECT_EQ(newUploads(), 1u);
}

TEST_P(ResidentOn, TheLedgerHoldsTheCopyUnderItsName) {
    const auto heldBytes = [&] {
        for (const LedgerEntry& entry : bufferLedger())
            if (entry.name == "test/resident ledger" && entry.backend == GetParam())
                return entry.bytes;
        return size_t(0);
    };
    {
        Resident<uint32_t> resident(GetParam(), "test/resident ledger");
        resident.take({1, 2, 3});
        EXPECT_EQ(heldBytes(), GetParam() == Backend::kCpu ? 0 : 3 * sizeof(uint32_t));
    }
    EXPECT_EQ(heldBytes(), 0u);
}

TEST_P(ResidentOn, ChangedRangesAreCopiedAndNothingBesides) {
    Resident<uint32_t> resident(GetParam(), "test/resident");
    std::vector<uint32_t> host(100'000, 7);
    resident.setChanged(viewOf(std::as_const(host)), {}); // the first time: everything
    EXPECT_EQ(read(resident), host);
    EXPECT_EQ(newUploads(), 1u);
    std::vector<uint32_t> expected = host;
    for (const size_t i : {0, 1, 500, 50'000, 99'999})
        host[i] = expected[i] = 9;
    resident.setChanged(viewOf(std::as_const(host)), {{0, 2}, {500, 1}, {50'000, 1}, {99'999, 1}});
    EXPECT_EQ(read(resident), expected);
    EXPECT_EQ(newUploads(), 3u) << "near ones share a copy";
    host.push_back(1);
    resident.setChanged(viewOf(std::as_const(host)), {{0, 1}});
    EXPECT_EQ(read(resident), host) << "of another length: everything";
}

TEST(JoinRanges, JoinsWhatOverlapsOrIsNear) {
    const std::vector<ArrayRange> expected{{0, 12}, {30, 5}};
    EXPECT_EQ(joinRanges({{0, 4}, {2, 8}, {11, 1}, {20, 0}, {30, 5}}, 1), expected);
    EXPECT_EQ(joinRanges({{0, 4}, {0, 2}}, 0), (std::vector<ArrayRange>{{0, 4}}));
    EXPECT_TRUE(joinRanges({}, 5).empty());
}

INSTANTIATE_TEST_SUITE_P(Both, ResidentOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
