// SPDX-License-Identifier: Apache-2.0
#include "cuda/runs.h"

#include "tests/cuda/backends.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace shadowdag {
namespace {

class RunsOn : public OnBackend {};

/// Lists the runs of host keys and holds them against a serial walk.
void expectRuns(Backend backend, const std::vector<uint64_t>& keys, uint32_t shift) {
    Buffer<uint64_t> onBackend(backend, "test/keys");
    onBackend.upload(keys);
    Runs runs(backend, "test");
    listRuns(backend, std::as_const(onBackend).view(), shift, runs);
    std::vector<uint32_t> start, runOfItem;
    for (uint32_t i = 0; i < keys.size(); ++i) {
        if (i == 0 || keys[i] >> shift != keys[i - 1] >> shift)
            start.push_back(i);
        runOfItem.push_back(uint32_t(start.size() - 1));
    }
    EXPECT_EQ(runs.count(), start.size());
    start.push_back(uint32_t(keys.size()));
    EXPECT_EQ(runs.start.download(), start);
    const std::vector<uint32_t> next = runs.next.download();
    ASSERT_EQ(next.size(), keys.size() + 1);
    for (size_t i = 0; i < keys.size(); ++i)
        ASSERT_EQ(runOf(viewOf(next), i), runOfItem[i]) << i;
}

TEST_P(RunsOn, OfNothingAreNone) {
    expectRuns(GetParam(), {}, 0);
}

TEST_P(RunsOn, OfHandMadeKeysAreTheExpectedOnes) {
    expectRuns(GetParam(), {7}, 0);
    expectRuns(GetParam(), {7, 7, 7}, 0);
    expectRuns(GetParam(), {0, 1, 2}, 0);
    expectRuns(GetParam(), {0, 0, 1, 5, 5, ~uint64_t(0)}, 0);
    expectRuns(GetParam(), {0, 7, 8, 15, 16}, 3);
    expectRuns(GetParam(), {0, 1, uint64_t(1) << 63}, 63);
}

TEST_P(RunsOn, OfRandomKeysAreThoseOfASerialWalk) {
    constexpr unsigned kSeed = 81;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937_64 random(kSeed);
    for (const size_t count : {100, 32'767, 32'768, 200'001})
        for (const uint64_t range : {uint64_t(2), uint64_t(count / 3), ~uint64_t(0)})
            for (const uint32_t shift : {0u, 3u}) {
                std::vector<uint64_t> keys(count);
                for (uint64_t& key : keys)
                    key = random() % range;
                std::sort(keys.begin(), keys.end());
                expectRuns(GetParam(), keys, shift);
            }
}

TEST_P(RunsOn, ReplaceEarlierOnes) {
    Buffer<uint64_t> many(GetParam(), "test/many"), few(GetParam(), "test/few");
    many.upload({1, 2, 3, 4, 5});
    few.upload({9, 9});
    Runs runs(GetParam(), "test");
    listRuns(GetParam(), std::as_const(many).view(), 0, runs);
    listRuns(GetParam(), std::as_const(few).view(), 0, runs);
    EXPECT_EQ(runs.start.download(), (std::vector<uint32_t>{0, 2}));
}

INSTANTIATE_TEST_SUITE_P(Both, RunsOn, kBothBackends, backendSuffix);

TEST(Runs, OfMoreKeysThanIndicesReachAreRefused) {
    Runs runs(Backend::kCpu, "test");
    const uint64_t key = 0;
    try {
        listRuns(Backend::kCpu, {&key, 0xffffffffull}, 0, runs);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_NE(std::string(error.what()).find("4294967295 keys"), std::string::npos);
    }
}

} // namespace
} // namespace shadowdag
