// SPDX-License-Identifier: Apache-2.0
// A call of the library from Python: without the interpreter's lock, with progress, and ended by
// Ctrl-C.
#pragma once

#include "tools/settings/console.h"

#include <pybind11/pybind11.h>

#include <chrono>
#include <string>
#include <utility>

namespace shadowdag::python {

namespace py = pybind11;

/// One call on the thread that makes it. While it runs, loops of the library poll it
/// (cuda/cancel.h): it lets Python handle signals, so that Ctrl-C raises KeyboardInterrupt, and
/// reports progress, both ten times a second at most.
class __attribute__((visibility("hidden"))) Call { // as the types of pybind11 that it holds
public:
    /// @param what is done, for `progress` @param progress callable (what, fraction in [0, 1]) or
    /// None; an exception that it raises ends the call
    Call(std::string what, py::object progress);

    /// Returns work(), which runs without the interpreter's lock. Exceptions leave as they are;
    /// those of Python as py::error_already_set.
    template <class F> auto run(F&& work) {
        const Current current(*this);
        const py::gil_scoped_release released;
        return std::forward<F>(work)();
    }

    /// Handles signals and reports the fraction of a loop, or of the work as far as it said so
    /// itself (tell), unless that happened a moment ago. Without the interpreter's lock.
    /// @param fraction below 0: unknown
    void poll(double fraction);
    /// Does the same with the fraction of the work itself, which counts from now on.
    void tell(const std::string& what, double fraction);

private:
    /// Makes the call that of its thread.
    struct Current {
        explicit Current(Call& call);
        ~Current();
        Call* before;
    };

    std::string what_;
    py::object progress_;
    double told_ = -1; ///< the last fraction of tell(); below 0: none
    std::chrono::steady_clock::time_point next_{};
};

/// Makes loops of the library poll the call of their thread. Once, when the module is loaded.
void pollCalls();

/// Returns the console of the module: remarks become Python warnings (class Warning), progress that
/// of the thread's call.
const Console& pythonConsole();

} // namespace shadowdag::python
