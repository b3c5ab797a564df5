// SPDX-License-Identifier: Apache-2.0
// Device memory and queue through the CUDA runtime. Everything runs on the default stream.
#include "cuda/device.h"

#include "cuda/cuda_check.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <new>
#include <vector>

namespace shadowdag::device {

namespace {

// The stream-ordered pool keeps freed memory, so that the scratch of scans and sorts costs no
// synchronizing cudaMalloc every frame. Some virtual GPUs have no pools.
bool usesPool() {
    static const bool supported = [] {
        int device = 0;
        CUDA_CHECK(cudaGetDevice(&device));
        int hasPools = 0;
        CUDA_CHECK(cudaDeviceGetAttribute(&hasPools, cudaDevAttrMemoryPoolsSupported, device));
        if (!hasPools)
            return false;
        cudaMemPool_t pool = nullptr;
        CUDA_CHECK(cudaDeviceGetDefaultMemPool(&pool, device));
        uint64_t keepBytes = UINT64_MAX;
        CUDA_CHECK(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keepBytes));
        return true;
    }();
    return supported;
}

// Asked about alone: any kernel of this build tells what the device can run.
__global__ void probeDevice() {}

} // namespace

bool isPresent(std::string& why) {
    int count = 0; // cudaGetDeviceCount does not write it if the driver is missing
    const cudaError_t status = cudaGetDeviceCount(&count);
    (void)cudaGetLastError(); // the next call shall not report this one's failure
    if (status != cudaSuccess && status != cudaErrorNoDevice) {
        why = std::string("no CUDA device is usable: ") + cudaGetErrorString(status) +
              "; install NVIDIA's driver, or use --backend cpu";
        return false;
    }
    if (count == 0) {
        why = "the CUDA driver found no device; check CUDA_VISIBLE_DEVICES, or use --backend cpu";
        return false;
    }
    cudaFuncAttributes attributes{};
    const cudaError_t probed = cudaFuncGetAttributes(&attributes, probeDevice);
    (void)cudaGetLastError();
    if (probed != cudaSuccess) {
        int major = 0, minor = 0;
        CUDA_CHECK(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, 0));
        CUDA_CHECK(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, 0));
        const std::string architecture = std::to_string(major) + std::to_string(minor);
        why = "the CUDA device, of architecture sm_" + architecture +
              ", runs no kernel of this build: " + cudaGetErrorString(probed) +
              "; build with -DCMAKE_CUDA_ARCHITECTURES=" + architecture +
              ", or use --backend cpu";
        return false;
    }
    return true;
}

std::string name() {
    int device = 0;
    CUDA_CHECK(cudaGetDevice(&device));
    cudaDeviceProp properties{};
    CUDA_CHECK(cudaGetDeviceProperties(&properties, device));
    return properties.name;
}

