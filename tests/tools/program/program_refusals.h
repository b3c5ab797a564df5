// SPDX-License-Identifier: Apache-2.0
// Expectations shared by all tests of wrong uses of the program.
#pragma once

#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

/// A wrong use of the program and what it must say of it.
struct Wrong {
    std::vector<std::string> arguments;
    int status;
    std::string message; ///< part of standard error
};

/// Expects each to end with its status and an error that holds its message, and nothing on standard
/// output.
inline void expectRefused(const TemporaryDirectory& directory, const std::vector<Wrong>& cases) {
    for (const Wrong& wrong : cases) {
        const ProgramResult result = runShadowdag(directory, wrong.arguments);
        std::string command;
        for (const std::string& argument : wrong.arguments)
            command += argument + " ";
        EXPECT_EQ(result.status, wrong.status) << command << "\n" << result.err;
        EXPECT_THAT(result.err, testing::HasSubstr(wrong.message)) << command;
        EXPECT_THAT(result.err, testing::HasSubstr("shadowdag: error: ")) << command;
        EXPECT_THAT(result.out, testing::IsEmpty()) << command;
    }
}

} // namespace shadowdag
