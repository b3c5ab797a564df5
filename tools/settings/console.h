// SPDX-License-Identifier: Apache-2.0
// Output for the user: text, one JSON object for scripts, a progress bar, and Ctrl-C.
#pragma once

#include "cuda/progress.h"
#include "tools/settings/json.h"

#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <utility>

namespace shadowdag {

/// Thrown by checkInterrupted() and by progress callbacks after SIGINT, SIGTERM, SIGXCPU, SIGHUP or
/// a SIGPIPE of another process, so that destructors remove partial files. Not an Error.
struct Interrupted {
    int signal;
};

/// Makes SIGINT, SIGTERM, SIGXCPU, SIGHUP and SIGPIPE raise a flag instead of ending the process at
/// once, unless they are ignored, as shells set SIGINT for the background jobs of scripts; a second
/// one, except SIGPIPE and SIGXCPU, ends it. Ignores SIGXFSZ and leaves SIGQUIT alone, whose core
/// dump shows where the process is. Call once.
/// @param giveUp is called 0.25 s after the first, on a thread of its own, if the process still
/// runs: libraries that do not poll may take longer. It must end the process
void catchInterrupts(std::function<void(int signal)> giveUp);
/// Returns whether the flag is raised.
bool isInterrupted();
/// Returns the signal that raised it; 0 if none did.
int caughtSignal();
/// Throws Interrupted once the flag is raised. Long commands call it between steps.
void checkInterrupted();
/// Does the same for loops (setCpuPoll), whose finished fraction the step that is shown reports.
void pollLoops(double fraction);

/// The destination of output. With --json standard output receives exactly one JSON object, from
/// emit(), and text goes to standard error.
class Console {
public:
    /// Receives remarks and progress instead of standard error, for example a window.
    struct Listener {
        std::function<void(const std::string& text)> note;
        /// May throw to end the work.
        std::function<void(const std::string& what, double fraction)> progress;
    };

    /// @param lineIntervalS seconds between two lines of progress where standard error is no
    /// terminal
    explicit Console(bool json, double lineIntervalS = 10)
        : json_(json), lineIntervalS_(lineIntervalS) {}
    explicit Console(Listener listener) : listener_(std::move(listener)) {}

    /// Returns standard output, or standard error under --json; control characters are escaped
    /// (printable).
    std::ostream& people() const;
    /// Writes a remark to standard error, as one line, or to the listener.
    void note(const std::string& text) const;
    /// Writes the object to standard output under --json, else nothing. Call once.
    void emit(const Json& object) const;
    bool isJson() const { return json_; }

    /// Returns a callback that shows the progress of work that lasts longer than a second, with an
    /// estimate of the time left: as a bar on a terminal, else as a line every few seconds. It
    /// throws Interrupted after a SIGINT.
    Progress progress(const std::string& what) const;
    /// Shows the same of a step until the result is destroyed; its progress is that of the parallel
    /// loop that is running (cuda/cancel.h). Returns null with a listener. Throws Interrupted after
    /// a SIGINT.
    [[nodiscard]] std::shared_ptr<void> step(const std::string& what) const;

private:
    bool json_ = false;
    double lineIntervalS_ = 10;
    Listener listener_;
};

} // namespace shadowdag
