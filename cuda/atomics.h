// SPDX-License-Identifier: Apache-2.0
// Relaxed atomics with one spelling for both processors. Those that change a value return
// the previous one.
#pragma once

#include "cuda/macros.h"

#include <cstdint>

#if !defined(__CUDA_ARCH__)
#include <atomic>
#endif

namespace shadowdag {

/// Adds `value` and returns the previous value.
SDAG_HD inline uint32_t atomicAddRelaxed(uint32_t* target, uint32_t value) {
#if defined(__CUDA_ARCH__)
    return atomicAdd(target, value);
#else
    return std::atomic_ref<uint32_t>(*target).fetch_add(value, std::memory_order_relaxed);
#endif
}

/// Adds `value` and returns the previous value.
SDAG_HD inline uint64_t atomicAddRelaxed(uint64_t* target, uint64_t value) {
#if defined(__CUDA_ARCH__)
    return atomicAdd(reinterpret_cast<unsigned long long*>(target),
                     static_cast<unsigned long long>(value));
#else
    return std::atomic_ref<uint64_t>(*target).fetch_add(value, std::memory_order_relaxed);
#endif
}

/// Returns the current value, as other threads' atomics left it.
SDAG_HD inline uint64_t loadRelaxed(uint64_t* target) {
#if defined(__CUDA_ARCH__)
    return *static_cast<const volatile uint64_t*>(target);
#else
    return std::atomic_ref<uint64_t>(*target).load(std::memory_order_relaxed);
#endif
}

/// Returns the current value, as other threads' atomics left it.
SDAG_HD inline uint32_t loadRelaxed(uint32_t* target) {
#if defined(__CUDA_ARCH__)
    return *static_cast<const volatile uint32_t*>(target);
#else
    return std::atomic_ref<uint32_t>(*target).load(std::memory_order_relaxed);
#endif
}

/// Returns the current value, or one that other threads' atomics have replaced since: what caches
/// of a device hold. For values that change in one direction, where an old one errs on the safe
/// side.
template <class T> SDAG_HD inline T loadPast(T* target) {
#if defined(__CUDA_ARCH__)
    return *target;
#else
    return std::atomic_ref<T>(*target).load(std::memory_order_relaxed);
#endif
}

/// Sets the bits of `value` and returns the previous value.
SDAG_HD inline uint32_t atomicOrRelaxed(uint32_t* target, uint32_t value) {
#if defined(__CUDA_ARCH__)
    return atomicOr(target, value);
#else
    std::atomic_ref<uint32_t> ref(*target);
    const uint32_t seen = ref.load(std::memory_order_relaxed);
    if ((seen & value) == value) // the common case of coverage: no bus lock
        return seen;
    return ref.fetch_or(value, std::memory_order_relaxed);
#endif
}

/// Raises the target to `value` if that is larger and returns the previous value.
SDAG_HD inline uint32_t atomicMaxRelaxed(uint32_t* target, uint32_t value) {
#if defined(__CUDA_ARCH__)
    return atomicMax(target, value);
#else
    std::atomic_ref<uint32_t> ref(*target);
    uint32_t seen = ref.load(std::memory_order_relaxed);
    while (seen < value && !ref.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
    }
    return seen;
#endif
}

/// Like atomicOrRelaxed and atomicMaxRelaxed, but skip the atomic if the word would not change. For
/// words that many threads set to the value they have: reads are parallel, atomics are serialized.
SDAG_HD inline void orOnceRelaxed(uint32_t* target, uint32_t value) {
    if ((loadRelaxed(target) & value) != value)
        atomicOrRelaxed(target, value);
}
SDAG_HD inline void raiseOnceRelaxed(uint32_t* target, uint32_t value) {
    if (loadRelaxed(target) < value)
        atomicMaxRelaxed(target, value);
}

/// Lowers the target to `value` if that is smaller and returns the previous value.
SDAG_HD inline uint32_t atomicMinRelaxed(uint32_t* target, uint32_t value) {
#if defined(__CUDA_ARCH__)
    return atomicMin(target, value);
#else
    std::atomic_ref<uint32_t> ref(*target);
    uint32_t seen = ref.load(std::memory_order_relaxed);
    while (seen > value && !ref.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
    }
    return seen;
#endif
}

/// Lowers the target to `value` if that is smaller and returns the previous value.
SDAG_HD inline uint64_t atomicMinRelaxed(uint64_t* target, uint64_t value) {
#if defined(__CUDA_ARCH__)
    return atomicMin(reinterpret_cast<unsigned long long*>(target),
                     static_cast<unsigned long long>(value));
#else
    std::atomic_ref<uint64_t> ref(*target);
    uint64_t seen = ref.load(std::memory_order_relaxed);
    while (seen > value && !ref.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
    }
    return seen;
#endif
}

} // namespace shadowdag
