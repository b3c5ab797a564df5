// SPDX-License-Identifier: Apache-2.0
// The ledger and the memory behind Buffer.
#include "cuda/buffer.h"

#include "cuda/device.h"
#include "cuda/large_pages.h"
#include "cuda/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <new>
#include <tuple>

#if defined(__linux__)
#include <unistd.h>
#endif

namespace shadowdag {

namespace {

// A cache line, and the widest vector register.
constexpr std::align_val_t kHostAlignment{64};

// Large arrays use large pages if the system has them: clearing a page pool of 250 MB then takes
// 120 page faults instead of 60000, and scattered reads miss the translation buffer less. Rounding
// up smaller ones would show.
void* allocateHost(size_t bytes) {
    if (bytes < kLeastLargeBytes)
        return ::operator new(bytes, kHostAlignment, std::nothrow);
    void* data = ::operator new (bytes, std::align_val_t{kLargePageBytes}, std::nothrow);
    if (data)
        useLargePages(data, bytes);
    return data;
}

void releaseHost(void* data, size_t bytes) {
    ::operator delete (data, bytes < kLeastLargeBytes ? kHostAlignment
                                                      : std::align_val_t{kLargePageBytes});
}

// Number of bytes that one thread clears at a time: several large pages.
constexpr size_t kFillGrainBytes = size_t(4) << 20;

struct Ledger {
    std::mutex mutex;
    std::map<std::pair<std::string, Backend>, LedgerEntry> entries;
};

// Never destroyed: static buffers may outlive any static ledger.
Ledger& ledger() {
    static Ledger* instance = new Ledger;
    return *instance;
}

} // namespace

std::vector<LedgerEntry> bufferLedger() {
    Ledger& all = ledger();
    const std::lock_guard lock(all.mutex);
    std::vector<LedgerEntry> result;
    result.reserve(all.entries.size());
    for (const auto& [key, entry] : all.entries)
        result.push_back(entry);
    return result;
}

namespace {

std::atomic<uint64_t> uploadCount{0}, readbackCount{0};

} // namespace

HostCopyCounts hostCopyCounts() {
    return {uploadCount.load(), readbackCount.load()};
}

void detail::countUpload(size_t bytes) {
    uploadCount += bytes > 0;
}
void detail::countReadback(size_t bytes) {
    readbackCount += bytes > 0;
}

uint64_t availableBytes(Backend backend) {
    if (backend == Backend::kCuda)
        return device::availableBytes();
#if defined(__linux__)
    return detail::bytesOfPages(sysconf(_SC_AVPHYS_PAGES), sysconf(_SC_PAGESIZE));
#else
    return detail::bytesOfPages(-1, -1);
#endif
}

namespace detail {

void* allocateElements(Backend backend, const std::string& name, size_t count,
                       size_t elementBytes) {
    // 2^63 keeps the product, the ledger's sum and pointer differences in range.
    const bool countable = count <= (size_t(1) << 63) / elementBytes;
    const size_t bytes = countable ? count * elementBytes : 0;
    void* data = nullptr;
    if (countable && bytes < PTRDIFF_MAX)
        data = backend == Backend::kCuda ? device::allocate(bytes, name) : allocateHost(bytes);
    if (!data)
        throw Error(ErrorKind::kResource,
                    "buffer '" + name + "' needs " + std::to_string(count) + " x " +
                        std::to_string(elementBytes) + " bytes on " + backendName(backend) +
                        ", which are not available; lower the resolution or the memory budget");
    noteBytes(backend, name, int64_t(bytes));
    return data;
}

uint64_t bytesOfPages(long pageCount, long pageBytes) {
    if (pageCount < 0 || pageBytes < 0)
        throw Error(ErrorKind::kDevice,
                    "the system does not report how much memory is available on "
                    "cpu; give a budget in bytes instead");
    return uint64_t(pageCount) * uint64_t(pageBytes);
}

void releaseElements(Backend backend, const std::string& name, void* data, size_t bytes) {
    if (backend == Backend::kCuda)
        device::release(data);
    else
        releaseHost(data, bytes);
    noteBytes(backend, name, -int64_t(bytes));
}

void noteBytes(Backend backend, const std::string& name, int64_t bytes) {
    Ledger& all = ledger();
    const std::lock_guard lock(all.mutex);
    LedgerEntry& entry =
        all.entries.try_emplace({name, backend}, LedgerEntry{name, backend, 0, 0, 0}).first->second;
    SDAG_ASSERT(bytes >= 0 || entry.bytes >= size_t(-bytes));
    entry.bytes += size_t(bytes);
    entry.allocationCount += bytes > 0;
    entry.peakBytes = std::max(entry.peakBytes, entry.bytes);
}

void copyBytes(Backend to, void* dst, Backend from, const void* src, size_t bytes) {
    if (bytes == 0)
        return;
    if (to == Backend::kCpu && from == Backend::kCpu)
        std::memcpy(dst, src, bytes);
    else if (from == Backend::kCpu)
        device::upload(dst, src, bytes);
    else if (to == Backend::kCpu)
        device::download(dst, src, bytes);
    else
        device::copyWithin(dst, src, bytes);
}

void fillBytes(Backend backend, void* dst, int byteValue, size_t bytes) {
    if (bytes == 0)
        return;
    if (backend == Backend::kCuda)
        device::fill(dst, byteValue, bytes);
    else
        cpuParallelRanges(bytes, kFillGrainBytes, [=](size_t begin, size_t end) {
            std::memset(static_cast<char*>(dst) + begin, byteValue, end - begin);
        });
}

} // namespace detail

} // namespace shadowdag
