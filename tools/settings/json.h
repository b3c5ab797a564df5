// SPDX-License-Identifier: Apache-2.0
// Declares the JSON value of nlohmann::json, whose objects keep the order in which their keys were
// written. Files that hold or read values include <nlohmann/json.hpp> as well, which takes seconds
// to compile.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace shadowdag {

using Json = nlohmann::ordered_json;

/// Returns the text of a JSON value, two spaces of indent, ending in a newline. Bytes that are not
/// UTF-8 (a file name may hold any) become U+FFFD; NaN and infinity become null.
std::string jsonText(const Json& value);

} // namespace shadowdag
