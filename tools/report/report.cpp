// SPDX-License-Identifier: Apache-2.0
#include "tools/report/report.h"

#include "tools/report/html.h"
#include "tools/report/sequence_table.h"
#include "tools/workspace/frame_json.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <vector>

namespace shadowdag {

using namespace html;

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

double percent(const Json& run, const char* key) {
    return 100.0 * run[key].get<double>() / std::max(1.0, run["pair_count"].get<double>());
}

double wrongPercent(const Json& run) {
    return percent(run, "false_shadow_count") + percent(run, "false_light_count");
}

/// Returns a run's name with the cube of its resolution raised.
std::string label(const Json& run) {
    std::string shown = text(run["label"]);
    if (const size_t at = shown.find("^3"); at != std::string::npos)
        shown.replace(at, 2, "\u00b3");
    return shown;
}

double unexplainedCount(const Json& run) {
    return run["unexplained_false_shadow_count"].get<double>() +
           run["unexplained_false_light_count"].get<double>();
}

/// Returns how many unexplained errors a shift aimed at the blocker finds, or the truth along the
/// filter's own taps; 0 in results that were not asked.
double settledCount(const Json& run) {
    return run.value("settled_false_shadow_count", 0.0) +
           run.value("settled_false_light_count", 0.0);
}

double mebibytes(const Json& bytes) {
    return bytes.get<double>() / (1024.0 * 1024.0);
}

// Sorts a table by the column whose heading is clicked. The page works without it.
constexpr std::string_view kScript = R"(
document.querySelectorAll('table.sortable th').forEach((th, column) => th.addEventListener('click', () => {
  const body = th.closest('table').tBodies[0], rows = [...body.rows];
  const value = row => { const c = row.cells[th.cellIndex]; return c.dataset.v ?? c.textContent; };
  const up = th.dataset.up !== '1'; th.dataset.up = up ? '1' : '0';
  rows.sort((a, b) => { const x = value(a), y = value(b), d = x - y;
    return (isNaN(d) ? x.localeCompare(y) : d) * (up ? 1 : -1); });
  rows.forEach(row => body.append(row));
}));
)";

void addFigure(std::string& html, const Json& chart, const std::string& cssClass) {
    const std::string stem = "charts/" + chart["file"].get<std::string>();
    html += "<figure" + (cssClass.empty() ? "" : " class=\"" + cssClass + "\"") + "><a href=\"" +
            escaped(stem) + ".svg\"><img src=\"" + escaped(stem) + ".svg\" alt=\"" +
            text(chart["title"]) + "\"></a><figcaption><b>" + text(chart["title"]) + ".</b> " +
            text(chart["caption"]) + " (<a href=\"" + escaped(stem) +
            ".png\">PNG</a>)</figcaption></figure>\n";
}

/// Says how many of the runs had more pages to draw than the pool holds, and of the worst what that
/// cost.
void addPoolFinding(std::string& html, const std::vector<const Json*>& members) {
    size_t fullCount = 0;
    const Json* worst = nullptr;
    for (const Json* run : members) {
        if (poolNote(*run).empty())
            continue;
        ++fullCount;
        if (worst == nullptr ||
            run->value("degrade_divisor", 1.0) > worst->value("degrade_divisor", 1.0))
            worst = run;
    }
    if (worst != nullptr)
        html += " <b>The page pool was full</b> in " + std::to_string(fullCount) + " of " +
                std::to_string(members.size()) + " runs (" + label(*worst) + ": " +
                escaped(poolNote(*worst)) +
                "): their maps are coarser than their parameters ask for.";
}

/// Says how many wrong pairs stay unexplained in all runs together, and how many of these are
/// settled (settledCount).
void addUnexplainedFinding(std::string& html, const std::vector<const Json*>& members) {
    double unexplained = 0, settled = 0;
    for (const Json* run : members) {
        unexplained += unexplainedCount(*run);
        settled += settledCount(*run);
    }
    if (unexplained > 0)
        html += " Over all runs " + grouped(unexplained) +
                " wrong pairs are unexplained; of the "
                "unexplained, " +
                grouped(settled) +
                " are settled: a shift aimed at the blocker finds them, or the truth along the "
                "filter's own taps says what the map says.";
}

