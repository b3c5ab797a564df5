// SPDX-License-Identifier: Apache-2.0
// What the program says, and the exit status it ends with, when an exception leaves a subcommand.
#pragma once

#include <exception>
#include <string>

namespace shadowdag {

/// The exit status of a mistake in the program itself; ErrorKind has those that users can mend.
constexpr int kDefectExitStatus = 6;

struct ExitMessage {
    std::string message;
    int status;
};

/// Returns the message and the status of an exception: of an Error its own; kResource for memory
/// that is not there; kDefectExitStatus for a std::logic_error, which nothing that a user gives may
/// cause; kInput for all others, which libraries throw at what they read.
ExitMessage exitMessageOf(const std::exception& exception);

} // namespace shadowdag
