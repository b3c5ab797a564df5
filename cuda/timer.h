// SPDX-License-Identifier: Apache-2.0
// Wall-clock stage times of a frame, after all work queued on the backend.
#pragma once

#include "cuda/backend.h"

#include <chrono>
#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// Stage names and their times in milliseconds, in the order in which they first ended. A stage
/// that ends twice adds up.
struct StageTimes {
    std::vector<std::pair<std::string, double>> stagesMs;

    void add(const std::string& stage, double timeMs) {
        for (auto& [name, sum] : stagesMs)
            if (name == stage) {
                sum += timeMs;
                return;
            }
        stagesMs.emplace_back(stage, timeMs);
    }
    /// Returns a stage's time, 0 when there was none.
    double stageMs(const std::string& stage) const {
        for (const auto& [name, timeMs] : stagesMs)
            if (name == stage)
                return timeMs;
        return 0;
    }
    double totalMs() const {
        double sum = 0;
        for (const auto& [name, timeMs] : stagesMs)
            sum += timeMs;
        return sum;
    }
};

/// Returns when all work queued on the backend is done; free on the CPU.
void synchronize(Backend backend);

/// Adds the time from construction to destruction to `times` under `stage`, synchronizing at both.
/// The destructor throws what synchronizing throws: work queued within the stage failed. While
/// another exception passes, it neither synchronizes nor adds a time.
class StageTimer {
public:
    /// @param wait what is called to synchronize; tests make it fail
    StageTimer(Backend backend, StageTimes& times, std::string stage,
               void (*wait)(Backend) = synchronize)
        : backend_(backend), times_(times), stage_(std::move(stage)), wait_(wait),
          exceptionCount_(std::uncaught_exceptions()) {
        wait_(backend_);
        start_ = std::chrono::steady_clock::now();
    }
    // A destructor that is implicitly noexcept would turn a failed kernel into std::terminate.
    ~StageTimer() noexcept(false) {
        if (std::uncaught_exceptions() > exceptionCount_)
            return;
        wait_(backend_);
        times_.add(stage_, std::chrono::duration<double, std::milli>(
                               std::chrono::steady_clock::now() - start_)
                               .count());
    }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

private:
    Backend backend_;
    StageTimes& times_;
    std::string stage_;
    void (*wait_)(Backend);
    int exceptionCount_; // in flight at construction
    std::chrono::steady_clock::time_point start_;
};

} // namespace shadowdag
