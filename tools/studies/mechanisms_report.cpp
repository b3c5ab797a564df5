// SPDX-License-Identifier: Apache-2.0
// Mechanisms as a page and as lines: the rule, the chart, the verdicts, every row with its scenes.
#include "tools/report/html.h"
#include "tools/report/report.h"
#include "tools/studies/mechanisms.h"

namespace shadowdag {

using namespace html;

namespace {

/// Returns a ratio as text, "" where there is none.
std::string ratioText(const Json& row, const char* key) {
    return row.contains(key) ? number(row[key].get<double>(), 3) : "";
}

std::string defaultText(const Json& row) {
    const Json& isDefault = row["is_default"];
    return isDefault.is_null() ? "asked for by name" : isDefault.get<bool>() ? "on" : "off";
}

void addVerdicts(std::string& html, const Json& results) {
    html += "<div class=\"scroll\"><table><thead><tr><th>Mechanism</th><th>Should pay in</th>"
            "<th>own, on/off</th><th>time</th><th>error</th><th>bytes</th><th>Verdict</th>"
            "<th>Default now</th><th>Why</th></tr></thead><tbody>\n";
    for (const Json& row : results["mechanisms"]) {
        html += "<tr><td><a href=\"#" + text(row["name"]) + "\">" + text(row["name"]) +
                "</a></td><td>" + text(row["metric"]) + "</td>";
        for (const char* key : {"own_ratio", "time_ratio", "error_ratio", "bytes_ratio"})
            html += "<td>" + ratioText(row, key) + "</td>";
        const std::string verdict = text(row["verdict"]);
        html += "<td>" + (row["agrees"].get<bool>() ? verdict : "<b>" + verdict + "</b>") +
                "</td><td>" + defaultText(row) + "</td><td class=\"wide\">" + text(row["reason"]) +
                "</td></tr>\n";
    }
    html += "</tbody></table></div>\n";
}

void addMechanism(std::string& html, const Json& row) {
    html += "<h2 id=\"" + text(row["name"]) + "\">" + text(row["name"]) + "</h2>\n<p>" +
            text(row["what"]) + " <b>" + text(row["verdict"]) + "</b>: " + text(row["reason"]) +
            ".</p>\n<p class=\"lead\">" + text(row["method"]);
    if (!row["always"].get<std::string>().empty())
        html += "; always <code>" + text(row["always"]) + "</code>";
    html += "; without <code>" + text(row["off_settings"]) + "</code>, with <code>" +
            text(row["on_settings"]) + "</code>";
    if (row["is_sequence"].get<bool>())
        html += "; frames in sequence";
    if (!row["kept_for"].get<std::string>().empty())
        html += "; needed by " + text(row["kept_for"]);
    html += ". Source: " + text(row["source"]) +
            ".</p>\n<div class=\"scroll\"><table><thead><tr><th>Scene</th><th>" +
            text(row["metric"]) +
            ", on/off</th><th>time</th><th>spread</th><th>error</th><th>bytes</th>"
            "<th>false shadow</th><th>false light</th><th>unexplained</th><th>acne</th>"
            "<th>triangles</th><th>texels</th><th>rays</th></tr></thead><tbody>\n";
    for (const Json& scene : row["scenes"]) {
        html += "<tr><td>" + text(scene["scene"]) + "</td>";
        for (const char* key :
             {"own_ratio", "time_ratio", "time_spread", "error_ratio", "bytes_ratio"})
            html += "<td>" + ratioText(scene, key) + "</td>";
        const auto sides = [&](const auto& of) {
            html += "<td>";
            if (scene["off"].contains("pair_count"))
                html += grouped(of(scene["off"])) + " \u2192 " + grouped(of(scene["on"]));
            html += "</td>";
        };
        const auto count = [&](const char* key) {
            sides([&](const Json& side) { return side[key].get<double>(); });
        };
        count("false_shadow_count");
        count("false_light_count");
        sides([](const Json& side) {
            return side["unexplained_false_shadow_count"].get<double>() +
                   side["unexplained_false_light_count"].get<double>();
        });
        count("acne_count");
        count("triangle_draw_count");
        count("texel_count");
        count("ray_count");
        html += "</tr>\n";
    }
    html += "</tbody></table></div>\n";
}

} // namespace

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

std::string mechanismsHtml(const Json& results, const Json& provenance, const std::string& chart) {
    const std::string title = "What each mechanism buys";
    std::string html = pageStart(title);
    html += "<h1>" + title + "</h1>\n<p class=\"lead\">" +
            std::to_string(results["mechanisms"].size()) +
            " mechanisms, switched off and on over " + std::to_string(results["scenes"].size()) +
            " scenes at " + text(results["size"]) +
            ", and over the failures that they are a remedy for.</p>\n"
            "<p>A mechanism <em>pays</em> when its mean gain in its own metric over the built-in "
            "scenes exceeds twice its spread (the standard error over scenes and runs) and one "
            "percent; it <em>helps</em> when it gains a fifth at least, and twice its spread, in a "
            "failure that it is a remedy for. A metric is <em>worse</em> when its mean loss "
            "exceeds twice its spread "
            "and five percent. What pays is on by default when the error is not worse and neither "
            "time nor bytes are worse by more than it gains; what only helps is on when nothing is "
            "worse; what pays or helps otherwise is an option; what does neither is deleted, or "
            "kept for what needs it. The error is mean |visibility - Embree's|, of filters, whose "
            "answers at outlines are fractional by intent, FLIP of the picture. Ratios are with "
            "over without: under 1 is a gain. Times of "
            "what should pay in time are medians of interleaved pairs of runs, others of one pair; "
            "all other numbers are exact.</p>\n";
    const std::vector<std::string> lines = disagreements(results);
    html += lines.empty() ? "<p>Every default is as its verdict says.</p>\n"
                          : "<p class=\"note\">Where the default is not as the verdict says:</p>\n"
                            "<ul>\n";
    for (const std::string& line : lines)
        html += "<li class=\"note\">" + escaped(line) + "</li>\n";
    if (!lines.empty())
        html += "</ul>\n";
    if (!chart.empty())
        html += "<figure><img src=\"" + escaped(chart) +
                "\" alt=\"Ratios with over without, by mechanism and scene\"></figure>\n";
    html += "<nav><a href=\"mechanisms.json\">mechanisms.json</a> <a "
            "href=\"mechanisms.csv\">mechanisms.csv</a></nav>\n";
    addVerdicts(html, results);
    for (const Json& row : results["mechanisms"])
        addMechanism(html, row);
    html += "<h2>Provenance</h2>\n<div class=\"scroll\"><table><tbody>\n";
    for (const auto& [key, value] : provenance.items())
        html +=
            "<tr><td>" + escaped(key) + "</td><td class=\"wide\">" + text(value) + "</td></tr>\n";
    return html + "</tbody></table></div>\n</body></html>\n";
}

} // namespace shadowdag
