// SPDX-License-Identifier: Apache-2.0
// Reads a user's JSON files with messages that name the file and the place.
#pragma once

#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns the content of a JSON file. Throws Error kInput, beginning with the path and ending in
/// `remedy`, for a directory, a file that cannot be opened, one that is truncated, text that is not
/// JSON (line and column), and a duplicate key in one object, because readers of JSON differ in
/// which one they use.
/// @param remedy the kind of file to give, as in "give a cost file"
Json readJsonFile(const std::string& path, const std::string& remedy);

/// The same for text. @param where prefix of messages
Json parseJson(const std::string& text, const std::string& where, const std::string& remedy);

/// Returns a value as one line for messages and hashes; bytes that are not UTF-8 become U+FFFD.
std::string jsonLine(const Json& value);

} // namespace shadowdag
