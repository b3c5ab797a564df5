// SPDX-License-Identifier: Apache-2.0
// What a message advises where a file or a folder could not be written.
#pragma once

#include <string>

namespace shadowdag {

/// Returns the remedy of a failed write, creation or rename, without a full stop.
/// @param error errno of the call; 0 if unknown
std::string writeRemedy(int error);

/// Returns why this user may not write to a file, or into a folder, that exists, with a remedy that
/// this user can apply: "it is read-only; make it writable (chmod u+w) or name another file"; "" if
/// this user may. A file that nobody may write is refused to root, too, as is a deleted folder.
std::string whyNotWritable(const std::string& path);

/// Returns why this user may not replace a file that exists and may be written, as whyNotWritable
/// does: it belongs to another user, in a folder whose files only their owners may replace (sticky,
/// as /tmp).
std::string whyNotReplaceable(const std::string& path);

} // namespace shadowdag
