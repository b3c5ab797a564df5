// SPDX-License-Identifier: Apache-2.0
// Scans and sorts by CUB; the only file that includes it (23 CPU seconds to compile).
#include "cuda/scan_sort_cuda.h"

#include "cuda/buffer.h"
#include "cuda/cuda_check.h"

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>

namespace shadowdag::cuda {

namespace {

// Runs a CUB algorithm: once to learn how many scratch bytes it wants, once with them.
template <class F> void runCub(const F& algorithm) {
    size_t bytes = 0;
    CUDA_CHECK(algorithm(nullptr, bytes));
    Buffer<uint8_t> scratch(Backend::kCuda, "scan_sort/scratch", bytes > 0 ? bytes : 1);
    CUDA_CHECK(algorithm(scratch.view().data, bytes));
}

template <class Key> void radixSort(View<Key> keys, View<uint32_t> values) {
    SDAG_ASSERT(values.empty() || values.count == keys.count);
    if (keys.count < 2)
        return;
    Buffer<Key> otherKeys(Backend::kCuda, "scan_sort/keys", keys.count);
    cub::DoubleBuffer<Key> keyPair(keys.data, otherKeys.view().data);
    if (values.empty()) {
        runCub([&](void* scratch, size_t& bytes) {
            return cub::DeviceRadixSort::SortKeys(scratch, bytes, keyPair, keys.count);
        });
    } else {
        Buffer<uint32_t> otherValues(Backend::kCuda, "scan_sort/values", values.count);
        cub::DoubleBuffer<uint32_t> valuePair(values.data, otherValues.view().data);
        runCub([&](void* scratch, size_t& bytes) {
            return cub::DeviceRadixSort::SortPairs(scratch, bytes, keyPair, valuePair, keys.count);
        });
        if (valuePair.Current() != values.data)
            CUDA_CHECK(cudaMemcpyAsync(values.data, valuePair.Current(),
                                       values.count * sizeof(uint32_t), cudaMemcpyDeviceToDevice));
    }
    if (keyPair.Current() != keys.data)
        CUDA_CHECK(cudaMemcpyAsync(keys.data, keyPair.Current(), keys.count * sizeof(Key),
                                   cudaMemcpyDeviceToDevice));
}

} // namespace

void prefixSums(View<const uint32_t> in, View<uint32_t> out) {
    SDAG_ASSERT(in.count == out.count);
    if (in.count == 0)
        return;
    runCub([&](void* scratch, size_t& bytes) {
        return cub::DeviceScan::ExclusiveSum(scratch, bytes, in.data, out.data, in.count);
    });
}

uint64_t exclusiveScan(View<const uint32_t> in, View<uint32_t> out) {
    SDAG_ASSERT(in.count == out.count);
    if (in.count == 0)
        return 0;
    // The total first: out may be in. CUB accumulates in the type of the output, 64 bit.
    Buffer<uint64_t> total(Backend::kCuda, "scan_sort/total", 1);
    runCub([&](void* scratch, size_t& bytes) {
        return cub::DeviceReduce::Sum(scratch, bytes, in.data, total.view().data, in.count);
    });
    prefixSums(in, out);
    uint64_t sum = 0;
    detail::copyBytes(Backend::kCpu, &sum, Backend::kCuda, total.view().data, sizeof sum);
    return sum;
}

void sortPairs(View<uint64_t> keys, View<uint32_t> values) {
    radixSort(keys, values);
}
void sortPairs(View<uint32_t> keys, View<uint32_t> values) {
    radixSort(keys, values);
}

} // namespace shadowdag::cuda
