// SPDX-License-Identifier: Apache-2.0
// Runs the built program and keeps its output.
#pragma once

#include "tests/tools/temporary_directory.h"
#include "tools/settings/json.h"

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <vector>

extern char** environ;

#if !defined(SDAG_PROGRAM)
/// The program under test: the targets define where it was built, else the one on the PATH.
#define SDAG_PROGRAM "shadowdag"
#endif

namespace shadowdag {

/// The words after the program's name.
using Arguments = std::vector<std::string>;

inline Arguments operator+(Arguments a, const Arguments& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

struct ProgramResult {
    int status = -1; ///< exit status; 128 + signal when killed
    std::string out;
    std::string err;

    Json json() const { return Json::parse(out); }
};

/// Starts the program with a cache of its own, so that tests neither read nor leave anything in the
/// user's.
/// @param before the words before the program's: another program that starts it
inline pid_t startProgram(const TemporaryDirectory& directory,
                          const std::vector<std::string>& arguments, const std::string& outPath,
                          const std::string& errPath, const std::vector<std::string>& before = {}) {
    std::vector<std::string> texts = before;
    texts.push_back(SDAG_PROGRAM);
    texts.insert(texts.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& text : texts)
        argv.push_back(text.data());
    argv.push_back(nullptr);
    setenv("XDG_CACHE_HOME", directory.path().c_str(), 1);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, outPath.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errPath.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t child = -1;
    // A shell that runs the tests in the background ignores these, which the program inherits.
    sigset_t defaults;
    sigemptyset(&defaults);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXCPU})
        sigaddset(&defaults, signal);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawn(&child, argv[0], &actions, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return child;
}

inline int waitForProgram(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

inline ProgramResult runShadowdag(const TemporaryDirectory& directory,
                                  const std::vector<std::string>& arguments,
                                  const std::vector<std::string>& before = {}) {
    ProgramResult result;
    const std::string out = directory / "program.out", err = directory / "program.err";
    result.status = waitForProgram(startProgram(directory, arguments, out, err, before));
    result.out = readText(out);
    result.err = readText(err);
    return result;
}

} // namespace shadowdag
