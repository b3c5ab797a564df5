// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/console.h"

#include <csignal>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

volatile std::sig_atomic_t interruptSignal = 0;

void onInterrupt(int signal) {
    interruptSignal = signal;
    std::signal(signal, SIG_DFL); // the next one ends the process at once
}

/// One line that is redrawn in place; removed when the work is done or abandoned.
class Bar {
public:
    explicit Bar(std::string what)
        : what_(std::move(what)), isTerminal_(isatty(STDERR_FILENO) == 1) {}
    ~Bar() { clear(); }
    Bar(const Bar&) = delete;
    Bar& operator=(const Bar&) = delete;

    void update(double fraction) {
        if (!isTerminal_)
            return;
        const Clock::time_point now = Clock::now();
        const double elapsed = std::chrono::duration<double>(now - start_).count();
        if (fraction >= 1.0) {
            clear();
            return;
        }
        if (elapsed < 1.0 || now - drawn_ < std::chrono::milliseconds(100))
            return;
        drawn_ = now;
        constexpr int kCells = 30;
        const int full = int(fraction * kCells);
        std::string cells(size_t(full), '#');
        cells.resize(kCells, '.');
        std::fprintf(stderr, "\r%s [%s] %3d %%  %.0f s \033[K", what_.c_str(), cells.c_str(),
                     int(fraction * 100), elapsed);
        std::fflush(stderr);
        isShown_ = true;
    }

private:
    using Clock = std::chrono::steady_clock;
    void clear() {
        if (isShown_)
            std::fputs("\r\033[K", stderr);
        isShown_ = false;
    }

    std::string what_;
    bool isTerminal_;
    bool isShown_ = false;
    Clock::time_point start_ = Clock::now();
    Clock::time_point drawn_{};
};

} // namespace

std::string jsonText(const Json& value) {
    return value.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void catchInterrupts() {
    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
}

void checkInterrupted() {
    if (interruptSignal != 0)
        throw Interrupted{int(interruptSignal)};
}

std::ostream& Console::people() const {
    return json_ ? std::cerr : std::cout;
}

void Console::note(const std::string& text) const {
    if (listener_.note)
        listener_.note(text);
    else
        std::cerr << text << std::endl;
}

void Console::emit(const Json& object) const {
    if (json_)
        std::cout << jsonText(object) << std::flush;
}

Progress Console::progress(const std::string& what) const {
    if (listener_.progress)
        return [what, tell = listener_.progress](double fraction) { tell(what, fraction); };
    auto bar = std::make_shared<Bar>(what);
    return [bar](double fraction) {
        checkInterrupted();
        bar->update(fraction);
    };
}

} // namespace shadowdag
