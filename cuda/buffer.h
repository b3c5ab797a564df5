// SPDX-License-Identifier: Apache-2.0
// Named arrays on a backend, and the ledger that records the bytes held on each.
#pragma once

#include "cuda/backend.h"
#include "cuda/view.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace shadowdag {

/// One line of the ledger.
struct LedgerEntry {
    std::string name;
    Backend backend;
    size_t bytes;             ///< held now
    size_t peakBytes;         ///< the most ever held
    uint64_t allocationCount; ///< how often memory was taken
};

/// Returns the ledger, sorted by name then backend. Thread safe.
std::vector<LedgerEntry> bufferLedger();

/// Returns how many bytes new buffers may take on a backend at present, as far as the system
/// reports, without the memory that other programs hold. Throws Error kDevice, also if the system
/// does not report it: for the CPU elsewhere than on Linux.
uint64_t availableBytes(Backend backend);

/// How often the host has copied to and from backends since the program began: Buffer's upload,
/// download and at, Readback, resident copies of host arrays, and the totals that scans return. On
/// CUDA uploads are queued and readbacks are waited for. On the CPU, where they cost nothing, they
/// are counted as well, so that a test can verify a frame's number of copies. Empty copies do not
/// count.
struct HostCopyCounts {
    uint64_t uploadCount = 0;
    uint64_t readbackCount = 0;
};
HostCopyCounts hostCopyCounts();

namespace detail {
void countUpload(size_t bytes);
void countReadback(size_t bytes);
void* allocateElements(Backend backend, const std::string& name, size_t count, size_t elementBytes);
void releaseElements(Backend backend, const std::string& name, void* data, size_t bytes);
/// Returns the bytes of memory pages. Throws Error kDevice for counts below 0: the system does not
/// report them.
uint64_t bytesOfPages(long pageCount, long pageBytes);
/// Adds bytes that are held elsewhere to the ledger, or, if negative, removes them.
void noteBytes(Backend backend, const std::string& name, int64_t bytes);
void copyBytes(Backend to, void* dst, Backend from, const void* src, size_t bytes);
void fillBytes(Backend backend, void* dst, int byteValue, size_t bytes);
} // namespace detail

/// Owns `count` trivially copyable elements on one backend under a name in the ledger. Move-only.
/// Contents are uninitialised until written. Grows geometrically through resize and never shrinks
/// its capacity, so that a frame that needs no more than the last one allocates nothing.
template <class T> class Buffer {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    Buffer(Backend backend, std::string name) : backend_(backend), name_(std::move(name)) {}
    Buffer(Backend backend, std::string name, size_t count) : Buffer(backend, std::move(name)) {
        resize(count);
    }
    Buffer(Buffer&& other) noexcept
        : backend_(other.backend_), name_(other.name_), data_(std::exchange(other.data_, nullptr)),
          count_(std::exchange(other.count_, 0)), capacity_(std::exchange(other.capacity_, 0)) {}
    Buffer& operator=(Buffer&& other) noexcept {
        std::swap(backend_, other.backend_);
        std::swap(name_, other.name_);
        std::swap(data_, other.data_);
        std::swap(count_, other.count_);
        std::swap(capacity_, other.capacity_);
        return *this;
    }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    ~Buffer() { release(); }

    /// Makes the buffer hold `count` elements. Contents are lost when it has to grow. Throws Error
    /// kResource naming the buffer and the bytes when memory is short.
    void resize(size_t count) {
        if (count > capacity_) {
            const size_t grown = capacity_ + capacity_ / 2;
            const size_t capacity = count > grown ? count : grown;
            release();
            data_ = static_cast<T*>(detail::allocateElements(backend_, name_, capacity, sizeof(T)));
            capacity_ = capacity;
        }
        count_ = count;
    }
    /// Makes the buffer hold at least `count` elements and keeps those that it holds; elements that
    /// are added are uninitialised. Where it has too little memory it takes that of `room`
    /// elements, or of `count` if those are more: the caller chooses the steps. It releases what
    /// it has first if it is empty, else it holds both while it copies. Throws as resize() does;
    /// its elements then stay.
    void growKeeping(size_t count, size_t room = 0) {
        if (count > capacity_) {
            if (count_ == 0)
                release();
            Buffer grown(backend_, name_, count > room ? count : room);
            detail::copyBytes(backend_, grown.data_, backend_, data_, count_ * sizeof(T));
            grown.count_ = count_;
            *this = std::move(grown);
        }
        count_ = count > count_ ? count : count_;
    }
    /// Sets every byte of the elements.
    void fill(int byteValue) { detail::fillBytes(backend_, data_, byteValue, count_ * sizeof(T)); }
    /// Sets every byte of the elements from `first` on. @param first at most size()
    void fillFrom(size_t first, int byteValue) {
        SDAG_ASSERT(first <= count_);
        detail::fillBytes(backend_, data_ + first, byteValue, (count_ - first) * sizeof(T));
    }
    /// Resizes to the host vector and copies it here.
    void upload(const std::vector<T>& host) {
        resize(host.size());
        detail::countUpload(count_ * sizeof(T));
        detail::copyBytes(backend_, data_, Backend::kCpu, host.data(), count_ * sizeof(T));
    }
    /// Returns a host copy, after all queued work.
    std::vector<T> download() const {
        std::vector<T> host(count_);
        detail::countReadback(count_ * sizeof(T));
        detail::copyBytes(Backend::kCpu, host.data(), backend_, data_, count_ * sizeof(T));
        return host;
    }
    /// Returns element i, after all queued work. A round trip on CUDA.
    T at(size_t i) const {
        SDAG_ASSERT(i < count_);
        T value;
        detail::countReadback(sizeof(T));
        detail::copyBytes(Backend::kCpu, &value, backend_, data_ + i, sizeof(T));
        return value;
    }
    View<T> view() { return {data_, count_}; }
    View<const T> view() const { return {data_, count_}; }
    size_t size() const { return count_; }
    /// Returns how many elements resize() can give without taking memory.
    size_t capacity() const { return capacity_; }
    size_t bytes() const { return count_ * sizeof(T); }
    Backend backend() const { return backend_; }
    const std::string& name() const { return name_; }

private:
    void release() {
        if (data_)
            detail::releaseElements(backend_, name_, data_, capacity_ * sizeof(T));
        data_ = nullptr;
        count_ = capacity_ = 0;
    }

    Backend backend_;
    std::string name_;
    T* data_ = nullptr;
    size_t count_ = 0;
    size_t capacity_ = 0;
};

} // namespace shadowdag
