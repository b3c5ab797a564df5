// SPDX-License-Identifier: Apache-2.0
#include "tools/report/charts_run.h"

#include "cuda/error.h"
#include "tools/settings/console.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

extern char** environ;

namespace shadowdag {

namespace {

// Debian's own: another python on the path may lack matplotlib.
constexpr const char* kPython = "/usr/bin/python3";
// What figures.py exits with when the results do not hold what was asked for, and when it cannot
// write; it has said why in one line.
constexpr int kRefused = 3, kUnwritten = 4;

} // namespace

std::string programDirectory() {
    std::error_code ignored;
    return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path().string();
}

int runProgram(const std::vector<std::string>& arguments, std::string* errorText) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str())); // execve does not write to them
    argv.push_back(nullptr);
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return 127;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    pid_t child = 0;
    const int failed = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    std::string text;
    char buffer[4096];
    for (ssize_t count = 1; failed == 0 && count != 0;) {
        count = read(ends[0], buffer, sizeof buffer);
        if (count > 0)
            text.append(buffer, size_t(count));
        else if (count < 0 && errno != EINTR)
            break;
    }
    close(ends[0]);
    if (errorText != nullptr)
        *errorText = text;
    if (failed != 0)
        return 127;
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    checkInterrupted();
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string findCharts(const std::string& name, const std::string& remedy) {
    const std::string otherwise = remedy.empty() ? "" : ", or " + remedy;
    const std::filesystem::path directory = programDirectory();
    std::string script;
    for (const std::filesystem::path& candidate :
         {directory / name, directory.parent_path() / "share" / "shadowdag" / name})
        if (std::filesystem::exists(candidate) && script.empty())
            script = candidate.string();
    if (script.empty())
        throw Error(ErrorKind::kUsage, name + " is missing beside " + directory.string() +
                                           "/shadowdag; build or install the program again" +
                                           otherwise);
    if (runProgram({kPython, "-c", "import matplotlib"}) != 0)
        throw Error(ErrorKind::kUsage, std::string("charts need ") + kPython +
                                           " with matplotlib: apt-get install python3-matplotlib" +
                                           otherwise);
    return script;
}

void drawCharts(const std::string& script, const std::string& resultsPath,
                const std::string& directory, const std::vector<std::string>& more) {
    std::string said;
    std::vector<std::string> arguments{kPython, script, resultsPath, "-o", directory};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const int status = runProgram(arguments, &said);
    if (status != 0) {
        if (said.size() > 1500)
            said = "..." + said.substr(said.size() - 1500);
        if (status == kRefused || status == kUnwritten) {
            said.erase(said.find_last_not_of('\n') + 1);
            const size_t line = said.find_last_of('\n'); // warnings stand before
            throw Error(status == kRefused ? ErrorKind::kInput : ErrorKind::kResource,
                        line == std::string::npos ? said : said.substr(line + 1));
        }
        throw Error(ErrorKind::kResource, script + ": failed on " + resultsPath + " with status " +
                                              std::to_string(status) + ": " + said);
    }
}

std::vector<std::string> leftOutLines(const Json& charts) {
    std::vector<std::string> lines;
    for (const Json& figure : charts.value("left_out", Json::array()))
        lines.push_back("figure " + std::to_string(figure["figure"].get<int>()) + " of " +
                        figure["scene"].get<std::string>() + " is left out: it needs " +
                        figure["needs"].get<std::string>());
    return lines;
}

} // namespace shadowdag
