// SPDX-License-Identifier: Apache-2.0
// The CPU threads as plain std::thread, started for every call: slow, but ThreadSanitizer
// understands it (Debian's oneTBB is not instrumented and drowns it in false reports). Chosen by
// SDAG_CPU_BACKEND=threads.
#include "cuda/parallel_for.h"

#include "cuda/parallel_ranges.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace shadowdag {

namespace {

int coreCount() {
    return std::max(1, int(std::thread::hardware_concurrency()));
}

std::atomic<int> chosenCount{coreCount()};
std::atomic<int> helperCount{0}; // threads running besides their callers, over all nested calls

// Reserves one more thread if the limit allows it. No thread waits for another: work without a
// helper is done by its caller, so nested calls cannot deadlock.
bool reserveHelper() {
    int seen = helperCount.load();
    while (seen + 1 < chosenCount.load())
        if (helperCount.compare_exchange_weak(seen, seen + 1))
            return true;
    return false;
}

struct FirstException {
    void run(const std::function<void()>& task) {
        try {
            task();
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!first)
                first = std::current_exception();
        }
    }
    void rethrow() {
        if (first)
            std::rethrow_exception(first);
    }
    std::mutex mutex;
    std::exception_ptr first;
};

} // namespace

void setThreadCount(int count) {
    if (count < 0)
        throw Error(ErrorKind::kUsage,
                    "thread count " + std::to_string(count) + " is negative; use 0 for all cores");
    chosenCount = count > 0 ? count : coreCount();
}

int threadCount() {
    return chosenCount;
}

void cpuParallelRanges(size_t count, size_t grain,
                       const std::function<void(size_t begin, size_t end)>& body) {
    const RangeCut cut(count, grain);
    std::atomic<size_t> next{0};
    FirstException failure;
    RangePoll poll(cut.rangeCount());
    const auto work = [&] {
        failure.run([&] {
            try {
                for (size_t r = next++; r < cut.rangeCount(); r = next++)
                    poll.run([&] { body(cut.begin(r), cut.end(r)); });
            } catch (...) {
                next = cut.rangeCount(); // the others stop after their current range
                throw;
            }
        });
    };
    std::vector<std::thread> helpers;
    while (helpers.size() + 1 < cut.rangeCount() && reserveHelper())
        helpers.emplace_back([&] {
            work();
            --helperCount;
        });
    work();
    for (std::thread& helper : helpers)
        helper.join();
    failure.rethrow();
}

void cpuParallelInvoke(const std::function<void()>& a, const std::function<void()>& b) {
    FirstException failure;
    if (!reserveHelper()) {
        failure.run(a);
        failure.run(b);
    } else {
        std::thread helper([&] {
            failure.run(a);
            --helperCount;
        });
        failure.run(b);
        helper.join();
    }
    failure.rethrow();
}

} // namespace shadowdag
