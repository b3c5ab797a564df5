// SPDX-License-Identifier: Apache-2.0
// Reads JSON files: a user's with messages that name the file and the place, the program's own
// without. No other code parses JSON, so that nothing nests deeper than the stack allows.
#pragma once

#include "tools/settings/json.h"

#include <cstdint>
#include <string>

namespace shadowdag {

/// Objects and lists nest at most this deep: writing a value, as messages do, is recursive.
constexpr int kMaxJsonDepth = 100;
/// No JSON file of a user is larger, and none of the program's own: its journals and parts grow
/// with the lights of all runs.
constexpr uint64_t kMaxJsonBytes = uint64_t(1) << 29, kMaxOwnJsonBytes = uint64_t(1) << 32;

/// Returns the content of a JSON file, or of a pipe. Throws Error kInput, beginning with the path
/// and ending in `remedy`, for a directory or a device, a file that cannot be opened or is larger
/// than maxBytes, one that is truncated, text that is not JSON or nests deeper than
/// kMaxJsonDepth (line and column), a duplicate key in one object, because readers of JSON differ
/// in which one they use, and a text with a zero byte, which would end a message and the name of a
/// file. Throws also what readInput throws: Error kResource for too many open files, and what
/// pollCpu throws while it waits for a pipe.
/// @param remedy the kind of file to give, as in "give a cost file"
Json readJsonFile(const std::string& path, const std::string& remedy,
                  uint64_t maxBytes = kMaxJsonBytes);

/// The same for text. @param where prefix of messages
Json parseJson(const std::string& text, const std::string& where, const std::string& remedy);

/// Returns the value of a text that this program may have written; a discarded one (is_discarded())
/// when it is not JSON or nests deeper than kMaxJsonDepth.
/// @param maxDepth less than what the stack allows for the use of the value
Json parseOwnJson(const std::string& text, int maxDepth = kMaxJsonDepth);

/// The same for a regular file of at most kMaxOwnJsonBytes; null when there is none. Throws Error
/// kResource for one that cannot be read. Polls nothing.
Json readOwnJsonFile(const std::string& path);

/// Returns a value as one line for messages and hashes; bytes that are not UTF-8 become U+FFFD.
std::string jsonLine(const Json& value);

} // namespace shadowdag
