// SPDX-License-Identifier: Apache-2.0
// The device that the host plays notices what it is there to notice.
#include "tests/cuda/host/memory.h"

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>
#include <cuda_runtime.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <numeric>
#include <set>
#include <thread>
#include <vector>

namespace shadowdag::cuda_host {
namespace {

class CudaHost : public testing::Test {
protected:
    void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
    void TearDown() override { EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess); }
};

/// Memory of the device that is released with it.
template <class T> struct Words {
    explicit Words(size_t count, const char* name = "test/words") : count(count) {
        EXPECT_EQ(cudaMallocAsync(reinterpret_cast<void**>(&data), count * sizeof(T), nullptr),
                  cudaSuccess);
        cudaHostNameMemory(data, name);
    }
    ~Words() { EXPECT_EQ(cudaFreeAsync(data, nullptr), cudaSuccess); }
    Words(const Words&) = delete;
    Words& operator=(const Words&) = delete;
    void upload(const std::vector<T>& host) {
        EXPECT_EQ(cudaMemcpy(data, host.data(), host.size() * sizeof(T), cudaMemcpyHostToDevice),
                  cudaSuccess);
    }
    std::vector<T> download() const {
        std::vector<T> host(count);
        EXPECT_EQ(cudaMemcpy(host.data(), data, count * sizeof(T), cudaMemcpyDeviceToHost),
                  cudaSuccess);
        return host;
    }
    T* data = nullptr;
    size_t count;
};

template <class... P, class... A>
cudaError_t start(void (*kernel)(P...), dim3 blocks, dim3 threads, const A&... arguments) {
    cudaLaunchConfig_t config{};
    config.gridDim = blocks;
    config.blockDim = threads;
    return cudaLaunchKernelEx(&config, kernel, arguments...);
}
template <class... P, class... A>
void run(void (*kernel)(P...), dim3 blocks, dim3 threads, const A&... arguments) {
    ASSERT_EQ(start(kernel, blocks, threads, arguments...), cudaSuccess);
    ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
}

__global__ void writeAt(uint32_t* words, size_t i, uint32_t value) {
    words[i] = value;
}

TEST_F(CudaHost, RunsWorkOnlyWhenSomebodyWaitsForIt) {
    Words<uint32_t> words(4);
    uint32_t* pinned = nullptr;
    ASSERT_EQ(cudaHostAlloc(reinterpret_cast<void**>(&pinned), 16, cudaHostAllocDefault),
              cudaSuccess);
    EXPECT_EQ(pinned[0], kPoison);
    EXPECT_EQ(cudaMemsetAsync(words.data, 0x11, 16, nullptr), cudaSuccess);
    EXPECT_EQ(cudaMemcpyAsync(pinned, words.data, 16, cudaMemcpyDeviceToHost), cudaSuccess);
    EXPECT_EQ(pinned[0], kPoison);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
    EXPECT_EQ(pinned[3], 0x11111111u);
    EXPECT_EQ(cudaFreeHost(pinned), cudaSuccess);
}

TEST_F(CudaHost, PoisonsFreshMemoryAndUsesNoAddressTwice) {
    std::set<uint32_t*> seen;
    for (int i = 0; i < 20; ++i) {
        Words<uint32_t> words(5);
        EXPECT_EQ(words.download(), std::vector<uint32_t>(5, kPoison));
        EXPECT_TRUE(seen.insert(words.data).second);
        EXPECT_EQ(reinterpret_cast<uintptr_t>(words.data) % 256, 0u);
    }
}

TEST_F(CudaHost, DiesWithTheNameOfWhatTheHostTouches) {
    Words<uint32_t> words(100, "test/named");
    EXPECT_DEATH(EXPECT_EQ(*const_cast<volatile uint32_t*>(words.data + 2), 0u),
                 "the host touches byte 8 of 'test/named', allocation . of 400 bytes");
    EXPECT_DEATH((void)cudaMemcpy(words.data, words.data, 4, cudaMemcpyHostToDevice),
                 "cudaMemcpy from the host: byte 0 of 'test/named'");
    EXPECT_DEATH((void)cudaMemsetAsync(words.data + 99, 0, 8, nullptr),
                 "8 bytes from byte 396 of 'test/named'");
}

TEST_F(CudaHost, DiesOfAccessesBesideAnAllocationAndAfterIt) {
    Words<uint32_t> words(10, "test/small");
    EXPECT_DEATH(run(writeAt, 1, 1, words.data, size_t(10), 1u),
                 "something wrote beside 'test/small'.*after kernel");
    EXPECT_DEATH(run(writeAt, 1, 1, words.data, size_t(64), 1u),
                 "kernel .*writeAt.*|kernel void.*, block \\(0, 0, 0\\), thread \\(0, 0, 0\\) "
                 "touches byte 256");
    EXPECT_DEATH(
        {
            uint32_t* data = nullptr;
            (void)cudaMallocAsync(reinterpret_cast<void**>(&data), 4, nullptr);
            (void)cudaFreeAsync(data, nullptr);
            (void)cudaDeviceSynchronize();
            run(writeAt, 1, 1, data, size_t(0), 1u);
        },
        "is the address of byte 0 of 'unnamed'.*released");
    EXPECT_DEATH(
        {
            (void)cudaFreeAsync(words.data, nullptr);
            (void)cudaFreeAsync(words.data, nullptr);
        },
        "released twice");
}

TEST_F(CudaHost, DiesOfArgumentsThatOnlyTheHostHas) {
    std::vector<uint32_t> host(4);
    EXPECT_DEATH(run(writeAt, 1, 1, host.data(), size_t(0), 1u), "memory that only the host has");
}

__global__ void noteOrder(uint32_t* order, uint32_t* count) {
    order[atomicAdd(count, 1u)] = blockIdx.x * blockDim.x + threadIdx.x;
}

TEST_F(CudaHost, RunsEveryThreadOnceInNoStatedOrder) {
    constexpr uint32_t kBlocks = 50, kThreads = 96;
    Words<uint32_t> order(kBlocks * kThreads), count(1);
    count.upload({0});
    run(noteOrder, kBlocks, kThreads, order.data, count.data);
    std::vector<uint32_t> found = order.download();
    EXPECT_FALSE(std::is_sorted(found.begin(), found.end()));
    // Nor do the threads of a block run in their order.
    std::vector<uint32_t> ofBlock;
    for (const uint32_t thread : found)
        if (thread / kThreads == 7)
            ofBlock.push_back(thread);
    EXPECT_FALSE(std::is_sorted(ofBlock.begin(), ofBlock.end()));
    std::sort(found.begin(), found.end());
    std::vector<uint32_t> all(kBlocks * kThreads);
    std::iota(all.begin(), all.end(), 0u);
    EXPECT_EQ(found, all);
}

std::mutex threadsMutex;
std::set<std::thread::id> threads;
__global__ void noteThread() {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::lock_guard lock(threadsMutex);
    threads.insert(std::this_thread::get_id());
}

TEST_F(CudaHost, RunsBlocksOnSeveralThreads) {
    run(noteThread, 200, 1);
    EXPECT_EQ(threads.size(), 3u);
}

__global__ void addAcross(uint32_t* sums) {
    uint32_t sum = blockIdx.x + threadIdx.x % kWarpLanes;
    for (int apart = 16; apart > 0; apart /= 2)
        sum += __shfl_xor_sync(0xffffffffu, sum, apart);
    sums[blockIdx.x * blockDim.x + threadIdx.x] = sum;
}

TEST_F(CudaHost, ShufflesExchangeTheValuesOfAllLanes) {
    Words<uint32_t> sums(20 * 128);
    run(addAcross, 20, 128, sums.data);
    const std::vector<uint32_t> found = sums.download();
    for (size_t i = 0; i < found.size(); ++i)
        EXPECT_EQ(found[i], 31 * 32 / 2 + 32 * (i / 128));
}

// Each lane reads what its neighbour wrote before the barrier.
__global__ void readNeighbours(uint32_t* words, uint32_t* seen, bool isBlock) {
    __shared__ uint32_t shared[256];
    const unsigned i = threadIdx.x;
    words[i] = i + 1;
    shared[i] = i + 2;
    if (isBlock)
        __syncthreads();
    else
        __syncwarp();
    const unsigned other = isBlock ? blockDim.x - 1 - i : i ^ 31u;
    seen[i] = words[other] == other + 1 && shared[other] == other + 2;
}

TEST_F(CudaHost, BarriersOfWarpsAndBlocksMakeWritesSeen) {
    for (const bool isBlock : {false, true}) {
        Words<uint32_t> words(256), seen(256);
        run(readNeighbours, 1, 256, words.data, seen.data, isBlock);
        EXPECT_EQ(seen.download(), std::vector<uint32_t>(256, 1));
    }
}

__global__ void readNeighboursTooEarly(uint32_t* words, uint32_t* seen) {
    words[threadIdx.x] = threadIdx.x + 1;
    seen[threadIdx.x] = words[threadIdx.x ^ 31u];
}

TEST_F(CudaHost, WithoutABarrierSomeWritesAreNotSeen) {
    Words<uint32_t> words(256), seen(256);
    run(readNeighboursTooEarly, 1, 256, words.data, seen.data);
    EXPECT_THAT(seen.download(), testing::Contains(kPoison));
}

__global__ void voteOdd(uint32_t* bits) {
    bits[threadIdx.x] = __ballot_sync(0xffffffffu, threadIdx.x % 2);
}

TEST_F(CudaHost, BallotsCollectOneBitOfEachLane) {
    Words<uint32_t> bits(64);
    run(voteOdd, 1, 64, bits.data);
    EXPECT_EQ(bits.download(), std::vector<uint32_t>(64, 0xaaaaaaaau));
}

__global__ void leaveEarly() {
    if (threadIdx.x == 5)
        return;
    __syncwarp();
}
__global__ void nameOthersOnly() {
    __syncwarp(1u << ((threadIdx.x + 1) % kWarpLanes));
}
__global__ void waitApart() {
    if (threadIdx.x % 2)
        __syncwarp();
    else
        __shfl_xor_sync(0xffffffffu, 1, 1);
}
__global__ void tripOver() {
    if (threadIdx.x == 3)
        __trap();
}

TEST_F(CudaHost, DiesOfWaitsThatAreUndefinedOnADevice) {
    EXPECT_DEATH(run(leaveEarly, 1, 32),
                 "thread \\(5, 0, 0\\) left, although|lane 5 of its warp, which its mask names");
    EXPECT_DEATH(run(leaveEarly, 1, 16), "which its mask names|although");
    EXPECT_DEATH(run(nameOthersOnly, 1, 32), "by a mask that does not name it");
    EXPECT_DEATH(run(waitApart, 1, 32), "32 threads of the block wait for others");
    EXPECT_DEATH(run(tripOver, 1, 32), "thread \\(3, 0, 0\\): assertion failed at .*host_test");
}

__global__ void nothing() {}

TEST_F(CudaHost, RefusesWhatExceedsTheLimitsOfADevice) {
    for (const auto& [blocks, threads] : std::vector<std::pair<dim3, dim3>>{{0, 1},
                                                                            {1, 0},
                                                                            {1, 1025},
                                                                            {dim3(1, 65536), 1},
                                                                            {dim3(1, 1, 65536), 1},
                                                                            {1, dim3(64, 32)},
                                                                            {1, dim3(1, 1, 65)},
                                                                            {0x80000000u, 1}})
        EXPECT_EQ(start(nothing, blocks, threads), cudaErrorInvalidConfiguration);
    EXPECT_EQ(start(nothing, dim3(2, 3, 4), dim3(8, 8, 16)), cudaSuccess);
    cudaLaunchConfig_t config{};
    config.dynamicSmemBytes = 48 * 1024 + 1;
    EXPECT_EQ(cudaLaunchKernelEx(&config, nothing), cudaErrorInvalidConfiguration);
}

TEST_F(CudaHost, StreamsWaitForEachOtherOnlyByEvents) {
    for (const bool isOrdered : {false, true}) {
        Words<uint32_t> words(1);
        cudaStream_t stream = nullptr;
        cudaEvent_t filled = nullptr;
        ASSERT_EQ(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), cudaSuccess);
        ASSERT_EQ(cudaEventCreate(&filled), cudaSuccess);
        EXPECT_EQ(cudaMemsetAsync(words.data, 0x22, 4, stream), cudaSuccess);
        EXPECT_EQ(cudaEventRecord(filled, stream), cudaSuccess);
        if (isOrdered) {
            EXPECT_EQ(cudaStreamWaitEvent(nullptr, filled, 0), cudaSuccess);
        }
        uint32_t found = 0;
        EXPECT_EQ(cudaMemcpyAsync(&found, words.data, 4, cudaMemcpyDeviceToHost), cudaSuccess);
        EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
        EXPECT_EQ(found, isOrdered ? 0x22222222u : kPoison);
        EXPECT_EQ(cudaEventDestroy(filled), cudaSuccess);
        EXPECT_EQ(cudaStreamDestroy(stream), cudaSuccess);
    }
}

