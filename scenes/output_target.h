// SPDX-License-Identifier: Apache-2.0
// The file that an output's name leads to.
#pragma once

#include "scenes/output_file.h"

#include <algorithm>
#include <climits>
#include <cstddef>
#include <string>

namespace shadowdag {

/// Returns how many bytes the name of an output may have in a folder, so that those of unfinished
/// files, which are longer, have room; 0 if they have none there.
/// @param longest name that the folder's file system takes; below 0 if that is unknown
constexpr size_t outputNameBytes(long longest) {
    const size_t bytes = longest < 0 ? NAME_MAX : std::min<size_t>(size_t(longest), NAME_MAX);
    return bytes - std::min(bytes, kTemporarySuffixBytes);
}

/// Returns the path that a name leads to through its symbolic links, whether a file is there or
/// not. Throws Error kResource for a loop of links, for a link to a file of another extension,
/// which may be an input of the same command, for a path that has a file in place of a folder, for
/// one too long for the names that are beside it and in its folder of unfinished work while it is
/// written, and for what must not be replaced, as a complete file is renamed to its place: a pipe,
/// a socket, a device, a file that a link in /dev or /proc leads to, as /dev/stdout does, a file
/// that this user may not write or replace, and one that nobody may write, not even root.
std::string outputTarget(const std::string& path);

/// Throws Error kResource if a file is in the place of a folder of a path that need not exist.
void refuseFileAsFolder(const std::string& path);

} // namespace shadowdag
