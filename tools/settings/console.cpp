// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/console.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/printable.h"

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <mutex>
#include <ostream>
#include <streambuf>
#include <thread>
#include <vector>

namespace shadowdag {

namespace {

std::atomic<int> interruptSignal = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler writes it");

int interruptPipe[2]; ///< gets a byte at the first signal

/// Returns whether a signal is ignored, as nohup and parents of daemons set it.
bool isIgnored(int signal) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    return before.sa_handler == SIG_IGN;
}

void onInterrupt(int signal) {
    interruptSignal = signal;
    const int error = errno;
    static_cast<void>(write(interruptPipe[1], "", 1) + 1);
    errno = error;
    // The next one ends the process at once; not SIGPIPE, which the process may raise itself while
    // it cleans up.
    for (const int next : {SIGINT, SIGTERM, SIGHUP})
        if (!isIgnored(next))
            std::signal(next, SIG_DFL);
}

/// A SIGPIPE that another process sent is an interrupt. The kernel's own, for a write into a closed
/// pipe, names this process as the sender; the write then fails, as to a full disk.
void onPipe(int signal, siginfo_t* info, void*) {
    if (info->si_pid != getpid())
        onInterrupt(signal);
}

class Bar;

std::mutex barMutex;     ///< of all bars and of what they draw
std::vector<Bar*> bars;  ///< the last one is shown
bool isBarDrawn = false; ///< the terminal's last line is a bar
/// When the last line was written where there is no terminal, by any bar or as a remark.
std::chrono::steady_clock::time_point lastLine = std::chrono::steady_clock::now();

/// Removes the bar from the terminal. With barMutex held.
void clearBar() {
    if (isBarDrawn)
        std::fputs("\r\033[K", stderr);
    isBarDrawn = false;
}

/// What is being done, for how long, and an estimate of how much longer: on a terminal one line
/// that is redrawn in place and removed at the end, else a line when none was written for a few
/// seconds, so that many short steps show as one long one does. Its thread draws, so that it goes
/// on while the work reports nothing.
class Bar {
public:
    Bar(const std::string& what, bool followsLoops, double lineIntervalS)
        : what_(printableLine(what)), followsLoops_(followsLoops), lineIntervalS_(lineIntervalS) {
        const std::lock_guard lock(barMutex);
        thread_ = std::thread([this] { run(); }); // may throw; it waits for the lock
        bars.push_back(this);
    }
    ~Bar() {
        {
            const std::lock_guard lock(barMutex);
            end();
            bars.erase(std::find(bars.begin(), bars.end(), this));
        }
        wake_.notify_all();
        thread_.join();
    }
    Bar(const Bar&) = delete;
    Bar& operator=(const Bar&) = delete;

    bool followsLoops() const { return followsLoops_; }
    /// With barMutex held.
    void update(double fraction) {
        if (fraction < fraction_) { // the next loop
            base_ = 0;
            begin_ = Clock::now();
            pass_ += fraction < fraction_ / 2; // not of threads that report out of order
        }
        fraction_ = fraction;
        if (since(begin_) < 0.2) // what was resumed says nothing about the rate
            base_ = fraction;
        if (fraction >= 1.0 && !followsLoops_)
            end();
    }

private:
    using Clock = std::chrono::steady_clock;
    static double since(Clock::time_point then) {
        return std::chrono::duration<double>(Clock::now() - then).count();
    }

    void end() {
        isEnded_ = true;
        if (bars.back() == this)
            clearBar();
    }

    void run() {
        std::unique_lock lock(barMutex);
        const auto interval =
            std::chrono::duration<double>(isTerminal_ ? 0.1 : std::min(1.0, lineIntervalS_ / 4));
        while (!isEnded_) {
            wake_.wait_for(lock, interval);
            if (!isEnded_ && bars.back() == this && since(start_) >= 1.0)
                draw();
        }
    }

    void draw() {
        const double elapsed = since(start_);
        std::string times = seconds(elapsed), what = what_;
        if (fraction_ - base_ > 0.01 && since(begin_) > 0.5)
            times += ", about " + seconds(since(begin_) * (1 - fraction_) / (fraction_ - base_)) +
                     (pass_ > 1 ? " left of this pass" : " left");
        if (pass_ > 1)
            what += ", pass " + std::to_string(pass_);
        if (!isTerminal_) {
            if (since(lastLine) < lineIntervalS_)
                return;
            lastLine = Clock::now();
            std::fprintf(stderr, "%s: %d %%, %s\n", what.c_str(), int(fraction_ * 100),
                         times.c_str());
            return;
        }
        constexpr int kCells = 30;
        const int full = std::clamp(int(fraction_ * kCells), 0, kCells);
        std::string cells(size_t(full), '#');
        cells.resize(kCells, '.');
        std::fprintf(stderr, "\r%s [%s] %3d %%  %s \033[K", what.c_str(), cells.c_str(),
                     int(fraction_ * 100), times.c_str());
        std::fflush(stderr);
        isBarDrawn = true;
    }

