// SPDX-License-Identifier: Apache-2.0
// The file that an output's name leads to.
#pragma once

#include <string>

namespace shadowdag {

/// Returns the path that a name leads to through its symbolic links, whether a file is there or
/// not. Throws Error kResource for a loop of links, for a link to a file of another extension,
/// which may be an input of the same command, and for what must not be replaced, as a complete file
/// is renamed to its place: a pipe, a socket, a device, a file that a link in /dev or /proc leads
/// to, as /dev/stdout does, and a file that this user may not write or that nobody may, not even
/// root.
std::string outputTarget(const std::string& path);

} // namespace shadowdag
