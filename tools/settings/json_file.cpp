// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/json_file.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/json_text.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
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

/// Returns where a text nests deeper than a limit, its size if it does not.
size_t findTooDeep(const std::string& text, int maxDepth) {
    int depth = 0;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '"') {
            for (++i; i < text.size() && text[i] != '"'; ++i)
                if (text[i] == '\\')
                    ++i;
        } else if (text[i] == '{' || text[i] == '[') {
            if (++depth > maxDepth)
                return i;
        } else if (text[i] == '}' || text[i] == ']') {
            --depth;
        }
    }
    return text.size();
}

} // namespace

Json parseJson(const std::string& text, const std::string& where, const std::string& remedy) {
    if (text.find_first_not_of(" \t\r\n") == std::string::npos)
        throw Error(ErrorKind::kInput, where + ": is empty; " + remedy);
    if (const size_t deep = findTooDeep(text, kMaxJsonDepth); deep < text.size())
        throw Error(ErrorKind::kInput, where + ": nests deeper than " +
                                           std::to_string(kMaxJsonDepth) + " levels at " +
                                           placeOf(text, deep) + "; " + remedy);
    std::vector<std::set<std::string>> keys;
    const auto refuse = [&](int, Json::parse_event_t event, Json& parsed) {
        if (event == Json::parse_event_t::object_start)
            keys.emplace_back();
        else if (event == Json::parse_event_t::object_end)
            keys.pop_back();
        else if (event == Json::parse_event_t::key &&
                 !keys.back().insert(parsed.get<std::string>()).second)
            throw Error(ErrorKind::kInput,
                        where + ": key " + jsonLine(parsed) + " occurs twice; drop one of them");
        else if (parsed.is_string() &&
                 parsed.get_ref<const std::string&>().find('\0') != std::string::npos)
            throw Error(ErrorKind::kInput,
                        where + ": " + jsonLine(parsed) +
                            " contains a zero byte, which is not allowed; drop it");
        return true;
    };
    try {
        return Json::parse(text, refuse);
    } catch (const Json::parse_error& error) {
        const size_t byte = error.byte > 0 ? error.byte - 1 : 0;
        if (byte >= text.size())
            throw Error(ErrorKind::kInput, where + ": ends at " + placeOf(text, text.size()) +
                                               ", before its JSON does: it is truncated; " +
                                               remedy);
        if (const std::string why = whyNoUtf8(text); !why.empty())
            throw Error(ErrorKind::kInput, where + ": " + why);
        throw Error(ErrorKind::kInput,
                    where + ": is not JSON at " + placeOf(text, byte) + "; " +
                        (isNoNumber(text, byte) ? "JSON has no NaN and no Infinity: write a number"
                                                : remedy));
    } catch (const Json::out_of_range&) {
        throw Error(ErrorKind::kInput, where + ": contains a number beyond 1.8e308; " + remedy);
    }
}

Json readJsonFile(const std::string& path, const std::string& remedy, uint64_t maxBytes) {
    std::string why;
    const std::optional<std::string> text = readInput(path, {maxBytes, true}, why);
    if (!text)
        throw Error(ErrorKind::kInput, path + ": " + why + "; " + remedy);
    return parseJson(*text, path, remedy);
}

Json parseOwnJson(const std::string& text, int maxDepth) {
    if (findTooDeep(text, maxDepth) < text.size())
        return Json(Json::value_t::discarded);
    return Json::parse(text, nullptr, false);
}

Json readOwnJsonFile(const std::string& path) {
    std::string why;
    const std::optional<std::string> text = readInput(path, {kMaxOwnJsonBytes, false, false}, why);
    if (text)
        return parseOwnJson(*text);
    // What cannot be read may be our own, which must not count as absent.
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored))
        throw Error(ErrorKind::kResource,
                    path + ": " + why + "; make it readable, or move it away");
    return Json();
}

std::string jsonLine(const Json& value) {
    return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace shadowdag
