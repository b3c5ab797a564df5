// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that makes calls of the C library fail, as a full disk, a lack of memory
// or a limit of threads does. Calls are counted within main: libraries that fail in their own
// initialization, before, end the program without a message. The environment says which fail:
//
//   SDAG_FAULT=NAME:N     the N-th call of NAME fails, from 1: read (fails with EAGAIN: no data
//                         yet), write (with writev, but not to standard error), stream (what writes
//                         to a FILE), fsync, rename, unlink (with all that remove), mmap, malloc
//                         (with all that allocate), pthread_create, waitpid (that does not wait: no
//                         process has ended yet)
//   SDAG_FAULT=NAME:N+    and all calls after it
//   SDAG_FAULT=NAME:N!    SIGKILL ends the process in place of the N-th call
//   SDAG_FAULT=NAME:N~    the N-th call takes ten seconds, as on a disk that does not answer
//   SDAG_FAULT=clock:N    from the N-th reading on, the time of day is an hour earlier
//   SDAG_FAULT_WAITS=F    creates F when such a call begins to wait
//   SDAG_FAULT_COUNTS=F   appends to F how often each was called, when a process exits
//
// Processes that the program starts, as for reading a .vdb file and for drawing, count by
// themselves. Files of the C++ library write by `write` and close by `fclose`; std::cout and
// std::cerr write by the functions of a FILE, whose own calls of `write` within the C library do
// not come here.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio_ext.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
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

enum Call {
    kRead,
    kWrite,
    kStream,
    kFsync,
    kRename,
    kUnlink,
    kMmap,
    kMalloc,
    kThread,
    kWait,
    kClock,
    kCallCount
};
constexpr const char* kNames[kCallCount] = {"read",           "write",   "stream", "fsync",
                                            "rename",         "unlink",  "mmap",   "malloc",
                                            "pthread_create", "waitpid", "clock"};

std::atomic<long> counts[kCallCount];
std::atomic<bool> isCounting = false;
int wanted = -1; ///< the Call that fails; -1: none
long first = 0;
char how = 0; ///< what follows the number

void readEnvironment() {
    const char* const text = std::getenv("SDAG_FAULT");
    const char* const colon = text ? std::strchr(text, ':') : nullptr;
    if (!colon)
        return;
    char* end = nullptr;
    first = std::strtol(colon + 1, &end, 10);
    how = *end;
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
    if (wanted != call || number < first)
        return false;
    if (call == kClock || how == '+')
        return true;
    if (number > first)
        return false;
    if (how == '!')
        kill(getpid(), SIGKILL);
    if (how != '~')
        return true;
    if (const char* const path = std::getenv("SDAG_FAULT_WAITS"))
        close(int(syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT, 0600)));
    timespec left = {10, 0};
    while (nanosleep(&left, &left) != 0) { // signals do not end it
    }
    return false;
}

/// Sets errno and returns the value of a failed call.
template <class T> T failed(int error, T value) {
    errno = error;
    return value;
}

/// Counts a call that writes to a stream and returns whether it must fail: then what the stream had
/// not yet written is lost, as when the C library's write fails.
bool streamFails(FILE* stream) {
    if (!fails(kStream))
        return false;
    __fpurge(stream);
    stream->_flags |= _IO_ERR_SEEN;
    errno = ENOSPC;
    return true;
}

/// Returns the function that is replaced here.
template <class Function> Function* next(const char* name) {
    return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

__attribute__((destructor)) void writeCounts() {
    const char* const path = std::getenv("SDAG_FAULT_COUNTS");
    if (!path)
        return;
    const int file = int(syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND, 0600));
    char text[512];
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
    return next<Start>("__libc_start_main")(countingMain, argc, argv, begin, end, unload, stackEnd);
}
ssize_t read(int file, void* data, size_t bytes) {
    return fails(kRead) ? failed<ssize_t>(EAGAIN, -1) : syscall(SYS_read, file, data, bytes);
}
ssize_t write(int file, const void* data, size_t bytes) {
    return file != STDERR_FILENO && fails(kWrite) ? failed<ssize_t>(ENOSPC, -1)
                                                  : syscall(SYS_write, file, data, bytes);
}
ssize_t writev(int file, const struct iovec* parts, int count) {
    return file != STDERR_FILENO && fails(kWrite) ? failed<ssize_t>(ENOSPC, -1)
                                                  : syscall(SYS_writev, file, parts, count);
}
size_t fwrite(const void* data, size_t bytes, size_t count, FILE* stream) {
    static auto* const write = next<size_t(const void*, size_t, size_t, FILE*)>("fwrite");
    const bool isEmpty = bytes * count == 0; // never reaches the disk
    return !isEmpty && streamFails(stream) ? 0 : write(data, bytes, count, stream);
}
int fputc(int character, FILE* stream) {
    static auto* const put = next<int(int, FILE*)>("fputc");
    return streamFails(stream) ? EOF : put(character, stream);
}
int putc(int character, FILE* stream) {
    return fputc(character, stream);
}
int fputs(const char* text, FILE* stream) {
    static auto* const put = next<int(const char*, FILE*)>("fputs");
    return streamFails(stream) ? EOF : put(text, stream);
}
int fprintf(FILE* stream, const char* format, ...) {
    if (streamFails(stream))
        return -1;
    va_list values;
    va_start(values, format);
    const int result = vfprintf(stream, format, values);
    va_end(values);
    return result;
}
int fflush(FILE* stream) {
    static auto* const flush = next<int(FILE*)>("fflush");
    return stream && streamFails(stream) ? EOF : flush(stream);
}
int fclose(FILE* stream) {
    static auto* const close = next<int(FILE*)>("fclose");
    const bool isLost = streamFails(stream);
    const int result = close(stream);
    return isLost ? failed(ENOSPC, EOF) : result;
}
int fsync(int file) {
    return fails(kFsync) ? failed(EIO, -1) : int(syscall(SYS_fsync, file));
}
int rename(const char* from, const char* to) noexcept {
    return fails(kRename) ? failed(EIO, -1)
                          : int(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
int unlink(const char* path) noexcept {
    return fails(kUnlink) ? failed(EIO, -1) : int(syscall(SYS_unlinkat, AT_FDCWD, path, 0));
}
int unlinkat(int folder, const char* path, int flags) noexcept {
    return fails(kUnlink) ? failed(EIO, -1) : int(syscall(SYS_unlinkat, folder, path, flags));
}
int rmdir(const char* path) noexcept {
    return fails(kUnlink) ? failed(EIO, -1)
                          : int(syscall(SYS_unlinkat, AT_FDCWD, path, AT_REMOVEDIR));
}
int remove(const char* path) noexcept {
    static auto* const call = next<int(const char*)>("remove");
    return fails(kUnlink) ? failed(EIO, -1) : call(path);
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
    static auto* const create =
        next<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create");
    return fails(kThread) ? EAGAIN : create(thread, attributes, run, argument);
}
pid_t waitpid(pid_t process, int* status, int options) {
    return (options & WNOHANG) && fails(kWait)
               ? 0
               : pid_t(syscall(SYS_wait4, process, status, options, nullptr));
}
int clock_gettime(clockid_t clock, struct timespec* time) noexcept {
    const int result = int(syscall(SYS_clock_gettime, clock, time));
    // The system does not set the other clocks.
    const bool isSet = clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE;
    if (isSet && fails(kClock))
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
int timespec_get(struct timespec* time, int base) noexcept {
    return clock_gettime(CLOCK_REALTIME, time) == 0 ? base : 0;
}

} // extern "C"
