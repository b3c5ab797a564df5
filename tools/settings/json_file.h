// SPDX-License-Identifier: Apache-2.0
// JSON that users give, read with complaints that name the file and the place.
#pragma once

#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// Returns what a JSON file holds. Throws Error kInput, headed by the path and ending in `remedy`,
/// for a directory, a file that cannot be opened, one that ends too early, text that is no JSON
/// (line and column), and a key that stands twice in one object: which of the two holds, readers of
/// JSON disagree about.
/// @param remedy what to give instead, as in "give a cost file"
Json readJsonFile(const std::string& path, const std::string& remedy);

/// The same of text. @param where heads complaints
Json parseJson(const std::string& text, const std::string& where, const std::string& remedy);

/// Returns a value as one line for complaints and hashes; bytes that are not UTF-8 become U+FFFD.
std::string jsonLine(const Json& value);

} // namespace shadowdag
