// SPDX-License-Identifier: Apache-2.0
#include "tools/report/sequence_table.h"

#include "tools/report/html.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace shadowdag {

using namespace html;

std::string sequenceTableHtml(const Json& rows) {
    std::string html;
    std::vector<std::pair<std::string, std::vector<const Json*>>> groups;
    for (const Json& row : rows) {
        const std::string name = text(row["label"]) + "</td><td>" + text(row["scene"]);
        auto found = std::find_if(groups.begin(), groups.end(),
                                  [&](const auto& group) { return group.first == name; });
        if (found == groups.end())
            found = groups.insert(groups.end(), {name, {}});
        found->second.push_back(&row);
    }
    html += "<h2 id=\"sequence\">Frames in sequence</h2>\n<p>Over all frames. Flicker: share of "
            "followed answers that change from a frame to the next where Embree's do not.</p>\n"
            "<div class=\"scroll\"><table class=\"sortable\"><thead><tr><th>Run</th><th>Scene</th>"
            "<th>Frames</th><th>Mean time, ms</th><th>Worst frame</th><th>its time, ms</th>"
            "<th>Peak triangles</th><th>Peak texels</th><th>Wrong pairs, %</th>"
            "<th>Flicker, %</th></tr></thead><tbody>\n";
    const auto cell = [&](double value, const std::string& shown) {
        html += "<td data-v=\"" + number(value, 9) + "\">" + shown + "</td>";
    };
    for (const auto& [name, members] : groups) {
        const auto sum = [&](const char* key) {
            double total = 0;
            for (const Json* row : members)
                total += (*row)[key].get<double>();
            return total;
        };
        const auto peak = [&](const char* key) {
            return *std::max_element(members.begin(), members.end(),
                                     [&](const Json* a, const Json* b) {
                                         return (*a)[key].get<double>() < (*b)[key].get<double>();
                                     });
        };
        html += "<tr><td>" + name + "</td>";
        cell(double(members.size()), std::to_string(members.size()));
        const double mean = sum("time_ms") / double(members.size());
        cell(mean, number(mean, 2));
        const Json* worst = peak("time_ms");
        cell((*worst)["frame"].get<double>(), text((*worst)["frame"]));
        cell((*worst)["time_ms"].get<double>(), number((*worst)["time_ms"].get<double>(), 2));
        for (const char* key : {"triangle_draw_count", "texel_count"}) {
            const double most = (*peak(key))[key].get<double>();
            cell(most, grouped(most));
        }
        const double wrong = 100 * (sum("false_shadow_count") + sum("false_light_count")) /
                             std::max(1.0, sum("pair_count"));
        cell(wrong, number(wrong, 3));
        const double flicker =
            100 * sum("flicker_count") / std::max(1.0, sum("flicker_answer_count"));
        cell(flicker, number(flicker, 4));
        html += "</tr>\n";
    }
    html += "</tbody></table></div>\n";
    return html;
}

} // namespace shadowdag
