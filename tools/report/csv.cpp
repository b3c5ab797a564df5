// SPDX-License-Identifier: Apache-2.0
#include "tools/report/csv.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <vector>

namespace shadowdag {

namespace {

std::string csvCell(const Json& value) {
    std::string text = value.is_string()
                           ? value.get<std::string>()
                           : value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.find_first_of(",\"\n") == std::string::npos)
        return text;
    std::string quoted = "\"";
    for (const char c : text)
        quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

} // namespace

std::string flatCsv(const Json& rows, const std::vector<std::string>& omitted) {
    std::string csv;
    if (rows.empty())
        return csv;
    std::vector<std::string> columns;
    for (const Json& row : rows)
        for (const auto& [key, value] : row.items())
            if (std::find(omitted.begin(), omitted.end(), key) == omitted.end() &&
                std::find(columns.begin(), columns.end(), key) == columns.end())
                columns.push_back(key);
    for (size_t i = 0; i < columns.size(); ++i)
        csv += (i == 0 ? "" : ",") + csvCell(columns[i]);
    csv += "\n";
    for (const Json& row : rows) {
        for (size_t i = 0; i < columns.size(); ++i)
            csv += (i == 0 ? "" : ",") + (row.contains(columns[i]) ? csvCell(row[columns[i]]) : "");
        csv += "\n";
    }
    return csv;
}

std::string runsCsv(const Json& runs) {
    Json rows = Json::array(); // nested objects become separate columns
    for (const Json& run : runs) {
        Json row = Json::object();
        for (const auto& [key, value] : run.items()) {
            if (key == "visibility_histogram" || key == "images" || key == "round_times_ms" ||
                key == "shown_as")
                continue;
            if (!value.is_object()) {
                row[key] = value;
                continue;
            }
            for (const auto& [inner, innerValue] : value.items())
                row[key + "." + inner] = innerValue;
        }
        rows.push_back(std::move(row));
    }
    return flatCsv(rows);
}

} // namespace shadowdag
