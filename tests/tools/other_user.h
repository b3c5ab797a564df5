// SPDX-License-Identifier: Apache-2.0
// Functions that a test runs as another user.
#pragma once

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <string>
#include <vector>

namespace shadowdag {

/// A user, and the user's own group, that own nothing.
constexpr id_t kNobody = 65534;

/// Returns what a function that returns a text returns to another user, in a process of its own;
/// the text of an exception if it throws one. Only root can be another user.
/// @param groups all of the user's, the first as the primary one
template <class F>
std::string asUser(uid_t user, const std::vector<gid_t>& groups, const F& function) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        std::string text = "still root";
        try {
            if (setgroups(groups.size(), groups.data()) == 0 && setgid(groups[0]) == 0 &&
                setuid(user) == 0)
                text = function();
        } catch (const std::exception& exception) {
            text = exception.what();
        }
        _exit(write(ends[1], text.data(), text.size()) == ssize_t(text.size()) ? 0 : 1);
    }
    close(ends[1]);
    std::string text(4096, '\0');
    text.resize(size_t(std::max<ssize_t>(0, read(ends[0], text.data(), text.size()))));
    close(ends[0]);
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
    return text;
}

template <class F> std::string asNobody(const F& function) {
    return asUser(kNobody, {kNobody}, function);
}

} // namespace shadowdag
