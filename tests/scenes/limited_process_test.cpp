// SPDX-License-Identifier: Apache-2.0
#include "scenes/limited_process.h"

#include "cuda/cancel.h"

#include <gtest/gtest.h>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <string>
#include <thread>

namespace shadowdag {
namespace {

constexpr ProcessLimits kLimits = {uint64_t(64) << 20, 10, 1 << 20};

/// Returns why no process of this system has its memory limited, or "".
std::string whyMemoryIsUnlimited() {
#if defined(SDAG_SANITIZED)
    return "sanitizers reserve terabytes for themselves, so no limit can be tight";
#endif
    struct rlimit before {};
    getrlimit(RLIMIT_AS, &before);
    struct rlimit after = before;
    // Within the hard limit, else a refusal would look like a system that ignores limits.
    const struct rlimit wanted = {std::min<rlim_t>(rlim_t(1) << 46, before.rlim_max),
                                  before.rlim_max};
    setrlimit(RLIMIT_AS, &wanted);
    getrlimit(RLIMIT_AS, &after);
    setrlimit(RLIMIT_AS, &before);
    return after.rlim_cur == wanted.rlim_cur
               ? ""
               : "the system ignores limits of memory, as emulators of a processor do";
}

TEST(LimitedProcess, ItsOutputAndStatusAreReturned) {
    const std::string text(300'000, 'x');
    const ProcessEnd end = runInProcess("f", kLimits, [&](const ByteSink& write) {
        write(text.data(), text.size());
        write("yz", 2);
        return 7;
    });
    EXPECT_EQ(end.output, text + "yz");
    EXPECT_EQ(end.status, 7);
    EXPECT_EQ(end.signal, 0);
    EXPECT_FALSE(end.wroteTooMuch);
    EXPECT_EQ(runInProcess("f", kLimits, [](const ByteSink&) { return 0; }).output, "");
}

TEST(LimitedProcess, ACrashAndAnExceptionEndItAlone) {
    const ProcessEnd crash = runInProcess("f", kLimits, [](const ByteSink& write) {
        write("begun", 5);
        std::raise(SIGSEGV);
        return 0;
    });
    EXPECT_EQ(crash.signal, SIGSEGV);
    EXPECT_EQ(crash.output, "begun");
    const auto thrower = [](const ByteSink&) -> int { throw std::runtime_error("x"); };
    EXPECT_EQ(runInProcess("f", kLimits, thrower).status, 255);
}

TEST(LimitedProcess, ItsMemoryIsLimited) {
    if (const std::string why = whyMemoryIsUnlimited(); !why.empty())
        GTEST_SKIP() << why;
    const auto take = [](uint64_t byteCount) {
        return runInProcess("f", kLimits, [byteCount](const ByteSink&) {
            // Not by malloc, which may have as much free from other tests.
            void* const bytes = mmap(nullptr, byteCount, PROT_READ | PROT_WRITE,
                                     MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
            return bytes == MAP_FAILED ? 3 : 0;
        });
    };
    EXPECT_EQ(take(uint64_t(32) << 20).status, 0);
    EXPECT_EQ(take(uint64_t(65) << 20).status, 3);
}

TEST(LimitedProcess, ATighterLimitOfTheShellIsNamed) {
    if (const std::string why = whyMemoryIsUnlimited(); !why.empty())
        GTEST_SKIP() << why;
    const auto limitOf = [](__rlimit_resource resource) {
        struct rlimit before {};
        getrlimit(resource, &before);
        // Room for this process, whatever other tests left, but not for as much more.
        const struct rlimit tight = {uint64_t(1) << 40, before.rlim_max};
        setrlimit(resource, &tight);
        ProcessLimits limits = kLimits;
        limits.memoryBytes = uint64_t(1) << 40;
        const ProcessEnd end = runInProcess("f", limits, [](const ByteSink&) { return 0; });
        setrlimit(resource, &before);
        return end.tighterMemoryLimit;
    };
    EXPECT_EQ(limitOf(RLIMIT_DATA), "ulimit -d");
    EXPECT_EQ(limitOf(RLIMIT_AS), "ulimit -v");
    EXPECT_EQ(runInProcess("f", kLimits, [](const ByteSink&) { return 0; }).tighterMemoryLimit, "");
}

TEST(LimitedProcess, ItsTimeIsLimited) {
    ProcessLimits limits = kLimits;
    limits.cpuSeconds = 1;
    const ProcessEnd end = runInProcess("f", limits, [](const ByteSink&) {
        for (;;)
            getppid();
        return 0;
    });
    EXPECT_EQ(end.signal, SIGXCPU);
}

TEST(LimitedProcess, ItIsKilledWhenItWritesTooMuch) {
    const ProcessEnd end = runInProcess("f", kLimits, [](const ByteSink& write) {
        const std::string part(1 << 16, 'x');
        for (;;)
            write(part.data(), part.size());
        return 0;
    });
    EXPECT_EQ(end.signal, SIGKILL);
    EXPECT_TRUE(end.wroteTooMuch);
    EXPECT_LE(end.output.size(), kLimits.outputBytes + (1 << 17));
}

TEST(LimitedProcess, CancellingKillsIt) {
    struct Cancelled {};
    static int pollCount;
    pollCount = 0;
    setCpuPoll([](double) {
        if (++pollCount > 3)
            throw Cancelled();
    });
    const auto start = std::chrono::steady_clock::now();
    EXPECT_THROW(runInProcess("f", kLimits,
                              [](const ByteSink&) {
                                  std::this_thread::sleep_for(std::chrono::seconds(100));
                                  return 0;
                              }),
                 Cancelled);
    setCpuPoll(nullptr);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(50));
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a process is left";
}

TEST(LimitedProcess, FilesThatAreOpenAreClosedToIt) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const ProcessEnd end = runInProcess("f", kLimits, [&](const ByteSink&) {
        return ::write(ends[1], "x", 1) < 0 && errno == EBADF ? 0 : 1;
    });
    close(ends[0]);
    close(ends[1]);
    EXPECT_EQ(end.status, 0);
}

} // namespace
} // namespace shadowdag
