// SPDX-License-Identifier: Apache-2.0
#include "tools/report/report_package.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "tools/settings/json_file.h"

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>

extern char** environ;

namespace shadowdag {

namespace {

// Debian's own: another python in the path may lack the packages.
constexpr const char* kPython = "/usr/bin/python3";
constexpr const char* kPackage = "shadowdag_report";
// The exit statuses of the package when the data are insufficient and when it cannot write; it has
// printed the reason in one line.
constexpr int kRefused = 3, kUnwritten = 4;
// Prints the Debian packages of the Python modules that are missing; fails with a line about one
// that is there and cannot be loaded, as where memory or files are short.
constexpr const char* kFindMissing = R"(
import importlib, os, sys
os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # warnings of what is there
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        print(" python3-" + name, end="")
    except Exception as error:
        print(f"\n{name}: {type(error).__name__}: {error}")
        sys.exit(1)
)";

/// Returns the last line of what a program said: warnings come before it.
std::string lastLine(std::string said) {
    said.erase(said.find_last_not_of('\n') + 1);
    const size_t line = said.find_last_of('\n');
    return line == std::string::npos ? said : said.substr(line + 1);
}

/// Ends a program: it may remove its partial files for a quarter of a second.
void endProgram(pid_t child) {
    kill(child, SIGTERM);
    for (int i = 0; i < 25; ++i) {
        if (waitpid(child, nullptr, WNOHANG) != 0)
            return;
        usleep(10000);
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
}

/// Returns the path of the package: beside the program, or in ../share/shadowdag once installed; ""
/// if it is missing.
std::string packagePath() {
    const std::filesystem::path directory = programDirectory();
    for (const std::filesystem::path& candidate :
         {directory / kPackage, directory.parent_path() / "share" / "shadowdag" / kPackage})
        if (std::filesystem::exists(candidate / "__main__.py"))
            return candidate.string();
    return "";
}

/// Returns a message about what is missing for pages, and for charts if they are drawn, with the
/// remedy; "" for nothing. Throws Error kResource where what is needed is there and cannot be
/// loaded.
std::string whatIsMissing(const std::string& path, bool drawsCharts) {
    if (path.empty())
        return std::string(kPackage) + " is missing beside " + programDirectory() +
               "/shadowdag; build or install the program again";
    std::vector<std::string> command{kPython, "-c", kFindMissing, "jinja2"};
    if (drawsCharts)
        command.push_back("matplotlib");
    std::string packages;
    const int status = runProgram(command, &packages);
    if (!std::filesystem::exists(kPython)) {
        packages = " python3 python3-jinja2 python3-matplotlib";
    } else if (status != 0) {
        const bool isOfFiles = saysTooManyFiles(packages);
        const char* const home = std::getenv("PYTHONHOME");
        const std::string text =
            std::string(kPython) + " cannot load Jinja2" + (drawsCharts ? " or matplotlib" : "") +
            " (status " + std::to_string(status) + "): " + lastLine(packages) + "; " +
            (isOfFiles         ? kMoreFilesRemedy
             : home != nullptr ? "unset PYTHONHOME, which is '" + std::string(home) +
                                     "' and where Python then looks for its own modules"
                               : "free memory, or install its packages again");
        if (drawsCharts || isOfFiles)
            throw Error(ErrorKind::kResource, text);
        return text;
    }
    return packages.empty()
               ? ""
               : std::string(drawsCharts ? "charts need " : "the page needs ") + kPython +
                     " with Jinja2" + (drawsCharts ? " and matplotlib" : "") + ": apt-get install" +
                     packages;
}

/// Reports and removes the whole lines of progress in a text.
void takeProgress(std::string& text, const Progress& progress) {
    for (size_t begin; (begin = text.find(kProgressMark)) != std::string::npos;) {
        const size_t end = text.find('\n', begin);
        if (end == std::string::npos)
            return;
        const double share = std::strtod(text.c_str() + begin + 1, nullptr);
        text.erase(begin, end + 1 - begin);
        progress(std::clamp(share, 0.0, 1.0));
    }
}

} // namespace

std::string programDirectory() {
    std::error_code ignored;
    return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path().string();
}

int runProgram(const std::vector<std::string>& arguments, std::string* errorText,
               const Progress& progress) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str())); // execve does not write to them
    argv.push_back(nullptr);
    std::vector<char*> variables;
    for (char** variable = environ; *variable != nullptr; ++variable)
        variables.push_back(*variable);
    char asksForProgress[] = "SHADOWDAG_PROGRESS=1";
    if (progress)
        variables.push_back(asksForProgress);
    variables.push_back(nullptr);
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
        const int error = errno;
        refuseTooManyFiles(arguments.front(), error);
        throw Error(ErrorKind::kResource, arguments.front() + ": cannot be started: " +
                                              std::strerror(error) + "; close some programs");
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    pid_t child = 0;
    const int failed =
        posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), variables.data());
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    std::string text;
    char buffer[4096];
    try {
        for (ssize_t count = 1; failed == 0 && count != 0;) {
            pollfd waits{ends[0], POLLIN, 0};
            while (poll(&waits, 1, 100) <= 0)
                checkInterrupted();
            count = read(ends[0], buffer, sizeof buffer);
            if (count > 0)
                text.append(buffer, size_t(count));
            else if (count < 0 && errno != EINTR)
                break;
            if (progress)
                takeProgress(text, progress);
        }
    } catch (...) { // interrupted
        close(ends[0]);
        endProgram(child);
        throw;
    }
    close(ends[0]);
    if (errorText != nullptr)
        *errorText = text;
    refuseTooManyFiles(arguments.front(), failed);
    if (failed == EAGAIN || failed == ENOMEM)
        throw Error(ErrorKind::kResource, arguments.front() +
                                              ": cannot be started: " + std::strerror(failed) +
                                              "; raise the limits of the shell (ulimit -u, "
                                              "ulimit -v), or close some programs");
    if (failed != 0)
        return 127;
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    checkInterrupted();
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

