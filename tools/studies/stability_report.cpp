// SPDX-License-Identifier: Apache-2.0
// The stability of errors as a page: charts, what every band says and why, every check.
#include "tools/studies/stability.h"

#include "tools/report/html.h"

#include <algorithm>
#include <map>

namespace shadowdag {

using namespace html;

namespace {

const char* const kTitles[kStabilityPartCount] = {"In time", "Under perturbation", "Numerically",
                                                  "Over resolution"};
const char* const kLeads[kStabilityPartCount] = {
    "Points of surfaces are followed from frame to frame. An answer flickers when it changes and "
    "Embree's does not. Held: by the same method and resolution in both frames.",
    "The same frame, its scene moved by next to nothing, far away, scaled or turned, each held "
    "against Embree's answers for that very scene.",
    "Lines in all 26 directions and texels across the edges of a cube, against integers without "
    "rounding. The slab test may accept what lies up to twice its margin outside of a voxel, a "
    "millionth of the grid, and never lose what touches one.",
    "The rate is the slope of log error over log voxel or texel. Promised is 1 where outlines are "
    "resolved: an outline is wrong by up to a voxel or texel, so the wrong area is its length "
    "times "
    "that."};

std::string shown(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.3g", value);
    return buffer;
}

/// One line a band and case kind: how far the values come within the band.
void addChecks(std::string& html, const Json& results, const std::string& part) {
    struct Line {
        size_t count = 0, broken = 0;
        double nearest = 1e300; ///< least distance to an end of the band, as a share of its width
        const Json* worst = nullptr;
    };
    std::map<std::pair<std::string, std::string>, Line> lines;
    for (const Json& check : results["checks"])
        if (check["part"] == part) {
            Line& line =
                lines[{check["band"].get<std::string>(), check["method"].get<std::string>()}];
            ++line.count;
            line.broken += !check["holds"].get<bool>();
            const double low = check["low"], high = check["high"], value = check["value"];
            const double width = std::max(high - low, 1e-300);
            const double room =
                std::min((high - value) / width, low > 0 ? (value - low) / width : 1e299);
            if (!line.worst || room < line.nearest) {
                line.nearest = room;
                line.worst = &check;
            }
        }
    html += "<div class=\"scroll\"><table><thead><tr><th>Band</th><th>Method</th><th>Checks</th>"
            "<th>Broken</th><th>Nearest to its end</th><th>Value</th><th>Band there</th></tr>"
            "</thead><tbody>\n";
    for (const auto& [key, line] : lines)
        html += "<tr><td>" + escaped(key.first) + "</td><td>" + escaped(key.second) + "</td><td>" +
                std::to_string(line.count) + "</td><td>" +
                (line.broken ? "<b>" + std::to_string(line.broken) + "</b>" : "0") + "</td><td>" +
                text((*line.worst)["group"]) + ", " + text((*line.worst)["case"]) + "</td><td>" +
                shown((*line.worst)["value"]) + "</td><td>" + shown((*line.worst)["low"]) + " to " +
                shown((*line.worst)["high"]) + "</td></tr>\n";
    html += "</tbody></table></div>\n";
}

void addRates(std::string& html, const Json& rates) {
    html += "<div class=\"scroll\"><table><thead><tr><th>Group</th><th>Method</th><th>Measure</th>"
            "<th>Rate</th><th>Standard error</th><th>Between neighbours</th></tr></thead><tbody>\n";
    for (const Json& rate : rates)
        html += "<tr><td>" + text(rate["group"]) + "</td><td>" + text(rate["method"]) +
                "</td><td>" + text(rate["case"]) + "</td><td>" + number(rate["slope"], 2) +
                "</td><td>" + number(rate["standard_error"], 2) + "</td><td>" +
                number(rate["least_local"], 2) + " to " + number(rate["greatest_local"], 2) +
                "</td></tr>\n";
    html += "</tbody></table></div>\n";
}

void addRows(std::string& html, const Json& rows) {
    if (rows.empty())
        return;
    std::vector<std::string> keys;
    for (const auto& [key, value] : rows[0].items())
        if (!value.is_structured())
            keys.push_back(key);
    html += "<details><summary>All " + std::to_string(rows.size()) +
            " rows</summary><div class=\"scroll\"><table><thead><tr>";
    for (const std::string& key : keys)
        html += "<th>" + escaped(key) + "</th>";
    html += "</tr></thead><tbody>\n";
    for (const Json& row : rows) {
        html += "<tr>";
        for (const std::string& key : keys) {
            const Json value = row.value(key, Json());
            html += "<td>" + (value.is_number_float() ? shown(value) : text(value)) + "</td>";
        }
        html += "</tr>\n";
    }
    html += "</tbody></table></div></details>\n";
}

} // namespace

std::string stabilityHtml(const Json& results, const Json& provenance, const Json& charts) {
    const std::string title = "How stable the errors are: in time, place, number and resolution";
    std::string html = pageStart(title);
    html += "<h1>" + escaped(title) + "</h1>\n";
    const std::vector<std::string> broken = unstableLines(results);
    html += "<p class=\"lead\">" + std::to_string(results["checks"].size()) +
            " checks against bands that are derived, or known and named.</p>\n";
    html += broken.empty() ? "<p>Every check holds.</p>\n"
                           : "<p class=\"note\">What does not hold:</p>\n<ul>\n";
    for (const std::string& line : broken)
        html += "<li class=\"note\">" + escaped(line) + "</li>\n";
    html += broken.empty() ? "<nav>" : "</ul>\n<nav>";
    for (int p = 0; p < kStabilityPartCount; ++p)
        html += std::string("<a href=\"#") + kStabilityPartNames[p] + "\">" + kTitles[p] + "</a> ";
    html += "<a href=\"stability.json\">stability.json</a> <a href=\"stability.csv\">stability.csv"
            "</a></nav>\n";
    for (int p = 0; p < kStabilityPartCount; ++p) {
        const std::string part = kStabilityPartNames[p];
        if (results[part].empty())
            continue;
        html += "<h2 id=\"" + part + "\">" + kTitles[p] + "</h2>\n<p>" + kLeads[p] + "</p>\n<ul>\n";
        for (const StabilityGroup& group : stabilityGroups())
            if (std::any_of(results[part].begin(), results[part].end(),
                            [&](const Json& row) { return row["group"] == group.name; }))
                html +=
                    "<li><b>" + escaped(group.name) + "</b>" +
                    (group.scene.empty() ? "" : " (<code>" + escaped(group.scene) + "</code>)") +
                    ": " + escaped(group.what) + "</li>\n";
        html += "</ul>\n";
        if (!charts.is_null())
            for (const Json& chart : charts["charts"])
                if (chart["part"] == part) {
                    const std::string stem = "charts/" + chart["file"].get<std::string>();
                    html += "<figure><a href=\"" + escaped(stem) + ".png\"><img src=\"" +
                            escaped(stem) + ".svg\" alt=\"" + text(chart["title"]) +
                            "\"></a><figcaption>" + text(chart["caption"]) +
                            "</figcaption></figure>\n";
                }
        addChecks(html, results, part);
        if (part == "resolution")
            addRates(html, results["rates"]);
        addRows(html, results[part]);
    }
    html += "<h2>Bands</h2>\n<div class=\"scroll\"><table><thead><tr><th>Band</th><th>Measure</th>"
            "<th>Formula</th><th>Why</th></tr></thead><tbody>\n";
    for (const StabilityBand& band : stabilityBands())
        html += "<tr><td>" + escaped(band.id) + "</td><td>" + escaped(band.measure) +
                "</td><td class=\"wide\">" + escaped(band.formula) + "</td><td class=\"wide\">" +
                escaped(band.reason) + "</td></tr>\n";
    html += "</tbody></table></div>\n<h2>Known to leave them</h2>\n<div class=\"scroll\"><table>"
            "<thead><tr><th>Group</th><th>Case</th><th>Method</th><th>Measure</th><th>Bound</th>"
            "<th>Why</th></tr></thead><tbody>\n";
    for (const KnownBreak& known : knownBreaks())
        html += "<tr><td>" + escaped(known.group) + "</td><td>" + escaped(known.kind) +
                "</td><td>" + escaped(known.method) + "</td><td>" + escaped(known.measure) +
                "</td><td>" + shown(known.low) + " to " + shown(known.high) +
                "</td><td class=\"wide\">" + escaped(known.reason) + "</td></tr>\n";
    html += "</tbody></table></div>\n<h2>Provenance</h2>\n<div class=\"scroll\"><table><tbody>\n";
    for (const auto& [key, value] : provenance.items())
        html +=
            "<tr><td>" + escaped(key) + "</td><td class=\"wide\">" + text(value) + "</td></tr>\n";
    return html + "</tbody></table></div>\n</body></html>\n";
}

} // namespace shadowdag