TEST_F(CudaHost, ReadsTheSourceOfAQueuedCopyWhenItRuns) {
    Words<uint32_t> words(1);
    uint32_t source = 1;
    EXPECT_EQ(cudaMemcpyAsync(words.data, &source, 4, cudaMemcpyHostToDevice), cudaSuccess);
    source = 2; // too early
    EXPECT_EQ(words.download(), std::vector<uint32_t>{2});
}

TEST_F(CudaHost, DiesOfPinnedMemoryThatIsReleasedWhileItIsUsed) {
    Words<uint32_t> words(1);
    void* pinned = nullptr;
    ASSERT_EQ(cudaHostAlloc(&pinned, 4, cudaHostAllocDefault), cudaSuccess);
    EXPECT_DEATH(
        {
            (void)cudaMemcpyAsync(pinned, words.data, 4, cudaMemcpyDeviceToHost);
            (void)cudaFreeHost(pinned);
        },
        "a queued copy still uses the memory");
    EXPECT_EQ(cudaFreeHost(pinned), cudaSuccess);
}

TEST_F(CudaHost, FailsTheCallThatATestAsksFor) {
    void* data = nullptr;
    {
        const FailCall fail("cudaMallocAsync", 2, cudaErrorMemoryAllocation);
        EXPECT_EQ(cudaMallocAsync(&data, 4, nullptr), cudaSuccess);
        EXPECT_FALSE(fail.wasReached());
        void* second = nullptr;
        EXPECT_EQ(cudaMallocAsync(&second, 4, nullptr), cudaErrorMemoryAllocation);
        EXPECT_TRUE(fail.wasReached());
        EXPECT_EQ(second, nullptr);
    }
    EXPECT_EQ(cudaGetLastError(), cudaErrorMemoryAllocation);
    EXPECT_EQ(cudaGetLastError(), cudaSuccess);
    EXPECT_EQ(cudaFreeAsync(data, nullptr), cudaSuccess);
    EXPECT_EQ(cudaMallocAsync(&data, kDeviceBytes + 1, nullptr), cudaErrorMemoryAllocation);
}

