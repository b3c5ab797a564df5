// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/host/memory.h"

#include "tests/cuda/host/lanes.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/mman.h>
#include <unistd.h>

namespace shadowdag::cuda_host {

namespace {

constexpr size_t kReservedBytes = size_t(256) << 30; // addresses are never used twice
constexpr size_t kAlignment = 256;
constexpr size_t kMostAllocations = size_t(1) << 20;
constexpr uint8_t kAround = 0x5c;

struct Allocation {
    uint8_t *begin, *end; ///< pages
    uint8_t* data;
    size_t bytes;
    bool isLive;
    char name[48];
    std::atomic<bool> isOpened; ///< somebody touched it while memory is open
};

// Not protected by a lock where the handler reads it: an entry is complete before it is counted.
struct Memory {
    uint8_t* begin = nullptr;
    uint8_t* next = nullptr;
    Allocation* allocations = nullptr; ///< by ascending address
    std::atomic<size_t> count{0};
    std::atomic<bool> isOpen{false};
    Allocation** opened = nullptr; ///< those touched since memory was opened
    std::atomic<size_t> openedCount{0};
    size_t pageBytes = 0;
    struct sigaction before[2] = {};
};

Memory& memory();

/// Returns the last allocation that begins at or before an address, or null.
Allocation* allocationBefore(const void* address) {
    Memory& m = memory();
    Allocation* const end = m.allocations + m.count.load(std::memory_order_acquire);
    Allocation* const found =
        std::upper_bound(m.allocations, end, address,
                         [](const void* a, const Allocation& b) { return a < b.begin; });
    return found == m.allocations ? nullptr : found - 1;
}

/// Writes an address of the device into `text`; async-signal-safe but for snprintf.
void describeInto(char* text, size_t textBytes, const void* address) {
    const Allocation* const found = allocationBefore(address);
    if (!found) {
        std::snprintf(text, textBytes, "no allocation");
        return;
    }
    std::snprintf(text, textBytes, "byte %td of '%s', allocation %td of %zu bytes%s",
                  static_cast<const uint8_t*>(address) - found->data, found->name,
                  found - memory().allocations + 1, found->bytes,
                  found->isLive ? "" : ", which is released");
}

/// Makes an allocation accessible if memory is open and it is in it; returns whether it did. Opening
/// what is touched, instead of all that there is, halves the time of tests.
bool openTouched(const void* address) {
    Memory& m = memory();
    Allocation* const found = m.isOpen ? allocationBefore(address) : nullptr;
    if (!found || !found->isLive || address >= found->end)
        return false;
    if (mprotect(found->begin, size_t(found->end - found->begin), PROT_READ | PROT_WRITE) != 0)
        return false;
    if (!found->isOpened.exchange(true))
        m.opened[m.openedCount.fetch_add(1)] = found;
    return true;
}

void onSegment(int signal, siginfo_t* info, void* context) {
    Memory& m = memory();
    if (openTouched(info->si_addr))
        return; // the access is tried again
    if (!isDeviceAddress(info->si_addr)) {
        struct sigaction& before = m.before[signal == SIGBUS];
        if (before.sa_flags & SA_SIGINFO && before.sa_sigaction) {
            before.sa_sigaction(signal, info, context);
            return;
        }
        sigaction(signal, &before, nullptr); // the access is tried again
        return;
    }
    char where[192];
    describeInto(where, sizeof where, info->si_addr);
    if (isLane())
        std::fprintf(stderr, "cuda host: %s touches %s\n", laneName().c_str(), where);
    else
        std::fprintf(stderr, "cuda host: the host touches %s, memory of the device\n", where);
    std::abort();
}

Memory& memory() {
    static Memory* const instance = [] {
        auto* const m = new Memory;
        m->pageBytes = size_t(sysconf(_SC_PAGESIZE));
        void* const reserved = mmap(nullptr, kReservedBytes, PROT_NONE,
                                    MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        void* const table =
            mmap(nullptr, kMostAllocations * sizeof(Allocation), PROT_READ | PROT_WRITE,
                 MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        void* const opened =
            mmap(nullptr, kMostAllocations * sizeof(Allocation*), PROT_READ | PROT_WRITE,
                 MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (reserved == MAP_FAILED || table == MAP_FAILED || opened == MAP_FAILED)
            die("there are no addresses for the device's memory");
        m->begin = m->next = static_cast<uint8_t*>(reserved);
        m->allocations = static_cast<Allocation*>(table);
        m->opened = static_cast<Allocation**>(opened);
        struct sigaction action {};
        action.sa_sigaction = onSegment;
        action.sa_flags = SA_SIGINFO | SA_ONSTACK;
        sigaction(SIGSEGV, &action, &m->before[0]);
        sigaction(SIGBUS, &action, &m->before[1]);
        return m;
    }();
    return *instance;
}

void protect(const Allocation& allocation, int how) {
    if (mprotect(allocation.begin, size_t(allocation.end - allocation.begin), how) != 0)
        die("the memory of '" + std::string(allocation.name) + "' cannot be protected");
}

void checkAround(const Allocation& a, const std::string& when) {
    const auto isKept = [](const uint8_t* from, const uint8_t* to) { // all are as the first
        return from == to ||
               (*from == kAround && std::memcmp(from, from + 1, size_t(to - from) - 1) == 0);
    };
    if (!isKept(a.begin, a.data) || !isKept(a.data + a.bytes, a.end))
        die("something wrote beside '" + std::string(a.name) + "', allocation " +
            std::to_string(&a - memory().allocations + 1) + " of " + std::to_string(a.bytes) +
            " bytes; noticed " + when);
}

} // namespace

void useSignalStack() {
    thread_local bool isUsed = false;
    if (isUsed)
        return;
    constexpr size_t kBytes = size_t(64) << 10;
    stack_t stack{};
    stack.ss_sp = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    stack.ss_size = kBytes;
    isUsed = stack.ss_sp != MAP_FAILED && sigaltstack(&stack, nullptr) == 0;
    if (!isUsed)
        die("there is no stack for signals");
}

void* takeMemory(size_t bytes) {
    Memory& m = memory();
    const size_t count = m.count.load();
    const size_t used = (bytes + kAlignment - 1) / kAlignment * kAlignment;
    const size_t pages = (used + m.pageBytes - 1) / m.pageBytes * m.pageBytes;
    if (count == kMostAllocations ||
        pages + m.pageBytes > size_t(m.begin + kReservedBytes - m.next))
        die("the process has used all addresses of the device");
    Allocation& a = m.allocations[count];
    a.begin = m.next;
    a.end = m.next + pages;
    a.data = a.end - used;
    a.bytes = bytes;
    a.isLive = true;
    std::strcpy(a.name, "unnamed");
    m.next = a.end + m.pageBytes;
    protect(a, PROT_READ | PROT_WRITE);
    std::memset(a.begin, kAround, pages);
    for (size_t i = 0; i < bytes; i += sizeof kPoison)
        std::memcpy(a.data + i, &kPoison, std::min(sizeof kPoison, bytes - i));
    protect(a, PROT_NONE);
    m.count.store(count + 1, std::memory_order_release);
    return a.data;
}

void nameMemory(const void* data, const char* name) {
    Allocation* const found = allocationBefore(data);
    if (found)
        std::snprintf(found->name, sizeof found->name, "%s", name);
}

void giveBackMemory(void* data) {
    Allocation& a = *allocationBefore(data);
    protect(a, PROT_READ | PROT_WRITE);
    checkAround(a, "when it was released");
    a.isLive = false;
    protect(a, PROT_NONE);
    madvise(a.begin, size_t(a.end - a.begin), MADV_DONTNEED);
}

size_t bytesOfMemory(const void* data) {
    const Allocation* const found = allocationBefore(data);
    return found && found->isLive && found->data == data ? found->bytes : 0;
}

bool isDeviceAddress(const void* address) {
    const Memory& m = memory();
    return address >= m.begin && address < m.begin + kReservedBytes;
}

std::string describeAddress(const void* address) {
    if (!isDeviceAddress(address))
        return "memory of the host";
    char text[192];
    describeInto(text, sizeof text, address);
    return text;
}

void checkRange(const void* data, size_t bytes, const std::string& what) {
    const Allocation* const found = isDeviceAddress(data) ? allocationBefore(data) : nullptr;
    const auto* const begin = static_cast<const uint8_t*>(data);
    if (!found || !found->isLive || begin < found->data || bytes > found->bytes ||
        size_t(begin - found->data) > found->bytes - bytes)
        die(what + ": " + std::to_string(bytes) + " bytes from " + describeAddress(data));
}

void checkAround(const std::string& when) {
    Memory& m = memory();
    for (size_t i = 0; i < m.openedCount; ++i) // nobody could write into others
        if (m.opened[i]->isLive)
            checkAround(*m.opened[i], when);
}

Opened::Opened() {
    memory().isOpen = true;
}

Opened::~Opened() {
    Memory& m = memory();
    m.isOpen = false;
    for (size_t i = 0; i < m.openedCount; ++i) {
        m.opened[i]->isOpened = false;
        if (m.opened[i]->isLive)
            protect(*m.opened[i], PROT_NONE);
    }
    m.openedCount = 0;
}

} // namespace shadowdag::cuda_host
