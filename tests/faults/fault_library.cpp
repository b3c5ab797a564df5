// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that makes calls of the C library fail, as a full disk, a lack of memory
// or a limit of threads does. Calls are counted within main: libraries that fail in their own
// initialization, before, end the program without a message. The environment says which fail:
//
//   SDAG_FAULT=NAME:N     the N-th call of NAME fails, from 1: write, fsync, rename, mmap, malloc
//                         (with all that allocate), pthread_create
//   SDAG_FAULT=NAME:N+    and all calls after it
//   SDAG_FAULT=clock:N    from the N-th reading on, the time of day is an hour earlier
//   SDAG_FAULT_COUNTS=F   appends to F how often each was called, when a process exits
//
// Processes that the program starts, as for reading a .vdb file and for drawing, count by
// themselves.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

// glibc's own names of what is replaced here.
extern "C" {
void* __libc_malloc(size_t bytes);
void* __libc_calloc(size_t count, size_t bytes);
void* __libc_realloc(void* old, size_t bytes);
void* __libc_memalign(size_t alignment, size_t bytes);
}

namespace {

enum Call { kWrite, kFsync, kRename, kMmap, kMalloc, kThread, kClock, kCallCount };
constexpr const char* kNames[kCallCount] = {"write",  "fsync",          "rename", "mmap",
                                            "malloc", "pthread_create", "clock"};

std::atomic<long> counts[kCallCount];
std::atomic<bool> isCounting = false;
int wanted = -1; ///< the Call that fails; -1: none
long first = 0;
bool persists = false;

void readEnvironment() {
    const char* const text = std::getenv("SDAG_FAULT");
    const char* const colon = text ? std::strchr(text, ':') : nullptr;
    if (!colon)
        return;
    char* end = nullptr;
    first = std::strtol(colon + 1, &end, 10);
    persists = *end == '+';
    for (int call = 0; call < kCallCount; ++call)
        if (std::strlen(kNames[call]) == size_t(colon - text) &&
            std::strncmp(kNames[call], text, size_t(colon - text)) == 0)
            wanted = call;
}

/// Counts a call and returns whether it must fail.
bool fails(Call call) {
    if (!isCounting)
        return false;
    const long number = ++counts[call];
    return wanted == call && (number == first || (number > first && (persists || call == kClock)));
}

/// Sets errno and returns the value of a failed call.
template <class T> T failed(int error, T value) {
    errno = error;
    return value;
}

__attribute__((destructor)) void writeCounts() {
    const char* const path = std::getenv("SDAG_FAULT_COUNTS");
    if (!path)
        return;
    const int file = int(syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND, 0600));
    char text[256];
    int length = 0;
    for (int call = 0; call < kCallCount; ++call)
        length += std::snprintf(text + length, sizeof text - size_t(length), "%s %ld\n",
                                kNames[call], long(counts[call]));
    syscall(SYS_write, file, text, length);
    close(file);
}

constexpr time_t kHour = 3600;

using Main = int(int, char**, char**);
Main* programMain = nullptr;

int countingMain(int argc, char** argv, char** environment) {
    readEnvironment();
    isCounting = true;
    const int status = programMain(argc, argv, environment);
    isCounting = false;
    return status;
}

} // namespace

extern "C" {

int __libc_start_main(Main* main, int argc, char** argv, void (*begin)(), void (*end)(),
                      void (*unload)(), void* stackEnd) {
    using Start = int(Main*, int, char**, void (*)(), void (*)(), void (*)(), void*);
    programMain = main;
    return reinterpret_cast<Start*>(dlsym(RTLD_NEXT, "__libc_start_main"))(
        countingMain, argc, argv, begin, end, unload, stackEnd);
}
ssize_t write(int file, const void* data, size_t bytes) {
    return fails(kWrite) ? failed<ssize_t>(ENOSPC, -1) : syscall(SYS_write, file, data, bytes);
}
ssize_t writev(int file, const struct iovec* parts, int count) {
    return fails(kWrite) ? failed<ssize_t>(ENOSPC, -1) : syscall(SYS_writev, file, parts, count);
}
int fsync(int file) {
    return fails(kFsync) ? failed(EIO, -1) : int(syscall(SYS_fsync, file));
}
int rename(const char* from, const char* to) noexcept {
    return fails(kRename) ? failed(EIO, -1)
                          : int(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
void* mmap(void* at, size_t bytes, int protection, int flags, int file, off_t offset) noexcept {
    return fails(kMmap) ? failed(ENOMEM, MAP_FAILED)
                        : reinterpret_cast<void*>(
                              syscall(SYS_mmap, at, bytes, protection, flags, file, offset));
}
void* malloc(size_t bytes) noexcept {
    return fails(kMalloc) ? failed<void*>(ENOMEM, nullptr) : __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) noexcept {
    return fails(kMalloc) ? failed<void*>(ENOMEM, nullptr) : __libc_calloc(count, bytes);
}
void* realloc(void* old, size_t bytes) noexcept {
    return fails(kMalloc) ? failed<void*>(ENOMEM, nullptr) : __libc_realloc(old, bytes);
}
void* memalign(size_t alignment, size_t bytes) noexcept {
    return fails(kMalloc) ? failed<void*>(ENOMEM, nullptr) : __libc_memalign(alignment, bytes);
}
void* aligned_alloc(size_t alignment, size_t bytes) noexcept {
    return memalign(alignment, bytes);
}
int posix_memalign(void** result, size_t alignment, size_t bytes) noexcept {
    *result = memalign(alignment, bytes);
    return *result ? 0 : ENOMEM;
}
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                   void* argument) noexcept {
    using Create = int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static Create* const create = reinterpret_cast<Create*>(dlsym(RTLD_NEXT, "pthread_create"));
    return fails(kThread) ? EAGAIN : create(thread, attributes, run, argument);
}
int clock_gettime(clockid_t clock, struct timespec* time) noexcept {
    const int result = int(syscall(SYS_clock_gettime, clock, time));
    if (clock == CLOCK_REALTIME && fails(kClock))
        time->tv_sec -= kHour;
    return result;
}
int gettimeofday(struct timeval* time, void*) noexcept {
    struct timespec now;
    const int result = clock_gettime(CLOCK_REALTIME, &now);
    *time = {now.tv_sec, now.tv_nsec / 1000};
    return result;
}
time_t time(time_t* result) noexcept {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (result)
        *result = now.tv_sec;
    return now.tv_sec;
}

} // extern "C"