std::string driverVersion() {
    int version = 0;
    CUDA_CHECK(cudaDriverGetVersion(&version));
    return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

void* allocate(size_t bytes, [[maybe_unused]] const std::string& name) {
    void* data = nullptr;
    const cudaError_t allocation =
        usesPool() ? cudaMallocAsync(&data, bytes, cudaStream_t(0)) : cudaMalloc(&data, bytes);
    if (allocation == cudaErrorMemoryAllocation) {
        (void)cudaGetLastError();
        return nullptr;
    }
    CUDA_CHECK(allocation);
#if defined(SDAG_CUDA_HOST)
    cudaHostNameMemory(data, name.c_str());
#endif
    return data;
}

size_t availableBytes() {
    size_t unusedBytes = 0, totalBytes = 0;
    CUDA_CHECK(cudaMemGetInfo(&unusedBytes, &totalBytes));
    if (!usesPool())
        return unusedBytes;
    // The driver does not count memory that the pool keeps as free, but it is free for us.
    int device = 0;
    CUDA_CHECK(cudaGetDevice(&device));
    cudaMemPool_t pool = nullptr;
    CUDA_CHECK(cudaDeviceGetDefaultMemPool(&pool, device));
    uint64_t reservedBytes = 0, usedBytes = 0;
    CUDA_CHECK(cudaMemPoolGetAttribute(pool, cudaMemPoolAttrReservedMemCurrent, &reservedBytes));
    CUDA_CHECK(cudaMemPoolGetAttribute(pool, cudaMemPoolAttrUsedMemCurrent, &usedBytes));
    return unusedBytes + size_t(reservedBytes - usedBytes);
}

void release(void* data) noexcept {
    // Failures here are those of earlier kernels; the next checked call reports them.
    if (usesPool())
        (void)cudaFreeAsync(data, cudaStream_t(0));
    else
        (void)cudaFree(data);
    (void)cudaGetLastError();
}

namespace {

// Pinned memory for uploads, used slot by slot, so that the source may change at once without
// waiting for the queue. A slot is reused when the device has passed its mark.
class Staging {
public:
    static constexpr size_t kSlotCount = 16, kSlotBytes = size_t(256) << 10;
    /// Larger copies are not staged here: filling the slots would take as long as waiting.
    static constexpr size_t kStagedBytes = kSlotCount / 2 * kSlotBytes;

    void upload(void* dst, const void* src, size_t bytes) {
        const std::lock_guard lock(mutex_);
        if (!slots_) {
            // Events first, keeping existing ones: a failed step is tried again and reported again.
            for (cudaEvent_t& passed : passed_)
                if (!passed)
                    CUDA_CHECK(cudaEventCreateWithFlags(&passed, cudaEventDisableTiming));
            uint8_t* made = nullptr;
            CUDA_CHECK(cudaHostAlloc(reinterpret_cast<void**>(&made), kSlotCount * kSlotBytes,
                                     cudaHostAllocDefault));
            slots_ = made;
        }
        CUDA_CHECK(cudaEventSynchronize(passed_[next_])); // one never recorded has passed
        uint8_t* const slot = slots_ + next_ * kSlotBytes;
        std::memcpy(slot, src, bytes);
        CUDA_CHECK(cudaMemcpyAsync(dst, slot, bytes, cudaMemcpyHostToDevice, cudaStream_t(0)));
        CUDA_CHECK(cudaEventRecord(passed_[next_], cudaStream_t(0)));
        next_ = (next_ + 1) % kSlotCount;
    }

private:
    std::mutex mutex_;
    uint8_t* slots_ = nullptr; // freed with the process
    cudaEvent_t passed_[kSlotCount] = {};
    size_t next_ = 0;
};

} // namespace

void upload(void* dst, const void* src, size_t bytes) {
    static Staging staging;
    if (bytes > Staging::kStagedBytes) { // waits for the queue, returns once the bytes are staged
        CUDA_CHECK(cudaMemcpy(dst, src, bytes, cudaMemcpyHostToDevice));
        return;
    }
    for (size_t done = 0; done < bytes; done += Staging::kSlotBytes)
        staging.upload(static_cast<uint8_t*>(dst) + done, static_cast<const uint8_t*>(src) + done,
                       std::min(bytes - done, Staging::kSlotBytes));
}

void copyWithin(void* dst, const void* src, size_t bytes) {
    CUDA_CHECK(cudaMemcpyAsync(dst, src, bytes, cudaMemcpyDeviceToDevice, cudaStream_t(0)));
}

void download(void* dst, const void* src, size_t bytes) {
    CUDA_CHECK(cudaMemcpyAsync(dst, src, bytes, cudaMemcpyDeviceToHost, cudaStream_t(0)));
    CUDA_CHECK(cudaStreamSynchronize(cudaStream_t(0)));
}

void* allocatePinned(size_t bytes) {
    void* data = nullptr;
    const cudaError_t allocation = cudaHostAlloc(&data, bytes, cudaHostAllocDefault);
    if (allocation == cudaErrorMemoryAllocation) {
        (void)cudaGetLastError();
        return nullptr;
    }
    CUDA_CHECK(allocation);
    return data;
}

void releasePinned(void* data) noexcept {
    (void)cudaFreeHost(data);
}

void downloadLater(void* dst, const void* src, size_t bytes) {
    CUDA_CHECK(cudaMemcpyAsync(dst, src, bytes, cudaMemcpyDeviceToHost, cudaStream_t(0)));
}

namespace {

// Events that no mark uses: making and destroying one costs more than recording it, and a frame
// takes dozens.
class Events {
public:
    cudaEvent_t take() {
        const std::lock_guard lock(mutex_);
        if (!unused_.empty()) {
            const cudaEvent_t event = unused_.back();
            unused_.pop_back();
            return event;
        }
        cudaEvent_t event = nullptr;
        CUDA_CHECK(cudaEventCreate(&event));
        return event;
    }
    void giveBack(cudaEvent_t event) noexcept {
        const std::lock_guard lock(mutex_);
        try {
            unused_.push_back(event);
        } catch (const std::bad_alloc&) {
            (void)cudaEventDestroy(event);
        }
    }

private:
    std::mutex mutex_;
    std::vector<cudaEvent_t> unused_;
};

// Never destroyed: marks may outlive any static object.
Events& events() {
    static Events* const instance = new Events;
    return *instance;
}

} // namespace

void* recordMark() {
    const cudaEvent_t event = events().take();
    const cudaError_t eventRecord = cudaEventRecord(event, cudaStream_t(0));
    if (eventRecord != cudaSuccess)
        releaseMark(event);
    CUDA_CHECK(eventRecord);
    return event;
}

void waitForMark(void* mark) {
    CUDA_CHECK(cudaEventSynchronize(static_cast<cudaEvent_t>(mark)));
}

double msBetween(void* begin, void* end) {
    waitForMark(end);
    float ms = 0;
    CUDA_CHECK(
        cudaEventElapsedTime(&ms, static_cast<cudaEvent_t>(begin), static_cast<cudaEvent_t>(end)));
    return ms;
}

void releaseMark(void* mark) noexcept {
    events().giveBack(static_cast<cudaEvent_t>(mark));
}

void fill(void* dst, int byteValue, size_t bytes) {
    CUDA_CHECK(cudaMemsetAsync(dst, byteValue, bytes, cudaStream_t(0)));
}

void synchronize() {
    CUDA_CHECK(cudaDeviceSynchronize());
}

} // namespace shadowdag::device