TEST_F(CudaHost, SortsAddsAndScansAsTheLibraryDoes) {
    Words<uint32_t> keys(5), otherKeys(5), values(5), otherValues(5), sums(5);
    Words<uint64_t> total(1);
    Words<uint8_t> scratch(4096);
    for (int turn = 0; turn < 2; ++turn) { // the result is in either buffer
        keys.upload({3, 1, 3, 0xffffffffu, 0});
        values.upload({0, 1, 2, 3, 4});
        cub::DoubleBuffer<uint32_t> k(keys.data, otherKeys.data), v(values.data, otherValues.data);
        size_t bytes = 0;
        EXPECT_EQ(cub::DeviceReduce::Sum(nullptr, bytes, keys.data, total.data, 5), cudaSuccess);
        EXPECT_EQ(cub::DeviceReduce::Sum(scratch.data, bytes, keys.data, total.data, 5),
                  cudaSuccess);
        EXPECT_EQ(cub::DeviceScan::ExclusiveSum(nullptr, bytes, keys.data, sums.data, 5),
                  cudaSuccess);
        EXPECT_EQ(cub::DeviceScan::ExclusiveSum(scratch.data, bytes, keys.data, sums.data, 5),
                  cudaSuccess);
        EXPECT_EQ(cub::DeviceRadixSort::SortPairs(nullptr, bytes, k, v, 5), cudaSuccess);
        EXPECT_EQ(cub::DeviceRadixSort::SortPairs(scratch.data, bytes, k, v, 5), cudaSuccess);
        EXPECT_EQ((k.Current() == keys.data ? keys : otherKeys).download(),
                  (std::vector<uint32_t>{0, 1, 3, 3, 0xffffffffu}));
        EXPECT_EQ((v.Current() == values.data ? values : otherValues).download(),
                  (std::vector<uint32_t>{4, 1, 0, 2, 3}));
        EXPECT_EQ(total.download(), std::vector<uint64_t>{0x100000006ull});
        EXPECT_EQ(sums.download(), (std::vector<uint32_t>{0, 3, 4, 7, 6}));
    }
    size_t bytes = 8192;
    EXPECT_DEATH((void)cub::DeviceReduce::Sum(scratch.data, bytes, keys.data, total.data, 5),
                 "the scratch memory of DeviceReduce::Sum: 8192 bytes from byte 0 of 'test/words'");
}

} // namespace
} // namespace shadowdag::cuda_host
