// SPDX-License-Identifier: Apache-2.0
// Prefix sums in two sweeps over fixed blocks, and a least-significant-digit radix sort whose
// blocks scatter to disjoint places. Both are stable and independent of the number of threads.
#include "cuda/buffer.h"
#include "cuda/parallel_for.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "cuda/scan_sort_cuda.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

constexpr size_t kScanBlock = size_t(1) << 15; // 128 KiB: a block fits the L2 cache
constexpr unsigned kDigitLog2 = 8;             // 256 open write streams fit the TLB and L1
constexpr size_t kDigitCount = size_t(1) << kDigitLog2;
constexpr size_t kMinSortBlock = size_t(1) << 14;
constexpr size_t kMaxSortBlocks = 64; // bounds the 256 counters a block

size_t blockCountOf(size_t count, size_t block) {
    return (count + block - 1) / block;
}

// Runs body(block, begin, end) for every block of [0, count).
template <class F> void forBlocks(size_t count, size_t block, const F& body) {
    cpuParallelRanges(blockCountOf(count, block), 1, [&](size_t first, size_t last) {
        for (size_t b = first; b < last; ++b)
            body(b, b * block, std::min(count, (b + 1) * block));
    });
}

// Returns the bits in which not all keys agree; digits without any need no pass.
template <class Key> Key varyingBits(View<const Key> keys, size_t block) {
    std::vector<Key> differing(blockCountOf(keys.count, block));
    forBlocks(keys.count, block, [&](size_t b, size_t begin, size_t end) {
        Key bits = 0;
        for (size_t i = begin; i < end; ++i)
            bits |= keys[i] ^ keys[0];
        differing[b] = bits;
    });
    return std::accumulate(differing.begin(), differing.end(), Key(0), std::bit_or<Key>());
}

template <class Key> void radixSort(View<Key> keys, View<uint32_t> values) {
    SDAG_ASSERT(values.empty() || values.count == keys.count);
    const size_t count = keys.count;
    if (count < 2)
        return;
    const size_t block = std::max(kMinSortBlock, blockCountOf(count, kMaxSortBlocks));
    const Key varying = varyingBits<Key>(keys, block);
    if (varying == 0)
        return;

    const bool hasValues = !values.empty();
    const auto keyScratch = std::make_unique_for_overwrite<Key[]>(count);
    const auto valueScratch = std::make_unique_for_overwrite<uint32_t[]>(hasValues ? count : 0);
    Key* fromKeys = keys.data;
    Key* toKeys = keyScratch.get();
    uint32_t* fromValues = values.data;
    uint32_t* toValues = valueScratch.get();
    std::vector<std::array<size_t, kDigitCount>> offsets(blockCountOf(count, block));

    for (unsigned shift = 0; shift < 8 * sizeof(Key); shift += kDigitLog2) {
        if (((varying >> shift) & (kDigitCount - 1)) == 0)
            continue;
        forBlocks(count, block, [&](size_t b, size_t begin, size_t end) {
            offsets[b].fill(0);
            for (size_t i = begin; i < end; ++i)
                ++offsets[b][(fromKeys[i] >> shift) & (kDigitCount - 1)];
        });
        // Digit-major, block-minor: equal digits keep the order of their blocks.
        size_t sum = 0;
        for (size_t digit = 0; digit < kDigitCount; ++digit)
            for (auto& counts : offsets)
                sum += std::exchange(counts[digit], sum);
        forBlocks(count, block, [&](size_t b, size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                const size_t to = offsets[b][(fromKeys[i] >> shift) & (kDigitCount - 1)]++;
                toKeys[to] = fromKeys[i];
                if (hasValues)
                    toValues[to] = fromValues[i];
            }
        });
        std::swap(fromKeys, toKeys);
        std::swap(fromValues, toValues);
    }
    if (fromKeys != keys.data) {
        std::copy_n(fromKeys, count, keys.data);
        if (hasValues)
            std::copy_n(fromValues, count, values.data);
    }
}

uint64_t exclusiveScan(CpuTag, View<const uint32_t> in, View<uint32_t> out) {
    SDAG_ASSERT(in.count == out.count);
    const size_t count = in.count;
    std::vector<uint64_t> blockSums(blockCountOf(count, kScanBlock));
    forBlocks(count, kScanBlock, [&](size_t b, size_t begin, size_t end) {
        blockSums[b] = std::accumulate(in.data + begin, in.data + end, uint64_t(0));
    });
    uint64_t total = 0;
    for (uint64_t& sum : blockSums)
        total += std::exchange(sum, total);
    forBlocks(count, kScanBlock, [&](size_t b, size_t begin, size_t end) {
        uint32_t sum = uint32_t(blockSums[b]);
        for (size_t i = begin; i < end; ++i) {
            const uint32_t value = in.data[i]; // read first: out may be in
            out.data[i] = sum;
            sum += value;
        }
    });
    return total;
}

void prefixSums(CpuTag tag, View<const uint32_t> in, View<uint32_t> out) {
    exclusiveScan(tag, in, out);
}

template <class Key> void sortPairs(CpuTag, View<Key> keys, View<uint32_t> values) {
    radixSort(keys, values);
}

} // namespace

void prefixSums(Backend backend, View<const uint32_t> in, View<uint32_t> out) {
    withBackend(backend, [&](auto tag) { prefixSums(tag, in, out); });
}
uint64_t exclusiveScan(Backend backend, View<const uint32_t> in, View<uint32_t> out) {
    detail::countReadback(in.count);
    return withBackend(backend, [&](auto tag) { return exclusiveScan(tag, in, out); });
}
void sortPairs(Backend backend, View<uint64_t> keys, View<uint32_t> values) {
    withBackend(backend, [&](auto tag) { sortPairs(tag, keys, values); });
}
void sortPairs(Backend backend, View<uint32_t> keys, View<uint32_t> values) {
    withBackend(backend, [&](auto tag) { sortPairs(tag, keys, values); });
}

} // namespace shadowdag
