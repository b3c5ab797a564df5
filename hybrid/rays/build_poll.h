// SPDX-License-Identifier: Apache-2.0
// Lets Embree's builds be cancelled (cuda/cancel.h).
#pragma once

#include "cuda/cancel.h"

#include <exception>
#include <mutex>

namespace shadowdag {

/// Embree's progress monitor of one build: ends the build when the poll function throws.
class BuildPoll {
public:
    /// The function that Embree calls with a BuildPoll, on any thread.
    static bool goesOn(void* poll, double) {
        BuildPoll& self = *static_cast<BuildPoll*>(poll);
        try {
            pollCpu();
            return true;
        } catch (...) {
            const std::lock_guard lock(self.mutex_);
            self.thrown_ = std::current_exception();
            return false;
        }
    }

    /// Rethrows what ended the build, after it returned; does nothing if it ran to its end.
    void rethrow() const {
        if (thrown_)
            std::rethrow_exception(thrown_);
    }

private:
    std::mutex mutex_;
    std::exception_ptr thrown_;
};

} // namespace shadowdag
