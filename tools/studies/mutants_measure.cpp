// SPDX-License-Identifier: Apache-2.0
// Measures a fault here, or in a process of its own.
#include "tools/settings/json_file.h"
#include "tools/studies/mutants.h"
#include "tools/workspace/whole_file.h"

#include "cuda/cancel.h"
#include "cuda/error.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <spawn.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

extern char** environ;

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

/// A directory below the system's for temporary files, removed at the end.
class TemporaryFolder {
public:
    TemporaryFolder() {
        std::error_code missing;
        path_ = (fs::temp_directory_path(missing) / "shadowdag-mutant-XXXXXX").string();
        if (missing || mkdtemp(path_.data()) == nullptr)
            throw Error(ErrorKind::kResource, path_ + ": cannot be made; set TMPDIR to a "
                                                      "directory that can be written");
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::string operator/(const std::string& name) const { return path_ + "/" + name; }

private:
    std::string path_;
};

/// Starts this program with one variable more in its environment; its messages go to a file.
pid_t startSelf(std::vector<std::string> arguments, const std::string& variable,
                const std::string& errors) {
    std::vector<char*> argv, environment;
    for (std::string& argument : arguments)
        argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::string set = variable;
    const std::string prefix = variable.substr(0, variable.find('=') + 1);
    for (char** entry = environ; *entry != nullptr; ++entry)
        if (!std::string_view(*entry).starts_with(prefix))
            environment.push_back(*entry);
    environment.push_back(set.data());
    environment.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t child = -1;
    const int failed =
        posix_spawn(&child, "/proc/self/exe", &actions, nullptr, argv.data(), environment.data());
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        throw Error(ErrorKind::kResource, "study mutants: cannot start a process (error " +
                                              std::to_string(failed) + "); end other programs");
    return child;
}

/// Waits for a process, which it ends when the limit is over or the study is cancelled. Returns
/// whether it ended by itself.
bool waitFor(pid_t child, double limitSeconds, int& status) {
    const auto start = std::chrono::steady_clock::now();
    const auto end = [&] {
        kill(child, SIGKILL);
        waitpid(child, &status, 0);
    };
    while (waitpid(child, &status, WNOHANG) == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        try {
            pollCpu();
        } catch (...) {
            end();
            throw;
        }
        if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() >
            limitSeconds) {
            end();
            return false;
        }
    }
    return true;
}

/// Returns the last line of a file that is not empty, without the directory of a source file.
std::string lastLine(const std::string& path) {
    std::ifstream in(path);
    std::string last;
    for (std::string line; std::getline(in, line);)
        if (!line.empty())
            last = line;
    const size_t colon = last.find(':'), slash = last.rfind('/', colon);
    return colon != std::string::npos && slash != std::string::npos ? last.substr(slash + 1) : last;
}

Json toJson(const std::vector<Notice>& notices) {
    Json list = Json::array();
    for (const Notice& notice : notices)
        list.push_back({{"check", notice.check},
                        {"row", notice.row},
                        {"method", notice.method},
                        {"remedy", notice.remedy},
                        {"count", notice.count}});
    return list;
}

Json resultOf(const MutantRow& row, const CellJudgement& judgement, bool isUsed,
              const std::string& ended) {
    Json json = {{"name", row.name},         {"what", "nothing is wrong"},
                 {"harmless", row.harmless}, {"is_used", isUsed},
                 {"ended", ended},           {"notices", toJson(judgement.notices)},
                 {"cells", judgement.cells}};
    for (const MutantText& text : kMutantTexts)
        if (row.name == text.name)
            json["what"] = text.what;
    return json;
}

} // namespace

Json measureMutant(const MutantTable& table, const MutantRow& row, const StudyRequest& request,
                   const Console& console) {
    CellJudgement all;
    const auto add = [&](const std::vector<Notice>& more) {
        all.notices.insert(all.notices.end(), more.begin(), more.end());
    };
    StudyRequest silent = request;
    silent.pictureDirectory = "";
    silent.progress = {};
    for (size_t i = 0; i < row.judges.size(); ++i) {
        for (const Failure& failure : table.failures)
            if (failure.name == row.judges[i]) {
                const CellJudgement judged = judgeCells(failure, table.slack, silent, console);
                add(judged.notices);
                all.cells.insert(all.cells.end(), judged.cells.begin(), judged.cells.end());
                add(judgeFrames({failure, false}, silent, console));
            }
        for (const MutantFrames& frames : table.frames)
            if (frames.row.name == row.judges[i])
                add(judgeFrames(frames, silent, console));
        if (request.progress)
            request.progress(double(i + 1) / double(row.judges.size()));
    }
#if SDAG_HAS_MUTANTS
    return resultOf(row, all, mutantUseCount() > 0, "");
#else
    return resultOf(row, all, false, "");
#endif
}

Json measureInOwnProcess(const StudyFile& file, const MutantTable& table, const MutantRow& row) {
    const TemporaryFolder folder;
    const std::string study = folder / "mutants.json", report = folder / "report",
                      errors = folder / "errors.txt";
    writeWholeFile(study, jsonText(file.json));
    const pid_t child =
        startSelf({"shadowdag", "study", study, "--only", row.name, "--no-charts", "-o", report},
                  std::string(kMutantVariable) + "=" + row.name, errors);
    int status = 0;
    const bool isInTime = waitFor(child, table.limitSeconds, status);
    const Json results = readOwnJsonFile(report + "/mutants.json");
    if (isInTime && results.is_object() && results.contains("mutants"))
        return results["mutants"].at(0);
    const std::string line = lastLine(errors);
    // Of the machine, not of the fault.
    if (isInTime && WIFEXITED(status) && WEXITSTATUS(status) >= int(ErrorKind::kUsage) &&
        WEXITSTATUS(status) <= int(ErrorKind::kDevice))
        throw Error(ErrorKind(WEXITSTATUS(status)),
                    "the fault '" + row.name + "' cannot be judged; its process said: " + line);
    if (isInTime && WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
        throw Error(ErrorKind::kResource,
                    "the fault '" + row.name +
                        "' cannot be judged: its process was killed; is memory short?");
    const bool isAborted = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
    const char* const check = !isInTime             ? "time"
                              : isAborted           ? "assertion"
                              : WIFSIGNALED(status) ? "crash"
                                                    : "error";
    return resultOf(row, {{{check, "", "", "", 1}}, Json::array()}, true, isInTime ? line : "");
}

} // namespace shadowdag