ReportPackage::ReportPackage(bool drawsCharts, const Console& console, const std::string& remedy)
    : path_(packagePath()), drawsCharts_(drawsCharts), console_(console) {
    const std::string missing = whatIsMissing(path_, drawsCharts);
    if (missing.empty())
        return;
    if (drawsCharts)
        throw Error(ErrorKind::kUsage, missing + (remedy.empty() ? "" : ", or " + remedy));
    console.note("the page is omitted: " + missing);
    path_.clear();
}

ReportPackage::ReportPackage(const std::string& remedy)
    : path_(packagePath()), drawsCharts_(false) {
    const std::string missing = whatIsMissing(path_, false);
    if (!missing.empty())
        throw Error(ErrorKind::kUsage, missing + ", or " + remedy);
}

ReportPackage ReportPackage::forPages(const std::string& remedy) {
    return ReportPackage(remedy);
}

Json ReportPackage::writePage(const std::string& name, const std::string& directory) const {
    if (hasPage() && drawsCharts_)
        run({name, directory});
    else if (hasPage())
        run({name, directory, "--no-charts"});
    if (const std::string page = directory + "/index.html";
        hasPage() && !std::filesystem::exists(page))
        throw Error(ErrorKind::kResource, path_ + ": " + name +
                                              " reported success but did not write " + page +
                                              "; does PYTHONPATH lead to another copy of the "
                                              "package?");
    const std::string charts = directory + "/charts/charts.json";
    return std::filesystem::exists(charts) ? readJsonFile(charts, "make the report again")
                                           : Json{{"charts", Json::array()}};
}

void ReportPackage::run(const std::vector<std::string>& arguments) const {
    runReportPackage(path_, arguments, console_ ? console_->progress("charts") : Progress{});
}

void runReportPackage(const std::string& path, const std::vector<std::string>& arguments,
                      const Progress& progress) {
    std::vector<std::string> command{kPython, path};
    command.insert(command.end(), arguments.begin(), arguments.end());
    std::string said;
    const int status = runProgram(command, &said, progress);
    if (status == 0)
        return;
    if (saysTooManyFiles(said)) // whatever it was doing
        throw Error(ErrorKind::kResource, path + ": " + arguments.front() + " failed: " +
                                              lastLine(said) + "; " + kMoreFilesRemedy);
    if (said.size() > 1500)
        said = "..." + said.substr(said.size() - 1500);
    if (status == kRefused || status == kUnwritten)
        throw Error(status == kRefused ? ErrorKind::kInput : ErrorKind::kResource, lastLine(said));
    throw Error(ErrorKind::kResource, path + ": " + arguments.front() + " failed with status " +
                                          std::to_string(status) + ": " + said);
}

std::vector<std::string> leftOutLines(const Json& charts) {
    std::vector<std::string> lines;
    for (const Json& figure : charts.value("left_out", Json::array()))
        lines.push_back("figure " + std::to_string(figure["figure"].get<int>()) + " of " +
                        figure["scene"].get<std::string>() + " is omitted: it needs " +
                        figure["needs"].get<std::string>());
    return lines;
}

} // namespace shadowdag
