// SPDX-License-Identifier: Apache-2.0
// The CPU threads through oneTBB: work stealing; nested calls are allowed.
#include "cuda/parallel_for.h"

#include "cuda/parallel_ranges.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/task_arena.h>

#include <memory>
#include <mutex>

namespace shadowdag {

namespace {

// The arena has as many slots as the requested number of threads, even if there are fewer cores
// (the implicit arena would not); the global limit applies to OpenVDB and Embree, which call oneTBB
// themselves.
struct Threads {
    explicit Threads(int count)
        : limit(tbb::global_control::max_allowed_parallelism, size_t(count)), arena(count) {}
    tbb::global_control limit;
    tbb::task_arena arena;
};

std::mutex threadsMutex;
std::shared_ptr<Threads> threads;

std::shared_ptr<Threads> currentThreads() {
    const std::lock_guard lock(threadsMutex);
    if (!threads)
        threads = std::make_shared<Threads>(tbb::info::default_concurrency());
    return threads;
}

/// In how many calls of these functions this thread is, as their caller or as a worker.
thread_local int depth = 0;

struct Within {
    Within() { ++depth; }
    ~Within() { --depth; }
};

/// Runs work() on the arena. The outermost call is isolated: while its thread waits for workers, it
/// takes no range of another thread's call, whose poll (cuda/cancel.h) it would answer for its own.
template <class F> void runOnArena(const F& work) {
    const bool isOutermost = depth == 0;
    currentThreads()->arena.execute([&] {
        if (isOutermost)
            tbb::this_task_arena::isolate(work);
        else
            work();
    });
}

} // namespace

void setThreadCount(int count) {
    if (count < 0)
        throw Error(ErrorKind::kUsage,
                    "thread count " + std::to_string(count) + " is negative; use 0 for all cores");
    auto next = std::make_shared<Threads>(count > 0 ? count : tbb::info::default_concurrency());
    const std::lock_guard lock(threadsMutex);
    threads =
        std::move(next); // the smallest existing limit applies, so the old one is destroyed here
}

int threadCount() {
    return currentThreads()->arena.max_concurrency();
}

void cpuParallelRanges(size_t count, size_t grain,
                       const std::function<void(size_t begin, size_t end)>& body) {
    const RangeCut cut(count, grain);
    if (cut.rangeCount() <= 1) {
        if (count > 0) {
            pollCpu();
            body(0, count);
        }
        return;
    }
    RangePoll poll(cut.rangeCount());
    runOnArena([&] {
        tbb::parallel_for(
            tbb::blocked_range<size_t>(0, cut.rangeCount()),
            [&](const tbb::blocked_range<size_t>& ranges) {
                const Within within;
                for (size_t r = ranges.begin(); r < ranges.end(); ++r)
                    poll.run([&] { body(cut.begin(r), cut.end(r)); });
            },
            tbb::simple_partitioner());
    });
}

void cpuParallelInvoke(const std::function<void()>& a, const std::function<void()>& b) {
    const auto within = [](const std::function<void()>& work) {
        const Within mark;
        work();
    };
    runOnArena([&] { tbb::parallel_invoke([&] { within(a); }, [&] { within(b); }); });
}

} // namespace shadowdag
