// SPDX-License-Identifier: Apache-2.0
// What the user reads: lines for people, one JSON object for scripts, a progress bar, and Ctrl-C.
#pragma once

#include "cuda/progress.h"
#include "tools/settings/json.h"

#include <functional>
#include <iosfwd>
#include <string>
#include <utility>

namespace shadowdag {

/// Thrown by checkInterrupted() and by progress callbacks after SIGINT or SIGTERM, so that
/// destructors remove what is half written. Not an Error: nothing was wrong.
struct Interrupted {
    int signal;
};

/// Makes SIGINT and SIGTERM raise a flag instead of ending the process at once; a second one ends
/// it.
void catchInterrupts();
/// Throws Interrupted once the flag is raised. Long commands call it between steps.
void checkInterrupted();

/// Where output goes. With --json standard output receives exactly one JSON object, from emit(),
/// and lines for people go to standard error.
class Console {
public:
    /// What hears remarks and progress instead of standard error, as a window does.
    struct Listener {
        std::function<void(const std::string& text)> note;
        /// May throw to end the work.
        std::function<void(const std::string& what, double fraction)> progress;
    };

    explicit Console(bool json) : json_(json) {}
    explicit Console(Listener listener) : listener_(std::move(listener)) {}

    /// Returns standard output, or standard error under --json.
    std::ostream& people() const;
    /// Writes a remark to standard error, as one line, or to the listener.
    void note(const std::string& text) const;
    /// Writes the object to standard output under --json, else nothing. Call once.
    void emit(const Json& object) const;
    bool isJson() const { return json_; }

    /// Returns a callback that draws a bar on standard error: on a terminal only, and only for work
    /// that lasts longer than a second. It throws Interrupted after a SIGINT, bar or not.
    Progress progress(const std::string& what) const;

private:
    bool json_ = false;
    Listener listener_;
};

} // namespace shadowdag
