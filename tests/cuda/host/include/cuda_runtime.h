// SPDX-License-Identifier: Apache-2.0
// The CUDA runtime as far as this project uses it, played by the host: for the build with
// SDAG_CUDA=HOST, whose .cu files are compiled by the host's compiler and include this first, as
// nvcc does with its own. It is stricter than a device where that finds faults: every copy that may
// happen late happens late, work runs only when somebody waits for it, and a mistake that is
// undefined there ends the process with a message here. What the project does not use is missing.
#pragma once

#include "tests/cuda/host/faults.h"
#include "tests/cuda/host/lanes.h"

#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <source_location>
#include <tuple>
#include <type_traits>
#include <typeinfo>

#define CUDA_VERSION 13000
#define __host__
#define __global__
#define __grid_constant__
#define __launch_bounds__(...)
#define __shared__ static thread_local
// Functions of both processors have other texts for each; another name keeps the linker from
// choosing one of them for both.
#define __device__ __attribute__((abi_tag("device")))

// In place and with the same bits: calls of the library take a quarter of the time of rays.
extern "C" {
[[gnu::gnu_inline, gnu::always_inline]] extern inline float fminf(float a, float b) noexcept {
    return b != b || a < b ? a : b;
}
[[gnu::gnu_inline, gnu::always_inline]] extern inline float fmaxf(float a, float b) noexcept {
    return b != b || a > b ? a : b;
}
}

enum cudaError_t {
    cudaSuccess = 0,
    cudaErrorInvalidValue = 1,
    cudaErrorMemoryAllocation = 2,
    cudaErrorInvalidConfiguration = 9,
    cudaErrorInsufficientDriver = 35,
    cudaErrorNoDevice = 100,
    cudaErrorNoKernelImageForDevice = 209,
    cudaErrorInvalidResourceHandle = 400,
    cudaErrorNotReady = 600,
    cudaErrorLaunchFailure = 719,
};
enum cudaMemcpyKind {
    cudaMemcpyHostToDevice = 1,
    cudaMemcpyDeviceToHost,
    cudaMemcpyDeviceToDevice
};
enum cudaDeviceAttr {
    cudaDevAttrMultiProcessorCount,
    cudaDevAttrMemoryPoolsSupported,
    cudaDevAttrComputeCapabilityMajor,
    cudaDevAttrComputeCapabilityMinor
};
struct cudaFuncAttributes {
    int numRegs = 0;
};
enum cudaMemPoolAttr {
    cudaMemPoolAttrReleaseThreshold,
    cudaMemPoolAttrReservedMemCurrent,
    cudaMemPoolAttrUsedMemCurrent
};
constexpr unsigned cudaEventDisableTiming = 2, cudaHostAllocDefault = 0, cudaStreamNonBlocking = 1;

namespace shadowdag::cuda_host {
struct Stream;
struct Event;
struct Pool;
} // namespace shadowdag::cuda_host
using cudaStream_t = shadowdag::cuda_host::Stream*;
using cudaEvent_t = shadowdag::cuda_host::Event*;
using cudaMemPool_t = shadowdag::cuda_host::Pool*;

using uint3 = shadowdag::cuda_host::Index3;
struct dim3 {
    unsigned x = 1, y = 1, z = 1;
    constexpr dim3(unsigned x = 1, unsigned y = 1, unsigned z = 1) : x(x), y(y), z(z) {}
};
struct cudaDeviceProp {
    char name[256] = {};
};
struct cudaLaunchConfig_t {
    dim3 gridDim, blockDim;
    size_t dynamicSmemBytes = 0;
    cudaStream_t stream = nullptr;
};

