// SPDX-License-Identifier: Apache-2.0
#include "cuda/scan_sort.h"

#include "cuda/buffer.h"
#include "tests/cuda/backends.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace shadowdag {
namespace {

constexpr unsigned kSeed = 1'509;
// Nothing, one, around the block sizes of the implementation, and several blocks.
constexpr size_t kCounts[] = {0,      1,      2,      1'000,  4'096,  4'097,
                              16'384, 16'385, 32'768, 32'769, 300'001};

class ScanSortOn : public OnBackend {
protected:
    ~ScanSortOn() override { setThreadCount(0); }
};

std::vector<uint32_t> randomWords(size_t count, uint32_t largest) {
    std::mt19937 random(kSeed);
    std::uniform_int_distribution<uint32_t> uniform(0, largest);
    std::vector<uint32_t> words(count);
    std::generate(words.begin(), words.end(), [&] { return uniform(random); });
    return words;
}

TEST_P(ScanSortOn, ScanEqualsTheSerialSum) {
    for (const int threads : {1, 2, 5}) {
        setThreadCount(threads);
        for (const size_t count : kCounts) {
            SCOPED_TRACE(testing::Message() << "seed " << kSeed << " count " << count);
            const std::vector<uint32_t> words = randomWords(count, ~0u); // wraps around often
            std::vector<uint32_t> expected(count);
            std::exclusive_scan(words.begin(), words.end(), expected.begin(), 0u);
            Buffer<uint32_t> in(GetParam(), "test/in"), out(GetParam(), "test/out", count);
            in.upload(words);
            const uint64_t total = exclusiveScan(GetParam(), in.view(), out.view());
            EXPECT_EQ(total, std::accumulate(words.begin(), words.end(), uint64_t(0)));
            EXPECT_EQ(out.download(), expected);
            EXPECT_EQ(in.download(), words);
            out.fill(0xff);
            const uint64_t readbacks = hostCopyCounts().readbackCount;
            prefixSums(GetParam(), in.view(), out.view());
            EXPECT_EQ(hostCopyCounts().readbackCount, readbacks) << "nobody waits for it";
            EXPECT_EQ(out.download(), expected);
        }
    }
}

TEST_P(ScanSortOn, ScanWorksInPlace) {
    for (const size_t count : {9'000, 100'000}) {
        const std::vector<uint32_t> words = randomWords(count, 9);
        std::vector<uint32_t> expected(words.size());
        std::exclusive_scan(words.begin(), words.end(), expected.begin(), 0u);
        Buffer<uint32_t> buffer(GetParam(), "test/in place");
        buffer.upload(words);
        exclusiveScan(GetParam(), buffer.view(), buffer.view());
        EXPECT_EQ(buffer.download(), expected);
    }
}

// Sorts `keys` with their indices as values and compares with std::stable_sort.
template <class Key> void expectStableSort(Backend backend, const std::vector<Key>& keys) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << " count " << keys.size());
    std::vector<uint32_t> order(keys.size());
    std::iota(order.begin(), order.end(), 0u);
    Buffer<Key> sortedKeys(backend, "test/keys"), keysAlone(backend, "test/keys alone");
    Buffer<uint32_t> values(backend, "test/values");
    sortedKeys.upload(keys);
    keysAlone.upload(keys);
    values.upload(order);
    sortPairs(backend, sortedKeys.view(), values.view());
    sortPairs(backend, keysAlone.view(), {});

    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
    std::vector<Key> expected(keys.size());
    std::transform(order.begin(), order.end(), expected.begin(),
                   [&](uint32_t i) { return keys[i]; });
    EXPECT_EQ(sortedKeys.download(), expected);
    EXPECT_EQ(keysAlone.download(), expected);
    EXPECT_EQ(values.download(), order);
}

TEST_P(ScanSortOn, SortIsStableForAnyCountAndThreadCount) {
    for (const int threads : {1, 2, 5}) {
        setThreadCount(threads);
        for (const size_t count : kCounts) {
            expectStableSort(GetParam(), randomWords(count, ~0u));
            expectStableSort(GetParam(), randomWords(count, 3)); // many equal keys
        }
    }
}

TEST_P(ScanSortOn, SortSeesEveryBitOf64) {
    std::mt19937_64 random(kSeed);
    std::vector<uint64_t> keys(50'000);
    // One bit apart, at each place in turn: a skipped or misplaced digit shows.
    for (int bit = 0; bit < 64; ++bit) {
        const uint64_t base = random();
        for (uint64_t& key : keys)
            key = base ^ ((random() & 1) << bit);
        expectStableSort(GetParam(), keys);
    }
    std::generate(keys.begin(), keys.end(), std::ref(random));
    expectStableSort(GetParam(), keys);
    std::fill(keys.begin(), keys.end(), ~uint64_t(0));
    expectStableSort(GetParam(), keys);
}

INSTANTIATE_TEST_SUITE_P(Both, ScanSortOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
