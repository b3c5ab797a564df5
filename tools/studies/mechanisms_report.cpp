// SPDX-License-Identifier: Apache-2.0
// Mechanisms as lines of comma-separated values.
#include "tools/report/csv.h"
#include "tools/studies/mechanisms.h"

namespace shadowdag {

std::string mechanismsCsv(const Json& results) {
    Json rows = Json::array();
    for (const Json& row : results["mechanisms"])
        for (const Json& scene : row["scenes"]) {
            Json line = {{"mechanism", row["name"]},  {"method", row["method"]},
                         {"always", row["always"]},   {"off", row["off_settings"]},
                         {"on", row["on_settings"]},  {"metric", row["metric"]},
                         {"verdict", row["verdict"]}, {"is_default", row["is_default"]},
                         {"scene", scene["scene"]},   {"is_failure", scene["is_failure"]}};
            for (const char* key :
                 {"own_ratio", "time_ratio", "time_spread", "error_ratio", "bytes_ratio"})
                line[key] = scene.value(key, Json());
            rows.push_back(std::move(line));
        }
    return flatCsv(rows);
}

} // namespace shadowdag
