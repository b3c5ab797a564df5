// SPDX-License-Identifier: Apache-2.0
// Sends a signal to a program and measures how soon it ends, as on an idle machine: what the system
// tells of the time for which it could not run, because others did, is subtracted.
#pragma once

#include "tests/tools/program/program_runner.h"

#include <sched.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <ostream>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace shadowdag::test {

/// Returns the processes that descend from this one.
inline std::vector<pid_t> descendants() {
    std::map<pid_t, pid_t> parents;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        std::ifstream file(entry.path() / "stat"); // "pid (name) state parent ..."
        std::string line, state;
        std::getline(file, line);
        std::istringstream words(line.substr(line.rfind(')') + 1));
        const pid_t process = std::atoi(entry.path().filename().c_str()); // 0: no process
        if (pid_t parent = 0; process > 0 && words >> state >> parent)
            parents[process] = parent;
    }
    std::vector<pid_t> result;
    for (const auto& [process, parent] : parents) {
        pid_t ancestor = parent;
        while (ancestor != getpid() && parents.contains(ancestor))
            ancestor = parents[ancestor];
        if (ancestor == getpid())
            result.push_back(process);
    }
    return result;
}

/// What used the cores, and which time threads of the descendants spent without one, from its
/// construction on.
class CoreUse {
public:
    using Clock = std::chrono::steady_clock;

    CoreUse() : processes_(descendants()) {
        sample();
        intervals_.clear();
        threadsS_ = 0;
        before_ = all();
        begin_ = Clock::now();
    }
    /// Each thread tells how long it waited until it ends: to be called every few milliseconds.
    void sample() {
        for (const pid_t process : processes_) {
            std::error_code gone;
            using Tasks = std::filesystem::directory_iterator;
            for (Tasks task("/proc/" + std::to_string(process) + "/task", gone);
                 !gone && task != Tasks(); task.increment(gone)) {
                std::ifstream file(task->path() / "schedstat"); // "ns on a core, ns waiting, runs"
                long coreNs = 0, waitNs = 0;
                if (!(file >> coreNs >> waitNs))
                    continue;
                const Clock::time_point now = Clock::now();
                auto& [coreBeforeNs, waitBeforeNs] = threads_[task->path()];
                intervals_.emplace_back(now - std::chrono::nanoseconds(waitNs - waitBeforeNs), now);
                threadsS_ += 1e-9 * double(coreNs - coreBeforeNs);
                coreBeforeNs = coreNs;
                waitBeforeNs = waitNs;
            }
        }
    }
    double wallS() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
    /// Returns the seconds of cores that other processes and other guests of the machine used.
    double otherS() const {
        const Cores now = all();
        return std::max(0.0, now.busyS - before_.busyS - threadsS_ - (now.selfS - before_.selfS));
    }
    /// Returns the seconds for which one of the threads waited for a core.
    double waitedS() {
        std::sort(intervals_.begin(), intervals_.end());
        double result = 0;
        Clock::time_point end = begin_;
        for (const auto& [first, last] : intervals_)
            if (last > end) {
                result += std::chrono::duration<double>(last - std::max(first, end)).count();
                end = last;
            }
        return result;
    }
    /// Returns the seconds that other guests took from the threads: as large a share as of all that
    /// ran.
    double stolenS() const {
        const Cores now = all();
        const double stolenS = now.stolenS - before_.stolenS,
                     ranS = now.busyS - before_.busyS - stolenS;
        return ranS > 0 ? threadsS_ * stolenS / ranS : 0;
    }

private:
    /// Seconds of all cores together.
    struct Cores {
        double busyS = 0, stolenS = 0; ///< the first includes the second
        double selfS = 0;              ///< of this process, which measures
    };
    /// Of the cores that this process may use, by /proc/stat:
    /// "cpuN user nice system idle iowait irq softirq steal ...".
    static Cores all() {
        timespec self{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &self);
        Cores result;
        result.selfS = double(self.tv_sec) + 1e-9 * double(self.tv_nsec);
        cpu_set_t usable;
        CPU_ZERO(&usable);
        sched_getaffinity(0, sizeof usable, &usable);
        std::ifstream file("/proc/stat");
        for (std::string line; std::getline(file, line) && line.starts_with("cpu");) {
            std::istringstream words(line.substr(3));
            size_t core = 0;
            double user, nice, system, idle, ioWait, irq, softIrq, steal;
            if (line[3] == ' ' || !(words >> core) || core >= CPU_SETSIZE ||
                !CPU_ISSET(core, &usable) ||
                !(words >> user >> nice >> system >> idle >> ioWait >> irq >> softIrq >> steal))
                continue;
            const double tickS = 1.0 / double(sysconf(_SC_CLK_TCK));
            result.busyS += tickS * (user + nice + system + irq + softIrq + steal);
            result.stolenS += tickS * steal;
        }
        return result;
    }

    std::vector<pid_t> processes_;
    std::map<std::filesystem::path, std::pair<long, long>> threads_; ///< ns on a core, ns waiting
    std::vector<std::pair<Clock::time_point, Clock::time_point>> intervals_; ///< without a core
    double threadsS_ = 0; ///< of cores, by the threads
    Cores before_;
    Clock::time_point begin_;
};

struct EndBySignal {
    int status = -1;    ///< exit status; 128 + signal when killed, by SIGKILL after half a minute
    double seconds = 0; ///< how soon it ended on an idle machine
    double wallSeconds = 0, otherSeconds = 0;    ///< how soon it ended here; core seconds of others
    double waitedSeconds = 0, stolenSeconds = 0; ///< its own without a core: by others, by guests
};

inline std::ostream& operator<<(std::ostream& out, const EndBySignal& end) {
    return out << end.wallSeconds << " s here, where others used " << end.otherSeconds
               << " s; it waited for a core for " << end.waitedSeconds
               << " s, and other guests took " << end.stolenSeconds << " s from it";
}

/// Sends a signal to a child and waits for its end. On an idle machine its seconds are those of the
/// wall. Beside others, seconds are subtracted for which a thread of the child or of a process that
/// it may wait for (a descendant of this process) could run, but a core did not: at most as many
/// as others used. Those for which it sleeps or waits for a disk count.
inline EndBySignal endBySignal(pid_t child, int signal) {
    constexpr double kGivenUpSeconds = 30;
    CoreUse use;
    EndBySignal result;
    kill(child, signal);
    for (siginfo_t ended{}; ended.si_pid != child;) {
        std::this_thread::sleep_for(std::chrono::milliseconds(4));
        waitid(P_PID, id_t(child), &ended, WEXITED | WNOHANG | WNOWAIT);
        result.wallSeconds = use.wallS();
        use.sample();
        if (result.wallSeconds > kGivenUpSeconds)
            kill(child, SIGKILL);
    }
    result.otherSeconds = use.otherS();
    result.waitedSeconds = use.waitedS();
    result.stolenSeconds = use.stolenS();
    result.seconds = result.wallSeconds -
                     std::min(result.waitedSeconds + result.stolenSeconds, result.otherSeconds);
    result.status = waitForProgram(child);
    return result;
}

} // namespace shadowdag::test