/// One sentence a scene and frame: the pure methods, and the hybrid that is fastest among those no
/// worse than either.
void addFindings(std::string& html, const Json& runs) {
    std::vector<std::pair<std::string, std::vector<const Json*>>> groups;
    for (const Json& run : runs) {
        const std::string name = run["scene"].get<std::string>() + ", frame " +
                                 std::to_string(run["frame"].get<uint32_t>());
        if (groups.empty() || groups.back().first != name)
            groups.push_back({name, {}});
        groups.back().second.push_back(&run);
    }
    html += "<ul>\n";
    for (const auto& [name, members] : groups) {
        html += "<li><b>" + escaped(name) + "</b>: ";
        const Json* fastestHybrid = nullptr;
        bool isFirst = true;
        for (const Json* run : members) {
            const std::string method = (*run)["method"].get<std::string>();
            if (method == "hybrid") {
                if (fastestHybrid == nullptr || (*run)["time_ms"] < (*fastestHybrid)["time_ms"])
                    fastestHybrid = run;
                continue;
            }
            if (!isFirst)
                html += "; ";
            isFirst = false;
            html += label(*run) + " " + number((*run)["time_ms"].get<double>(), 1) + " ms";
            if (method != "embree")
                html += " at " + number(wrongPercent(*run), 2) + " % wrong pairs";
        }
        if (fastestHybrid != nullptr)
            html += "; the fastest hybrid (" + label(*fastestHybrid) + ") " +
                    number((*fastestHybrid)["time_ms"].get<double>(), 1) + " ms at " +
                    number(wrongPercent(*fastestHybrid), 2) + " %";
        html += ".";
        addPoolFinding(html, members);
        addUnexplainedFinding(html, members);
        html += "</li>\n";
    }
    html += "</ul>\n";
}

void addTable(std::string& html, const Json& runs) {
    html += "<div class=\"scroll\"><table "
            "class=\"sortable\"><thead><tr><th>Run</th><th>Scene</th><th>Frame</th>"
            "<th>Time, ms</th><th>min to max</th><th>Pool</th><th>Mean error</th><th>False shadow, "
            "%</th><th>False light, %</th>"
            "<th>Unexplained</th><th>of these "
            "aimed</th><th>Acne</th><th>Contact</th><th>RMSE</th><th>FLIP</th><th>Traced "
            "lights</th>"
            "<th>Mapped</th><th>Rays</th><th>Pages</th><th>DAG, MiB</th><th>Pages, "
            "MiB</th></tr></thead><tbody>\n";
    const auto cell = [&](double value, const std::string& shown) {
        html += "<td data-v=\"" + number(value, 9) + "\">" + shown + "</td>";
    };
    for (const Json& run : runs) {
        html += "<tr><td>" + label(run) + "</td><td>" + text(run["scene"]) + "</td>";
        const auto count = [&](const char* key) {
            cell(run[key].get<double>(), grouped(run[key].get<double>()));
        };
        const auto decimal = [&](double value, int decimals) {
            cell(value, number(value, decimals));
        };
        count("frame");
        decimal(run["time_ms"].get<double>(), 2);
        cell(run["time_ms_min"].get<double>(), number(run["time_ms_min"].get<double>(), 2) +
                                                   " to " +
                                                   number(run["time_ms_max"].get<double>(), 2));
        const std::string note = poolNote(run);
        const double divisor = run.value("degrade_divisor", 1.0);
        html += "<td data-v=\"" + number(divisor, 9) + "\" title=\"" + escaped(note) + "\">" +
                (note.empty() ? std::string(run["page_count"] == 0 ? "" : "fits")
                              : "full, \u00f7\u2009" + number(divisor, 2)) +
                "</td>";
        decimal(run["mean_abs_visibility_error"].get<double>(), 5);
        decimal(percent(run, "false_shadow_count"), 3);
        decimal(percent(run, "false_light_count"), 3);
        cell(unexplainedCount(run), grouped(unexplainedCount(run)));
        cell(settledCount(run), grouped(settledCount(run)));
        count("acne_count");
        count("contact_count");
        decimal(run["rmse"].get<double>(), 4);
        decimal(run["flip"].get<double>(), 4);
        count("traced_light_count");
        count("mapped_light_count");
        count("ray_count");
        count("page_count");
        decimal(mebibytes(run["dag_bytes"]), 2);
        decimal(mebibytes(run["map_bytes"]), 2);
        html += "</tr>\n";
    }
    html += "</tbody></table></div>\n";
}

