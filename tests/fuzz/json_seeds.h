// SPDX-License-Identifier: Apache-2.0
// JSON files of the repository, cut short, as seeds.
#pragma once

#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tools/settings/json_file.h"

#include <nlohmann/json.hpp>

#include <string>

namespace shadowdag::fuzz {

/// Cuts all lists within a value to their first elements.
inline void cutLists(Json& value, size_t most) {
    if (value.is_array() && value.size() > most)
        value.erase(value.begin() + long(most), value.end());
    if (value.is_structured())
        for (Json& inner : value)
            cutLists(inner, most);
}

/// Returns a JSON file of the source tree with lists of at most `most` elements.
inline Json sourceJson(const std::string& path, size_t most) {
    Json json = parseJson(sourceText(path), path, "");
    cutLists(json, most);
    return json;
}

/// Parses an input as a user's file.
inline Json inputJson(const uint8_t* data, size_t size) {
    return parseJson({data, data + size}, "input.json", "give a valid file");
}

} // namespace shadowdag::fuzz
