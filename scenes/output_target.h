// SPDX-License-Identifier: Apache-2.0
// The file that an output's name leads to.
#pragma once

#include <string>

namespace shadowdag {

/// Returns the path that a name leads to through its symbolic links, whether a file is there or
/// not. Throws Error kResource for a loop of links, and for what must not be replaced, as a
/// complete file is renamed to its place: a pipe, a socket, a device, and a file that a link in
/// /dev or /proc leads to, as /dev/stdout does.
std::string outputTarget(const std::string& path);

} // namespace shadowdag