/// Returns whether a run belongs to the pictures that are shown at once; the others are folded
/// away.
bool isShownAtOnce(const Json& run) {
    const std::string model = run["model"].get<std::string>();
    return run["method"] != "hybrid" || model == "oracle" || model == "texels:96" ||
           model == "texels:32";
}

void addPictureRow(std::string& html, const Json& run, const std::string& truthFile) {
    html += "<h3>" + label(run) + ": " + number(run["time_ms"].get<double>(), 1) + " ms, " +
            number(percent(run, "false_shadow_count"), 2) + " % false shadow, " +
            number(percent(run, "false_light_count"), 2) + " % false light</h3>\n";
    if (const std::string note = poolNote(run); !note.empty())
        html += "<p class=\"note\">" + escaped(note) + "</p>\n";
    html += "<div class=\"pictures\">";
    const auto add = [&](const std::string& file, const std::string& caption) {
        html += "<figure><a href=\"" + escaped(file) + "\"><img loading=\"lazy\" src=\"" +
                escaped(file) + "\" alt=\"" + escaped(caption) + "\"></a><figcaption>" +
                escaped(caption) + "</figcaption></figure>";
    };
    add(run["images"]["color"].get<std::string>(), "The method");
    add(truthFile, "The truth (Embree)");
    add(run["images"]["error"].get<std::string>(), "False shadow and false light");
    add(run["images"]["method"].get<std::string>(), "Rays or maps");
    html += "</div>\n";
}

void addPictures(std::string& html, const Json& results) {
    for (const Json& truth : results["truth_images"]) {
        html += "<h2 id=\"pictures\">Pictures: " + text(truth["scene"]) + ", frame " +
                text(truth["frame"]) + "</h2>\n";
        html += "<p>Errors: <span class=\"key\" style=\"background:#d55e00\"></span>false shadow "
                "(the method says dark, "
                "Embree lit), <span class=\"key\" style=\"background:#0072b2\"></span>false light; "
                "strength is the "
                "square root of the share of the pixel's lights. Last column: answered by "
                "<span class=\"key\" style=\"background:#56b4e9\"></span>rays, "
                "<span class=\"key\" style=\"background:#e69f00\"></span>maps; discs are the "
                "lights.</p>\n";
        std::string folded;
        for (const Json& run : results["runs"]) {
            if (run["scene"] != truth["scene"] || run["frame"] != truth["frame"] ||
                !run.contains("images"))
                continue;
            addPictureRow(isShownAtOnce(run) ? html : folded, run,
                          truth["file"].get<std::string>());
        }
        if (!folded.empty())
            html += "<details><summary>The other runs</summary>\n" + folded + "</details>\n";
    }
}

void addProvenance(std::string& html, const Json& results) {
    html += "<div class=\"scroll\"><table><tbody>\n";
    const auto row = [&](const std::string& name, const std::string& value) {
        html += "<tr><td>" + name + "</td><td class=\"wide\">" + value + "</td></tr>\n";
    };
    for (const auto& [key, value] : results["provenance"].items())
        row(escaped(key), text(value));
    for (const Json& scene : results["scenes"])
        row("scene", text(scene["scene"]) + ", hash " + text(scene["scene_hash"]) + ", " +
                         grouped(scene["triangle_count"].get<double>()) + " triangles, " +
                         text(scene["light_count"]) + " lights");
    for (const auto& [key, value] : results["experiment"].items())
        row(escaped(key), text(value));
    html += "</tbody></table></div>\n";
}

} // namespace

std::string flatCsv(const Json& rows) {
    std::string csv;
    if (rows.empty())
        return csv;
    std::vector<std::string> columns;
    for (const auto& [key, value] : rows.front().items())
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
    // Nested objects become columns of their own; every row gets every column, in order of first
    // appearance.
    std::vector<Json> flat;
    Json all = Json::object();
    for (const Json& run : runs) {
        Json row = Json::object();
        for (const auto& [key, value] : run.items()) {
            if (key == "visibility_histogram" || key == "images")
                continue;
            if (!value.is_object()) {
                row[key] = value;
                continue;
            }
            for (const auto& [inner, innerValue] : value.items())
                row[key + "." + inner] = innerValue;
        }
        for (const auto& [key, value] : row.items())
            all[key] = "";
        flat.push_back(std::move(row));
    }
    Json rows = Json::array();
    for (const Json& row : flat) {
        Json full = all;
        full.update(row);
        rows.push_back(std::move(full));
    }
    return flatCsv(rows);
}

