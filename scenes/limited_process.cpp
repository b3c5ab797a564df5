// SPDX-License-Identifier: Apache-2.0
#include "scenes/limited_process.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "scenes/input_file.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace shadowdag {

namespace {

constexpr int kUncaught = 255;

/// Returns what counts for RLIMIT_DATA ("VmData:", which statm gives with the stack) or RLIMIT_AS
/// ("VmSize:") of this process already; 0 if that cannot be read. Source: proc(5), "status".
uint64_t ownBytes(const std::string& field) {
    std::ifstream file = openInput("/proc/self/status");
    uint64_t kibibytes = 0;
    for (std::string word; kibibytes == 0 && file >> word;)
        if (word == field)
            file >> kibibytes;
    return kibibytes << 10;
}

/// Returns the command that raises the shell's limit of memory, if that is below those of work.
std::string tighterLimitOfShell(const ProcessLimits& limits, uint64_t dataBytes) {
    struct rlimit data {
    }, space{};
    getrlimit(RLIMIT_DATA, &data);
    getrlimit(RLIMIT_AS, &space);
    if (data.rlim_cur < dataBytes + limits.memoryBytes)
        return "ulimit -d";
    return space.rlim_cur < ownBytes("VmSize:") + limits.memoryBytes ? "ulimit -v" : "";
}

/// Sets up the process that reads: files, signals, limits. Moves `out` from the standard streams.
void confine(int& out, pid_t parent, const ProcessLimits& limits, uint64_t dataBytes) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent)
        _exit(kUncaught);
    for (int signal = 1; signal < NSIG; ++signal)
        ::signal(signal, SIG_DFL);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) // the parent ends both
        ::signal(signal, SIG_IGN);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    if (out <= STDERR_FILENO)
        out = fcntl(out, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    ::dup2(null, STDIN_FILENO);
    ::dup2(null, STDOUT_FILENO);
#if !defined(SDAG_SANITIZED) // whose reports go there
    ::dup2(null, STDERR_FILENO);
    lowerLimit(RLIMIT_DATA, dataBytes + limits.memoryBytes);
#else
    (void)dataBytes;
#endif
    if (out > STDERR_FILENO + 1)
        close_range(STDERR_FILENO + 1, unsigned(out) - 1, 0);
    close_range(unsigned(out) + 1, ~0u, 0);
    lowerLimit(RLIMIT_CPU, limits.cpuSeconds);
    lowerLimit(RLIMIT_CORE, 0);
}

void writeAll(int fd, const void* data, size_t byteCount) {
    for (const char* at = static_cast<const char*>(data); byteCount > 0;) {
        const ssize_t written = ::write(fd, at, byteCount);
        if (written < 0 && errno != EINTR)
            _exit(kUncaught);
        at += std::max<ssize_t>(written, 0);
        byteCount -= size_t(std::max<ssize_t>(written, 0));
    }
}

/// A process that is killed if it still runs, and the end from which its output is read.
class LimitedChild {
public:
    LimitedChild(pid_t process, int in) : process_(process), in_(in) {}
    ~LimitedChild() {
        ::close(in_);
        if (process_ > 0) {
            kill(process_, SIGKILL);
            wait();
        }
    }
    LimitedChild(const LimitedChild&) = delete;
    LimitedChild& operator=(const LimitedChild&) = delete;

    /// Returns its output up to the limit.
    std::string readOutput(uint64_t maxBytes) const {
        std::string output;
        char part[1 << 16];
        for (;;) {
            pollCpu();
            struct pollfd ready = {in_, POLLIN, 0};
            if (::poll(&ready, 1, 50) <= 0)
                continue;
            const ssize_t got = ::read(in_, part, sizeof part);
            if (got == 0 || (got < 0 && errno != EINTR) || output.size() > maxBytes)
                return output;
            output.append(part, size_t(std::max<ssize_t>(got, 0)));
        }
    }

    /// Returns its status as waitpid gives it.
    int wait() {
        int status = 0;
        while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
        }
        process_ = 0;
        return status;
    }
    void end() const { kill(process_, SIGKILL); }

private:
    pid_t process_;
    int in_;
};

} // namespace

void lowerLimit(int resource, uint64_t value) {
    struct rlimit limit {};
    getrlimit(__rlimit_resource(resource), &limit);
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, value);
    setrlimit(__rlimit_resource(resource), &limit);
}

ProcessEnd runInProcess(const std::string& what, const ProcessLimits& limits,
                        const std::function<int(const ByteSink& write)>& work) {
    const uint64_t dataBytes = ownBytes("VmData:");
    int ends[2] = {};
    const bool hasPipe = pipe2(ends, O_CLOEXEC) == 0;
    if (!hasPipe)
        refuseTooManyFiles(what, errno);
    const pid_t parent = getpid();
    const pid_t child = hasPipe && dataBytes > 0 ? fork() : -1;
    if (child < 0) {
        const int error = errno;
        if (hasPipe) {
            ::close(ends[0]);
            ::close(ends[1]);
        }
        throw Error(ErrorKind::kResource,
                    what + ": cannot start a process to read it: " +
                        (dataBytes > 0 ? std::strerror(error)
                                       : "/proc/self/status cannot be read; is /proc mounted?"));
    }
    if (child == 0) {
        int status = kUncaught, out = ends[1];
        try {
            confine(out, parent, limits, dataBytes);
            status =
                work([&](const void* data, size_t byteCount) { writeAll(out, data, byteCount); });
        } catch (...) { // kUncaught says so
        }
        _exit(status);
    }
    ::close(ends[1]);
    LimitedChild reader(child, ends[0]);
    ProcessEnd end;
    end.tighterMemoryLimit = tighterLimitOfShell(limits, dataBytes);
    end.output = reader.readOutput(limits.outputBytes);
    end.wroteTooMuch = end.output.size() > limits.outputBytes;
    if (end.wroteTooMuch)
        reader.end();
    const int status = reader.wait();
    end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    end.status = WIFEXITED(status) ? WEXITSTATUS(status) : kUncaught;
    return end;
}

} // namespace shadowdag
