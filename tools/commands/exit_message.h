// SPDX-License-Identifier: Apache-2.0
// The message and the exit status of the program when an exception leaves a subcommand.
#pragma once

#include <exception>
#include <string>

namespace shadowdag {

/// The exit status of a mistake in the program itself; ErrorKind has those that users can correct.
constexpr int kDefectExitStatus = 6;

struct ExitMessage {
    std::string message;
    int status;
};

/// Returns the message and the status of an exception: of an Error its own; kResource for
/// std::bad_alloc; kDefectExitStatus for a std::logic_error, which no input may cause; kInput for
/// all others, which libraries throw while they read input. The message may contain control
/// characters of names (printable).
ExitMessage exitMessageOf(const std::exception& exception);

} // namespace shadowdag