std::string reportHtml(const Json& results, const Json& charts) {
    const Json& runs = results["runs"];
    const Json sequence = results.value("sequence_runs", Json::array());
    std::string title = results["experiment"]["title"].get<std::string>();
    if (title.empty())
        title = "Shadows by rays and by maps: time against error";
    std::string html = pageStart(title);
    html += "<h1>" + escaped(title) + "</h1>\n<p class=\"lead\">" +
            std::to_string(runs.size() + sequence.size()) + " runs on ";
    for (size_t i = 0; i < results["scenes"].size(); ++i)
        html += (i == 0 ? "" : ", ") + text(results["scenes"][i]["scene"]) + " (" +
                grouped(results["scenes"][i]["triangle_count"].get<double>()) + " triangles, " +
                text(results["scenes"][i]["light_count"]) + " lights)";
    html += " at " + text(results["experiment"]["size"]) + " pixels, " +
            text(results["provenance"]["cpu"]) + ", " +
            text(results["provenance"]["thread_count"]) + " threads, backend " +
            text(results["provenance"]["backend"]) +
            ". Every (visible point, light) pair is held against Embree.</p>\n";
    for (const Json& what : results["provenance"].value("left_out", Json::array()))
        html += "<p class=\"note\">Left out: " + text(what) + "</p>\n";
    const bool hasCharts = !charts.is_null() && !charts["charts"].empty();
    html += std::string("<nav>") + (hasCharts ? "<a href=\"#charts\">Charts</a>" : "") +
            "<a href=\"#table\">Table</a><a "
            "href=\"#pictures\">Pictures</a>"
            "<a href=\"#provenance\">Provenance</a><a href=\"#limits\">Limits</a><a "
            "href=\"results.json\">results.json</a>"
            "<a href=\"results.csv\">results.csv</a>" +
            (sequence.empty() ? "" : "<a href=\"sequence.csv\">sequence.csv</a>") +
            "<a href=\"lights.csv\">lights.csv</a>"
            "<a href=\"costs.json\">costs.json</a></nav>\n";
    addFindings(html, runs);
    if (hasCharts) {
        const Json& list = charts["charts"];
        html += "<h2 id=\"charts\">Charts</h2>\n";
        addFigure(html, list[0], "main");
        html += "<div class=\"charts\">\n";
        for (size_t i = 1; i < list.size(); ++i)
            addFigure(html, list[i], "");
        html += "</div>\n";
    }
    if (!sequence.empty())
        html += sequenceTableHtml(sequence);
    if (!runs.empty()) {
        html +=
            "<h2 id=\"table\">All runs</h2>\n<p>Click a heading to sort. Mean error is the mean of "
            "|visibility - Embree's| "
            "over all pairs; unexplained, acne and contact are counts of wrong pairs. Of the "
            "unexplained false "
            "shadows, those under \u201cof these aimed\u201d are found by a shift aimed at the "
            "blocker. Pool says by what "
            "all resolutions were divided where the pages wanted did not fit.</p>\n";
        addTable(html, runs);
    }
    addPictures(html, results);
    html += "<h2 id=\"provenance\">Provenance</h2>\n";
    addProvenance(html, results);
    html +=
        "<h2 id=\"limits\">Limits</h2>\n<ul>\n"
        "<li>Times are medians of interleaved runs on this machine; the spread is in the table. "
        "They hold what a frame "
        "does: no loading, no voxelizing, no truth, no copies for this report.</li>\n"
        "<li>Embree's time is that of its shadow rays alone, without G-buffer and shading.</li>\n"
        "<li>Every frame stands for itself: resolutions that an animation would have kept from the "
        "frame before are "
        "forgotten. Frames in sequence keep them.</li>\n"
        "<li>Voxels hold what stands still; rays are held against the triangles of what "
        "moves.</li>\n"
        "<li>The cost of a map is measured with nothing else running, then scaled so that the "
        "costs "
        "of all maps by one method add up to the frame by that method.</li>\n"
        "<li>96 texels is the paper's threshold at 1920 x 1080; a frame of 640 x 360 requests a "
        "third of the "
        "resolution, so 32 is its equivalent there.</li>\n</ul>\n";
    html += "<script>" + std::string(kScript) + "</script>\n</body></html>\n";
    return html;
}

} // namespace shadowdag
