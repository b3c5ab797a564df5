// SPDX-License-Identifier: Apache-2.0
#include "python/call.h"

#include "cuda/cancel.h"
#include "python/errors.h"
#include "scenes/printable.h"
#include "scenes/warning.h"

#include <string_view>

namespace shadowdag::python {

namespace {

// Loops poll on the threads that work. Only the calling thread has a call: an exception there ends
// the loop for all others as well.
thread_local Call* callOfThread = nullptr;

constexpr auto kPollInterval = std::chrono::milliseconds(100);

void warn(const std::string& note) {
    constexpr std::string_view kPrefix = "warning: "; // the class says so
    const std::string text = note.starts_with(kPrefix) ? note.substr(kPrefix.size()) : note;
    const py::gil_scoped_acquire locked;
    const py::object category = py::module_::import("shadowdag._native").attr("Warning");
    if (PyErr_WarnFormat(category.ptr(), 1, "%U", textObject(printable(text)).ptr()) != 0)
        throw py::error_already_set();
}

} // namespace

Call::Current::Current(Call& call) : before(std::exchange(callOfThread, &call)) {}

Call::Current::~Current() {
    callOfThread = before;
}

Call::Call(std::string what, py::object progress)
    : what_(std::move(what)), progress_(std::move(progress)) {
    refuseZeroByte(what_);
}

void Call::tell(const std::string& what, double fraction) {
    what_ = what;
    told_ = fraction;
    poll(fraction);
}

void Call::poll(double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_)
        return;
    next_ = now + kPollInterval;
    const py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0)
        throw py::error_already_set();
    const double known = told_ >= 0 ? told_ : fraction;
    if (!progress_.is_none() && known >= 0)
        progress_(textObject(what_), known);
}

void pollCalls() {
    setCpuPoll([](double fraction) {
        if (callOfThread != nullptr)
            callOfThread->poll(fraction);
    });
    setWarningListener(warn);
}

const Console& pythonConsole() {
    static const Console kConsole(
        Console::Listener{warn, [](const std::string& what, double fraction) {
                              if (callOfThread != nullptr)
                                  callOfThread->tell(what, fraction);
                          }});
    return kConsole;
}

} // namespace shadowdag::python
