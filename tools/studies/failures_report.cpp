// SPDX-License-Identifier: Apache-2.0
// The matrix of failures as a page: every failure in two sentences, picture and truth side by side,
// every cell with its counts.
#include "tools/report/html.h"
#include "tools/studies/failures.h"

#include <algorithm>

namespace shadowdag {

using namespace html;

namespace {

std::string percent(const Json& cell, const char* key) {
    return number(100.0 * cell[key].get<double>() / std::max(1.0, cell["pair_count"].get<double>()),
                  2);
}

std::vector<const Json*> cellsOf(const Json& matrix, const std::string& failure) {
    std::vector<const Json*> cells;
    for (const Json& cell : matrix["cells"])
        if (cell["failure"] == failure)
            cells.push_back(&cell);
    return cells;
}

/// Returns how a cell's remedy stands, for readers.
std::string remedyText(const Json& cell) {
    const std::string remedy = cell["remedy"].get<std::string>();
    return remedy == "not read" ? "unaffected" : remedy == "none" ? "\u2013" : remedy;
}

void addFigure(std::string& html, const std::string& file, const std::string& caption) {
    html += "<figure><img loading=\"lazy\" src=\"images/" + escaped(file) + "\" alt=\"" +
            escaped(caption) + "\"><figcaption>" + escaped(caption) + "</figcaption></figure>";
}

/// One row of pictures a method: the truth, then without and with the remedy, each with its errors.
void addPictures(std::string& html, const std::vector<const Json*>& cells,
                 const std::string& truthFile) {
    std::vector<std::string> methods;
    for (const Json* cell : cells)
        if (cell->contains("images") &&
            std::find(methods.begin(), methods.end(), (*cell)["method"].get<std::string>()) ==
                methods.end())
            methods.push_back((*cell)["method"].get<std::string>());
    for (const std::string& method : methods) {
        html += "<div class=\"five\">";
        addFigure(html, truthFile, "The truth (Embree)");
        for (const Json* cell : cells)
            if ((*cell)["method"] == method && cell->contains("images")) {
                const std::string remedy = (*cell)["remedy"].get<std::string>(),
                                  state = remedy == "none" ? ""
                                          : remedy == "on" ? ", with the remedy"
                                                           : ", without";
                addFigure(html, (*cell)["images"]["color"].get<std::string>(), method + state);
                addFigure(html, (*cell)["images"]["error"].get<std::string>(),
                          "its errors: " + percent(*cell, "false_shadow_count") +
                              " % false shadow, " + percent(*cell, "false_light_count") +
                              " % false light");
            }
        html += "</div>\n";
    }
}

void addTable(std::string& html, const std::vector<const Json*>& cells, bool isMoving) {
    html +=
        "<div class=\"scroll\"><table><thead><tr><th>Method</th><th>Remedy</th><th>False shadow, "
        "%</th><th>False light, %</th><th>Mean error</th><th>Unexplained</th><th>Acne</th>"
        "<th>Contact</th><th>Missing taps</th>";
    if (isMoving)
        html += "<th>Flicker</th><th>of answers</th>";
    html += "<th>Maps drawn</th><th>traced</th><th>Bounds</th></tr></thead><tbody>\n";
    for (const Json* cell : cells) {
        const auto count = [&](const char* key) {
            html += "<td>" + grouped((*cell)[key].get<double>()) + "</td>";
        };
        html += "<tr><td>" + text((*cell)["method"]) + "</td><td>" + remedyText(*cell) +
                "</td><td>" + percent(*cell, "false_shadow_count") + "</td><td>" +
                percent(*cell, "false_light_count") + "</td><td>" +
                number((*cell)["mean_abs_visibility_error"].get<double>(), 5) + "</td>";
        for (const char* key :
             {"unexplained_count", "acne_count", "contact_count", "missing_tap_count"})
            count(key);
        if (isMoving) {
            count("flicker_count");
            count("flicker_answer_count");
        }
        count("drawn_map_count");
        count("traced_map_count");
        std::string held = "hold";
        if (!(*cell)["broken"].empty()) {
            held = "<b>broken:</b>";
            for (const Json& name : (*cell)["broken"])
                held += " " + text(name);
        }
        html += "<td>" + held + "</td></tr>\n";
    }
    html += "</tbody></table></div>\n";
}

void addFailure(std::string& html, const Json& matrix, const Failure& failure) {
    const std::vector<const Json*> cells = cellsOf(matrix, failure.name);
    if (cells.empty())
        return;
    html += "<h2 id=\"" + escaped(failure.name) + "\">" + escaped(failure.name) + "</h2>\n<p>" +
            escaped(failure.what) + " " + escaped(failure.remedy) + "</p>\n<p class=\"lead\">" +
            (failure.listed == "ours" ? std::string("Found in this program")
                                      : "Row " + escaped(failure.listed)) +
            "; scene <code>builtin:" + escaped(failure.scene) + "</code>";
    if (!failure.always.empty())
        html += "; always <code>" + escaped(failure.always) + "</code>";
    if (failure.hasRemedy())
        html += "; without the remedy <code>" + escaped(failure.off) + "</code>, with it <code>" +
                escaped(failure.on) + "</code>";
    else
        html += "; no option takes the remedy out";
    if (failure.frameCount > 1)
        html += "; " + std::to_string(failure.frameCount) + " frames, one every " +
                number(failure.stepSeconds, 2) + " s";
    html += ". Source: " + escaped(failure.source) + ".</p>\n";
    for (const Json& picture : matrix["pictures"])
        if (picture["failure"] == failure.name)
            addPictures(html, cells, picture["truth"].get<std::string>());
    for (const Json& seen : matrix["remedies"])
        if (seen["failure"] == failure.name)
            html += "<p>" + text(seen["method"]) + ": " + text(seen["measure"]) + " " +
                    grouped(seen["off"].get<double>()) + " without and " +
                    grouped(seen["on"].get<double>()) + " with the remedy" +
                    (seen["is_seen"].get<bool>() ? "" : ", <b>less than the factor asked for</b>") +
                    " (factor asked for: " + number(seen["factor"].get<double>(), 1) + ").</p>\n";
    addTable(html, cells, failure.frameCount > 1);
}

} // namespace

std::string failuresHtml(const Json& matrix, const Json& provenance) {
    const std::string title = "Where shadows fail: maps, voxel rays and both";
    std::string html = pageStart(title);
    html +=
        "<style>.five { display: grid; grid-template-columns: repeat(5, 1fr); gap: .5rem; margin: "
        ".6rem 0; } .five figcaption { font-size: .8rem; }</style>\n";
    html +=
        "<h1>" + title + "</h1>\n<p class=\"lead\">" + std::to_string(matrix["cells"].size()) +
        " cells: every known failure as a small scene, by four methods, with the remedy against "
        "it switched on and off. Every (visible point, light) pair is held against Embree.</p>\n";
    const std::vector<std::string> broken = brokenLines(matrix);
    html += broken.empty()
                ? "<p>Every cell is within what is known of it, and every remedy is seen.</p>\n"
                : "<p class=\"note\">What does not hold:</p>\n<ul>\n";
    for (const std::string& line : broken)
        html += "<li class=\"note\">" + escaped(line) + "</li>\n";
    html += broken.empty() ? "" : "</ul>\n";
    if (const Json leftOut = matrix.value("left_out", Json::array()); !leftOut.empty()) {
        html += "<p class=\"note\">Left out:</p>\n<ul>\n";
        for (const Json& cell : leftOut)
            html += "<li class=\"note\">" + text(cell["failure"]) + " by " + text(cell["method"]) +
                    ": " + text(cell["why"]) + "</li>\n";
        html += "</ul>\n";
    }
    html += "<nav>";
    for (const Failure& failure : failures())
        if (!cellsOf(matrix, failure.name).empty())
            html += "<a href=\"#" + escaped(failure.name) + "\">" + escaped(failure.name) + "</a> ";
    html +=
        "<a href=\"failures.json\">failures.json</a> <a href=\"failures.csv\">failures.csv</a>"
        "</nav>\n<p>In the pictures of errors <span class=\"key\" style=\"background:#d55e00\">"
        "</span>false shadow is where the method says dark and Embree lit, <span class=\"key\" "
        "style=\"background:#0072b2\"></span>false light the reverse. <em>Unexplained</em> is what "
        "no "
        "shift within the method's resolution explains, <em>acne</em> what the receiver's own "
        "surface shadows, <em>contact</em> what lies within bias or offset, <em>flicker</em> "
        "answers that change from a frame to the next where Embree's do not. A cell holds while "
        "each count is at most what was measured once, a twentieth and 3 more.</p>\n";
    for (const Failure& failure : failures())
        addFailure(html, matrix, failure);
    html += "<h2>Failures that no scene shows</h2>\n<div class=\"scroll\"><table><thead><tr><th>Row"
            "</th><th>Failure</th><th>Test</th></tr></thead><tbody>\n";
    for (const UnitTestedFailure& test : unitTestedFailures())
        html += "<tr><td>" + escaped(test.listed) + "</td><td class=\"wide\">" +
                escaped(test.what) + "</td><td class=\"wide\"><code>" + escaped(test.test) +
                "</code></td></tr>\n";
    html +=
        "</tbody></table></div>\n<h2>Settings</h2>\n<div class=\"scroll\"><table><thead><tr><th>Key"
        "</th><th>What it is</th></tr></thead><tbody>\n";
    for (const FailureSetting& setting : failureSettings())
        html += "<tr><td>" + escaped(setting.key) + "</td><td class=\"wide\">" +
                escaped(setting.help) + "</td></tr>\n";
    html += "</tbody></table></div>\n<h2>Provenance</h2>\n<div class=\"scroll\"><table><tbody>\n";
    for (const auto& [key, value] : provenance.items())
        html +=
            "<tr><td>" + escaped(key) + "</td><td class=\"wide\">" + text(value) + "</td></tr>\n";
    return html + "</tbody></table></div>\n</body></html>\n";
}

} // namespace shadowdag