    static std::string seconds(double s) {
        char text[48];
        if (s < 99.5)
            std::snprintf(text, sizeof text, "%.0f s", s);
        else
            std::snprintf(text, sizeof text, "%.0f min", s / 60);
        return text;
    }

    const std::string what_;
    const bool followsLoops_;
    const double lineIntervalS_;
    const bool isTerminal_ = isatty(STDERR_FILENO) == 1;
    const Clock::time_point start_ = Clock::now();
    double fraction_ = 0, base_ = 0;         ///< base_: where begin_ was
    Clock::time_point begin_ = Clock::now(); ///< of the work whose fraction is known
    int pass_ = 1;                           ///< which of the loops
    bool isEnded_ = false;
    std::condition_variable wake_;
    std::thread thread_;
};

/// Passes text on with its control characters escaped, which names in it may contain. What `out`
/// cannot write remains its own failure; only a lack of memory here is one of this buffer.
class PrintableBuffer : public std::streambuf {
public:
    explicit PrintableBuffer(std::ostream& out) : out_(out) {}

private:
    int_type overflow(int_type byte) override {
        const char text = traits_type::to_char_type(byte);
        return traits_type::eq_int_type(byte, traits_type::eof()) || xsputn(&text, 1) == 1
                   ? traits_type::not_eof(byte)
                   : traits_type::eof();
    }
    std::streamsize xsputn(const char* text, std::streamsize count) override {
        const std::string shown = printable({text, size_t(count)});
        out_.write(shown.data(), std::streamsize(shown.size()));
        return count;
    }
    int sync() override {
        out_.flush();
        return 0;
    }

    std::ostream& out_;
};

} // namespace

std::string jsonText(const Json& value) {
    return value.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void catchInterrupts(std::function<void(int signal)> giveUp) {
    if (pipe2(interruptPipe, O_CLOEXEC) != 0)
        throw Error(ErrorKind::kResource,
                    "a pipe cannot be created: " + std::string(std::strerror(errno)) + "; " +
                        kMoreFilesRemedy);
    std::thread([giveUp = std::move(giveUp)] {
        for (char byte = 0; read(interruptPipe[0], &byte, 1) != 1;) { // other signals interrupt it
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(250));
        giveUp(interruptSignal);
    }).detach();
    // Without SA_RESTART: a call that waits, such as for a pipe, returns.
    struct sigaction action {};
    action.sa_handler = onInterrupt;
    for (const int signal : {SIGINT, SIGTERM, SIGXCPU, SIGHUP})
        if (!isIgnored(signal))
            sigaction(signal, &action, nullptr);
    action.sa_flags = SA_SIGINFO;
    action.sa_sigaction = onPipe;
    if (!isIgnored(SIGPIPE))
        sigaction(SIGPIPE, &action, nullptr);
    std::signal(SIGXFSZ, SIG_IGN); // a file beyond `ulimit -f` is then a failed write
}

bool isInterrupted() {
    return interruptSignal != 0;
}

int caughtSignal() {
    return interruptSignal;
}

void checkInterrupted() {
    if (isInterrupted())
        throw Interrupted{int(interruptSignal)};
}

void pollLoops(double fraction) {
    checkInterrupted();
    if (fraction < 0)
        return;
    const std::unique_lock lock(barMutex, std::try_to_lock);
    if (lock && !bars.empty() && bars.back()->followsLoops())
        bars.back()->update(fraction);
}

std::ostream& Console::people() const {
    const std::lock_guard lock(barMutex);
    clearBar();
    static PrintableBuffer outBuffer(std::cout), errBuffer(std::cerr);
    static std::ostream out(&outBuffer), err(&errBuffer);
    for (std::ostream* stream : {&out, &err})
        stream->exceptions(
            std::ios::badbit); // or a std::bad_alloc of the buffer would be swallowed
    return json_ ? err : out;
}

void Console::note(const std::string& text) const {
    if (listener_.note) {
        listener_.note(text);
        return;
    }
    const std::lock_guard lock(barMutex);
    clearBar();
    lastLine = std::chrono::steady_clock::now();
    std::cerr << printableLine(text) << std::endl;
}

void Console::emit(const Json& object) const {
    if (json_)
        std::cout << jsonText(object) << std::flush;
}

Progress Console::progress(const std::string& what) const {
    if (listener_.progress)
        return [what, tell = listener_.progress](double fraction) { tell(what, fraction); };
    auto bar = std::make_shared<Bar>(what, false, lineIntervalS_);
    return [bar](double fraction) {
        checkInterrupted();
        const std::lock_guard lock(barMutex);
        bar->update(fraction);
    };
}

std::shared_ptr<void> Console::step(const std::string& what) const {
    checkInterrupted();
    if (listener_.note || listener_.progress)
        return nullptr;
    return std::make_shared<Bar>(what, true, lineIntervalS_);
}

} // namespace shadowdag
