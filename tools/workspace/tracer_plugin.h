// SPDX-License-Identifier: Apache-2.0
// Runs tracers of others that are linked as plug-ins (tracer_api.h) over a ray set.
#pragma once

#include "tools/workspace/ray_answers.h"

#include <memory>
#include <string>

namespace shadowdag {

/// A library that was loaded. Its code runs in this process: load only what you trust.
class TracerPlugin {
public:
    /// Loads a library. Throws Error kInput, naming `path` and the reason, if it cannot be loaded,
    /// has no tracer, another version, or an incomplete table.
    explicit TracerPlugin(const std::string& path);
    ~TracerPlugin();
    TracerPlugin(const TracerPlugin&) = delete;
    TracerPlugin& operator=(const TracerPlugin&) = delete;

    const std::string& name() const { return name_; }
    /// Builds, answers once to warm up, then `repeatCount` times, timed by the wall clock. Throws
    /// Error kInput with the tracer's own words if a call fails, or if answers are neither 0 nor 1
    /// or change between repetitions. @param set its masks are not shown to the tracer
    RayAnswers answer(const RaySet& set, uint32_t repeatCount) const;

private:
    struct Library;
    std::unique_ptr<Library> library_;
    std::string path_, name_;
};

} // namespace shadowdag
