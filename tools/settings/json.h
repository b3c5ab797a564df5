// SPDX-License-Identifier: Apache-2.0
// Includes nlohmann::json: objects keep the order in which their keys were written.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace shadowdag {

using Json = nlohmann::ordered_json;

/// Returns the text of a JSON value, two spaces of indent, ending in a newline. Bytes that are not
/// UTF-8 (a file name may hold any) become U+FFFD; NaN and infinity become null.
std::string jsonText(const Json& value);

} // namespace shadowdag