// The place of a call tells which function of ours makes it.
#define SDAG_FROM std::source_location from = std::source_location::current()
cudaError_t cudaGetDeviceCount(int* count);
cudaError_t cudaGetDevice(int* device);
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int device);
cudaError_t cudaDeviceGetDefaultMemPool(cudaMemPool_t* pool, int device);
cudaError_t cudaMemPoolSetAttribute(cudaMemPool_t pool, cudaMemPoolAttr attribute, void* value);
cudaError_t cudaMemPoolGetAttribute(cudaMemPool_t pool, cudaMemPoolAttr attribute, void* value);
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device);
cudaError_t cudaDriverGetVersion(int* version);
cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, void (*kernel)());
cudaError_t cudaGetLastError();
const char* cudaGetErrorString(cudaError_t error);
cudaError_t cudaMalloc(void** data, size_t bytes, SDAG_FROM);
cudaError_t cudaMallocAsync(void** data, size_t bytes, cudaStream_t stream, SDAG_FROM);
cudaError_t cudaFree(void* data);
cudaError_t cudaFreeAsync(void* data, cudaStream_t stream, SDAG_FROM);
cudaError_t cudaMemGetInfo(size_t* unusedBytes, size_t* totalBytes);
cudaError_t cudaHostAlloc(void** data, size_t bytes, unsigned flags);
cudaError_t cudaFreeHost(void* data);
cudaError_t cudaMemcpy(void* dst, const void* src, size_t bytes, cudaMemcpyKind kind, SDAG_FROM);
cudaError_t cudaMemcpyAsync(void* dst, const void* src, size_t bytes, cudaMemcpyKind kind,
                            cudaStream_t stream = nullptr, SDAG_FROM);
cudaError_t cudaMemsetAsync(void* dst, int byteValue, size_t bytes, cudaStream_t stream, SDAG_FROM);
cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned flags);
cudaError_t cudaStreamDestroy(cudaStream_t stream);
cudaError_t cudaStreamSynchronize(cudaStream_t stream, SDAG_FROM);
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned flags);
cudaError_t cudaDeviceSynchronize(SDAG_FROM);
cudaError_t cudaEventCreate(cudaEvent_t* event);
cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned flags);
cudaError_t cudaEventDestroy(cudaEvent_t event);
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream, SDAG_FROM);
cudaError_t cudaEventSynchronize(cudaEvent_t event, SDAG_FROM);
cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t begin, cudaEvent_t end);

/// Gives device memory the name that messages use.
void cudaHostNameMemory(void* data, const char* name);

namespace shadowdag::cuda_host {

/// Queues a kernel, whose parameters have a type name.
cudaError_t queueGrid(const cudaLaunchConfig_t& config, const std::type_info& kernel,
                      size_t argumentBytes, std::function<void()> lane);
/// Aborts if an argument of a kernel holds the address of memory that only the host has.
void checkArgument(const void* argument, size_t bytes, const std::type_info& kernel);
/// Queues work of a library on the default stream.
cudaError_t queueLibraryCall(const char* function, const std::source_location& from, void* scratch,
                             size_t scratchBytes, std::function<void()> work);

template <class T> uint64_t wordOf(const T& value) {
    static_assert(sizeof(T) <= sizeof(uint64_t) && std::is_trivially_copyable_v<T>);
    uint64_t word = 0;
    std::memcpy(&word, &value, sizeof value);
    return word;
}
template <class T> T fromWord(uint64_t word) {
    T value;
    std::memcpy(&value, &word, sizeof value);
    return value;
}

} // namespace shadowdag::cuda_host

template <class... Parameters, class... Arguments>
cudaError_t cudaLaunchKernelEx(const cudaLaunchConfig_t* config, void (*kernel)(Parameters...),
                               Arguments&&... arguments) {
    using namespace shadowdag::cuda_host;
    std::tuple<Parameters...> copies(arguments...);
    const std::type_info& type = typeid(void(Parameters...));
#if __has_builtin(__builtin_clear_padding) // else what is between members may look like an address
    std::apply(
        [&](auto&... copy) {
            ((__builtin_clear_padding(&copy), checkArgument(&copy, sizeof copy, type)), ...);
        },
        copies);
#endif
    return queueGrid(*config, type, (sizeof(Parameters) + ... + 0),
                     [kernel, copies] { std::apply(kernel, copies); });
}

// What lanes call.
#define __trap() ::shadowdag::cuda_host::trap(__FILE__, __LINE__)

