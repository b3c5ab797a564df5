// SPDX-License-Identifier: Apache-2.0
// Stage times of a frame: wall-clock time on the CPU; on CUDA the times at which the device passed
// a stage's begin and end, so that the host does not wait between stages.
#pragma once

#include "cuda/backend.h"
#include "cuda/macros.h"

#include <chrono>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// Stage names and their times in milliseconds, in the order in which they first ended. A stage
/// that ends twice adds up. Times of stages that the device has not passed count as 0 until
/// settle(); do not call stageMs and totalMs before it. A stage's time on CUDA is from its begin to
/// its end in the queue, including waits for the host; time between stages belongs to none, so the
/// sum is at most the frame's wall-clock time.
struct StageTimes {
    /// A stage whose time is not known yet.
    struct Pending {
        std::string stage;
        std::function<double()> waitMs; ///< waits, and returns its milliseconds
    };

    std::vector<std::pair<std::string, double>> stagesMs;
    std::vector<Pending> pending;
    /// Called before each stage that a StageTimer adds here; an exception from it cancels the work
    /// of the stages. May be empty.
    std::function<void()> beforeStage = {};

    void add(const std::string& stage, double timeMs) {
        for (auto& [name, sum] : stagesMs)
            if (name == stage) {
                sum += timeMs;
                return;
            }
        stagesMs.emplace_back(stage, timeMs);
    }
    /// Adds a time that settle() fetches.
    void addLater(const std::string& stage, std::function<double()> waitMs) {
        add(stage, 0);
        pending.push_back({stage, std::move(waitMs)});
    }
    /// Waits until every stage has passed and adds its time. Throws Error kDevice if work queued
    /// before failed; the remaining stages then have no time.
    void settle() {
        std::vector<Pending> waited;
        waited.swap(pending);
        for (const Pending& one : waited)
            add(one.stage, one.waitMs());
    }
    /// Returns a stage's time, 0 if the stage did not run.
    double stageMs(const std::string& stage) const {
        SDAG_ASSERT(pending.empty());
        for (const auto& [name, timeMs] : stagesMs)
            if (name == stage)
                return timeMs;
        return 0;
    }
    double totalMs() const {
        SDAG_ASSERT(pending.empty());
        double sum = 0;
        for (const auto& [name, timeMs] : stagesMs)
            sum += timeMs;
        return sum;
    }
};

/// Returns when all work queued on the backend is done; free on the CPU.
void synchronize(Backend backend);

/// A position in the device's queue.
class QueueMark {
public:
    /// Puts it behind the work queued before. Throws Error kDevice.
    QueueMark();
    ~QueueMark();
    QueueMark(const QueueMark&) = delete;
    QueueMark& operator=(const QueueMark&) = delete;

    /// Returns when the device has passed it. Throws Error kDevice when work before it failed.
    void wait() const;
    /// Waits for it and returns the milliseconds since `begin`.
    double msSince(const QueueMark& begin) const;

private:
    void* mark_;
};

/// Adds the time from construction to destruction to `times` under `stage`: at once on the CPU, on
/// CUDA when `times` settles. Adds none during an exception. The constructor throws the exceptions
/// of times.beforeStage.
class StageTimer {
public:
    StageTimer(Backend backend, StageTimes& times, std::string stage)
        : times_(times), stage_(std::move(stage)), exceptionCount_(std::uncaught_exceptions()) {
        if (times.beforeStage)
            times.beforeStage();
        if (backend == Backend::kCuda)
            begin_ = std::make_shared<QueueMark>();
        start_ = std::chrono::steady_clock::now();
    }
    // A destructor that is implicitly noexcept would turn a failed kernel into std::terminate.
    ~StageTimer() noexcept(false) {
        if (std::uncaught_exceptions() > exceptionCount_)
            return;
        if (begin_)
            times_.addLater(stage_, [begin = begin_, end = std::make_shared<QueueMark>()] {
                return end->msSince(*begin);
            });
        else
            times_.add(stage_, std::chrono::duration<double, std::milli>(
                                   std::chrono::steady_clock::now() - start_)
                                   .count());
    }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

private:
    StageTimes& times_;
    std::string stage_;
    int exceptionCount_; // in flight at construction
    std::shared_ptr<QueueMark> begin_;
    std::chrono::steady_clock::time_point start_;
};

} // namespace shadowdag
