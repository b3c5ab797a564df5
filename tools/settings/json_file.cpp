// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/json_file.h"

#include "cuda/error.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

namespace shadowdag {

namespace {

/// Returns "line 3, column 7" of a place in text, both from 1.
std::string placeOf(const std::string& text, size_t byte) {
    const std::string before = text.substr(0, std::min(byte, text.size()));
    const size_t line = size_t(std::count(before.begin(), before.end(), '\n')) + 1;
    const size_t start = before.rfind('\n');
    const size_t column = before.size() - (start == std::string::npos ? 0 : start + 1) + 1;
    return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

} // namespace

Json parseJson(const std::string& text, const std::string& where, const std::string& remedy) {
    if (text.find_first_not_of(" \t\r\n") == std::string::npos)
        throw Error(ErrorKind::kInput, where + ": is empty; " + remedy);
    std::vector<std::set<std::string>> keys;
    const auto heed = [&](int, Json::parse_event_t event, Json& parsed) {
        if (event == Json::parse_event_t::object_start)
            keys.emplace_back();
        else if (event == Json::parse_event_t::object_end)
            keys.pop_back();
        else if (event == Json::parse_event_t::key &&
                 !keys.back().insert(parsed.get<std::string>()).second)
            throw Error(ErrorKind::kInput,
                        where + ": key " + jsonLine(parsed) + " occurs twice; drop one of them");
        return true;
    };
    try {
        return Json::parse(text, heed);
    } catch (const Json::parse_error& error) {
        const size_t byte = error.byte > 0 ? error.byte - 1 : 0;
        if (byte >= text.size())
            throw Error(ErrorKind::kInput, where + ": ends at " + placeOf(text, text.size()) +
                                               ", before its JSON does: it is truncated; " +
                                               remedy);
        throw Error(ErrorKind::kInput,
                    where + ": is not JSON at " + placeOf(text, byte) + "; " + remedy);
    } catch (const Json::out_of_range&) {
        throw Error(ErrorKind::kInput, where + ": contains a number beyond 1.8e308; " + remedy);
    }
}

Json readJsonFile(const std::string& path, const std::string& remedy) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        throw Error(ErrorKind::kInput, path + ": is a directory; " + remedy);
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    if (!file)
        throw Error(ErrorKind::kInput, path + ": cannot be opened; " + remedy);
    text << file.rdbuf();
    return parseJson(text.str(), path, remedy);
}

std::string jsonLine(const Json& value) {
    return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace shadowdag