inline void __syncwarp(unsigned mask = 0xffffffffu) {
    using namespace shadowdag::cuda_host;
    static thread_local uint64_t callCount[1024] = {}; // of each thread of a block
    const uint64_t count = callCount[threadIdx.x % 1024]++;
    if (isMutant(count % 2 ? Mutant::kSecondSyncLost : Mutant::kFirstSyncLost))
        return;
    meet(Meeting::kSyncWarp, mask, 0);
}
inline void __syncthreads() {
    using namespace shadowdag::cuda_host;
    meet(Meeting::kSyncBlock, 0, 0);
}
template <class T> T __shfl_xor_sync(unsigned mask, T value, int laneMask) {
    using namespace shadowdag::cuda_host;
    if (isMutant(Mutant::kShuffleMaskShort))
        mask &= 0x7fffffffu;
    const uint64_t* const values = meet(Meeting::kShuffle, mask, wordOf(value));
    if (laneMask == 16 && isMutant(Mutant::kShuffleLaneWrong))
        laneMask = 0;
    return fromWord<T>(values[(threadIdx.x % kWarpLanes) ^ unsigned(laneMask)]);
}
template <class T> T __shfl_sync(unsigned mask, T value, int sourceLane) {
    using namespace shadowdag::cuda_host;
    if (isMutant(Mutant::kShuffleMaskShort))
        mask &= 0x7fffffffu;
    const uint64_t* const values = meet(Meeting::kShuffle, mask, wordOf(value));
    return fromWord<T>(values[unsigned(sourceLane) % kWarpLanes]);
}
inline unsigned __ballot_sync(unsigned mask, int predicate) {
    using namespace shadowdag::cuda_host;
    const uint64_t* const values = meet(Meeting::kBallot, mask, predicate != 0);
    unsigned bits = 0;
    for (unsigned i = 0; i < kWarpLanes; ++i)
        bits |= unsigned((mask >> i & 1u) && values[i]) << i;
    return bits;
}

inline int __popc(unsigned bits) {
    return std::popcount(bits);
}
inline int __ffs(int bits) {
    using namespace shadowdag::cuda_host;
    return bits == 0 ? 0
                     : std::countr_zero(unsigned(bits)) + (isMutant(Mutant::kFirstBitOff) ? 0 : 1);
}
inline int __clz(int bits) {
    using namespace shadowdag::cuda_host;
    return std::countl_zero(unsigned(bits)) + (isMutant(Mutant::kLeadingZerosOff) ? 1 : 0);
}

template <class T> T atomicAdd(T* target, T value) {
    using namespace shadowdag::cuda_host;
    std::atomic_ref<T> ref(*target);
    static thread_local unsigned callCount = 0;
    if (++callCount % 64 == 0 && isMutant(Mutant::kAddLost))
        value = 0;
    const T seen = ref.fetch_add(value, std::memory_order_relaxed);
    return isMutant(Mutant::kAddReturnsNew) ? T(seen + value) : seen;
}
template <class T> T atomicOr(T* target, T value) {
    using namespace shadowdag::cuda_host;
    std::atomic_ref<T> ref(*target);
    return isMutant(Mutant::kOrLost) ? ref.exchange(value, std::memory_order_relaxed)
                                     : ref.fetch_or(value, std::memory_order_relaxed);
}
namespace shadowdag::cuda_host {
template <class T> T atomicChoose(T* target, T value, bool isLarger) {
    std::atomic_ref<T> ref(*target);
    T seen = ref.load(std::memory_order_relaxed);
    while ((isLarger ? value > seen : value < seen) &&
           !ref.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
    }
    return seen;
}
} // namespace shadowdag::cuda_host
template <class T> T atomicMax(T* target, T value) {
    using namespace shadowdag::cuda_host;
    return atomicChoose(target, value, !isMutant(Mutant::kMaxIsMin));
}
template <class T> T atomicMin(T* target, T value) {
    using namespace shadowdag::cuda_host;
    return atomicChoose(target, value, isMutant(Mutant::kMinIsMax));
}
