// SPDX-License-Identifier: Apache-2.0
// Scans and sorts by CUB; the only file that includes it (23 CPU seconds to compile).
#include "cuda/scan_sort_cuda.h"

#include "cuda/buffer.h"
#include "cuda/cuda_check.h"
#include "cuda/warp.h"

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>

namespace shadowdag {

namespace {

// Memory that is kept between calls, so that a frame that needs no more than the last one allocates
// none; more than a frame may need, as in builds, is freed at once. One per thread, whose calls are
// queued one after the other.
constexpr size_t kKeptBytes = size_t(128) << 20;
struct Scratch {
    Buffer<uint8_t> cub{Backend::kCuda, "scan_sort/scratch"};
    Buffer<uint8_t> keys{Backend::kCuda, "scan_sort/keys"};
    Buffer<uint32_t> values{Backend::kCuda, "scan_sort/values"};
    Buffer<uint64_t> total{Backend::kCuda, "scan_sort/total", 1};
};
Scratch& scratch() {
    thread_local Scratch own;
    return own;
}
template <class T> void giveBackLarge(Buffer<T>& memory) {
    if (memory.bytes() > kKeptBytes)
        memory = Buffer<T>(Backend::kCuda, memory.name());
}

// Runs a CUB algorithm: once to obtain its number of scratch bytes, once with them.
template <class F> void runCub(const F& algorithm) {
    size_t bytes = 0;
    CUDA_CHECK(algorithm(nullptr, bytes));
    Buffer<uint8_t>& memory = scratch().cub;
    memory.resize(bytes > 0 ? bytes : 1);
    CUDA_CHECK(algorithm(memory.view().data, bytes));
    giveBackLarge(memory);
}

template <class Key> void radixSort(View<Key> keys, View<uint32_t> values) {
    SDAG_ASSERT(values.empty() || values.count == keys.count);
    if (keys.count < 2)
        return;
    scratch().keys.resize(keys.count * sizeof(Key));
    cub::DoubleBuffer<Key> keyPair(keys.data, reinterpret_cast<Key*>(scratch().keys.view().data));
    if (values.empty()) {
        runCub([&](void* memory, size_t& bytes) {
            return cub::DeviceRadixSort::SortKeys(memory, bytes, keyPair, keys.count);
        });
    } else {
        scratch().values.resize(values.count);
        cub::DoubleBuffer<uint32_t> valuePair(values.data, scratch().values.view().data);
        runCub([&](void* memory, size_t& bytes) {
            return cub::DeviceRadixSort::SortPairs(memory, bytes, keyPair, valuePair, keys.count);
        });
        if (valuePair.Current() != values.data)
            CUDA_CHECK(cudaMemcpyAsync(values.data, valuePair.Current(),
                                       values.count * sizeof(uint32_t), cudaMemcpyDeviceToDevice));
    }
    if (keyPair.Current() != keys.data)
        CUDA_CHECK(cudaMemcpyAsync(keys.data, keyPair.Current(), keys.count * sizeof(Key),
                                   cudaMemcpyDeviceToDevice));
    giveBackLarge(scratch().keys);
    giveBackLarge(scratch().values);
}

// Arrays up to this length are scanned by one block: CUB starts two kernels, which wait for each
// other longer than the scan takes.
constexpr size_t kOneBlockCount = 16384;
constexpr unsigned kScanThreads = 1024, kScanWarps = kScanThreads / kGroupLanes;
static_assert(kScanWarps == kGroupLanes); // a lane a warp's sum

__global__ void __launch_bounds__(kScanThreads)
    scanByBlockKernel(View<const uint32_t> in, View<uint32_t> out) {
    constexpr uint32_t kOwn = 4; // consecutive elements of a thread
    __shared__ uint32_t sums[kScanWarps];
    const uint32_t warp = threadIdx.x / kGroupLanes;
    uint32_t before = 0;
    for (size_t first = 0; first < in.count; first += kOwn * kScanThreads) {
        const size_t at = first + kOwn * threadIdx.x;
        uint32_t own[kOwn], sum = 0;
        for (uint32_t k = 0; k < kOwn; ++k) {
            own[k] = at + k < in.count ? in[at + k] : 0;
            sum += own[k];
        }
        const uint32_t upTo = sumUpToLane(sum);
        if (laneOfWarp() == kGroupLanes - 1)
            sums[warp] = upTo;
        __syncthreads();
        const uint32_t upToWarp = sumUpToLane(sums[laneOfWarp()]);
        const uint32_t ofWarps = __shfl_sync(kAllLanes, upToWarp, int(warp)) - sums[warp];
        uint32_t next = before + ofWarps + upTo - sum;
        for (uint32_t k = 0; k < kOwn; ++k) {
            if (at + k < in.count)
                out[at + k] = next;
            next += own[k];
        }
        before += __shfl_sync(kAllLanes, upToWarp, int(kGroupLanes) - 1);
        __syncthreads();
    }
}

} // namespace

void prefixSums(CudaTag, View<const uint32_t> in, View<uint32_t> out) {
    SDAG_ASSERT(in.count == out.count);
    if (in.count == 0)
        return;
    if (in.count <= kOneBlockCount) {
        launchBlocks(scanByBlockKernel, 1, kScanThreads, in, out);
        return;
    }
    runCub([&](void* memory, size_t& bytes) {
        return cub::DeviceScan::ExclusiveSum(memory, bytes, in.data, out.data, in.count);
    });
}

uint64_t exclusiveScan(CudaTag, View<const uint32_t> in, View<uint32_t> out) {
    SDAG_ASSERT(in.count == out.count);
    if (in.count == 0)
        return 0;
    // The total first: out may be in. CUB accumulates in the type of the output, 64 bit.
    Buffer<uint64_t>& total = scratch().total;
    runCub([&](void* memory, size_t& bytes) {
        return cub::DeviceReduce::Sum(memory, bytes, in.data, total.view().data, in.count);
    });
    prefixSums(CudaTag{}, in, out);
    uint64_t sum = 0;
    detail::copyBytes(Backend::kCpu, &sum, Backend::kCuda, total.view().data, sizeof sum);
    return sum;
}

void sortPairs(CudaTag, View<uint64_t> keys, View<uint32_t> values) {
    radixSort(keys, values);
}
void sortPairs(CudaTag, View<uint32_t> keys, View<uint32_t> values) {
    radixSort(keys, values);
}

} // namespace shadowdag
