// SPDX-License-Identifier: Apache-2.0
// Opens what a user named for reading: regular files, and pipes where they are meant, within a
// stated size.
#pragma once

#include "cuda/error.h"

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shadowdag {

/// What a reader takes.
struct InputLimits {
    uint64_t maxBytes;      ///< nothing larger is read
    bool mayBePipe = false; ///< a pipe is read to its end, as in --costs <(make_costs)
    bool polls = true;      ///< reading can be cancelled (pollCpu)
};

/// Returns the content of a file, whatever size the system states, or nothing and in `why` the
/// reason: "is a directory", "is a device", "cannot be opened: Permission denied". Never waits to
/// open a pipe, nor for the content of what is no pipe, as /proc/kmsg. Throws what
/// refuseTooManyFiles throws. If `limits.polls`, it throws what pollCpu throws while it waits for
/// content, and warns after a second of waiting for the first byte of a pipe.
std::optional<std::string> readInput(const std::string& path, const InputLimits& limits,
                                     std::string& why);
/// Returns the same as bytes.
std::optional<std::vector<uint8_t>> readInputBytes(const std::string& path,
                                                   const InputLimits& limits, std::string& why);

/// Returns why a path is not a regular file of 1 to `maxBytes` bytes that exists and may be read;
/// "" if it is. Files of /proc have 0 bytes, and reading one may wait without end. Opens nothing.
/// @param mayBeEmpty 0 bytes are no reason: the caller reads no more than the file's size
std::string whyNoInput(const std::string& path, uint64_t maxBytes, bool mayBeEmpty = false);

/// The remedy of too many open files.
constexpr const char* kMoreFilesRemedy =
    "raise the limit of the shell (ulimit -n), or close some programs";

/// Thrown where the process or the system has too many open files; of kind kResource.
class TooManyFiles : public Error {
public:
    using Error::Error;
};

/// Throws TooManyFiles where a file could not be opened for that reason: then the file is not to
/// blame. @param error errno of the opening
void refuseTooManyFiles(const std::string& path, int error);

/// Returns whether the words of a library or a program say that too many files are open: those of
/// the C library, or those of the loader, which has no text of errors yet.
bool saysTooManyFiles(std::string_view said);

/// Returns a file that is opened for reading, binary. Throws what refuseTooManyFiles throws; if it
/// cannot be opened for another reason, errno holds that reason.
std::ifstream openInput(const std::string& path);

} // namespace shadowdag
