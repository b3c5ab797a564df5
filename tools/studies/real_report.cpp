// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare real`: real scenes against their bounds, as a report.
#include "tools/report/html.h"
#include "tools/studies/real_scenes.h"

#include "tools/report/report.h"
#include "tools/report/report_run.h"
#include "tools/settings/provenance.h"

#include <algorithm>
#include <ostream>

namespace shadowdag {

using namespace html;

namespace {

std::vector<const Json*> cellsOf(const Json& results, const std::string& scene) {
    std::vector<const Json*> cells;
    for (const Json& cell : results["cells"])
        if (cell["scene"] == scene)
            cells.push_back(&cell);
    return cells;
}

std::string percent(const Json& cell, const char* key) {
    return number(100.0 * cell[key].get<double>() / std::max(1.0, cell["pair_count"].get<double>()),
                  3);
}

void addFigure(std::string& html, const std::string& file, const std::string& caption) {
    html += "<figure><img loading=\"lazy\" src=\"images/" + escaped(file) + "\" alt=\"" +
            escaped(caption) + "\"><figcaption>" + escaped(caption) + "</figcaption></figure>";
}

void addTable(std::string& html, const std::vector<const Json*>& cells) {
    html += "<div class=\"scroll\"><table><thead><tr><th>Method</th><th>False shadow, %</th>"
            "<th>False light, %</th><th>Mean error</th><th>Unexplained</th><th>without a name</th>"
            "<th>Acne</th><th>Contact</th><th>Missing taps</th><th>Flicker</th><th>of answers</th>"
            "<th>Maps drawn</th><th>traced</th><th>Bounds</th></tr></thead><tbody>\n";
    for (const Json* cell : cells) {
        html += "<tr><td>" + text((*cell)["method"]) + "</td><td>" +
                percent(*cell, "false_shadow_count") + "</td><td>" +
                percent(*cell, "false_light_count") + "</td><td>" +
                number((*cell)["mean_abs_visibility_error"].get<double>(), 5) + "</td>";
        for (const char* key : {"unexplained_count", "unnamed_count", "acne_count", "contact_count",
                                "missing_tap_count", "flicker_count", "flicker_answer_count",
                                "drawn_map_count", "traced_map_count"})
            html += "<td>" + grouped((*cell)[key].get<double>()) + "</td>";
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

void addScene(std::string& html, const Json& results, const std::string& scene) {
    const std::vector<const Json*> cells = cellsOf(results, scene);
    const Json& first = *cells.front();
    html += "<h2 id=\"" + escaped(scene) + "\">" + escaped(scene) + "</h2>\n<p>";
    for (const RealScene& known : realScenes())
        if (known.name == scene && first["known"] != "another file")
            html += escaped(known.what) + " ";
    html += grouped(first["triangle_count"].get<double>()) + " triangles, " +
            grouped(first["light_count"].get<double>()) + " lights, " +
            grouped(first["pair_count"].get<double>()) + " pairs in all frames, " +
            percent(first, "occluded_count") + " % of them dark.";
    if (!showsShadowEdge(first))
        html += " <b>It shows no shadow edge and proves nothing.</b>";
    if (first["known"] != "yes")
        html += " Its counts have no bounds (" + text(first["known"]) +
                "): it is held to what any scene is held to.";
    html += "</p>\n";
    for (const NamedErrors& named : namedErrors())
        if (named.scene == scene)
            html += "<p>By " + std::string(kMatrixMethodNames[size_t(named.method)]) +
                    " errors that neither the resolution nor the taps explain: <em>" +
                    escaped(named.failure) + "</em>. " + escaped(named.reason) + "</p>\n";
    for (const Json& picture : results["pictures"])
        if (picture["scene"] == scene) {
            html += "<div class=\"five\">";
            addFigure(html, picture["truth"].get<std::string>(), "The truth (Embree)");
            for (const Json* cell : cells)
                if (cell->contains("image"))
                    addFigure(html, (*cell)["image"].get<std::string>(),
                              "errors of " + (*cell)["method"].get<std::string>());
            html += "</div>\n";
        }
    addTable(html, cells);
}

} // namespace

std::string realHtml(const Json& results, const Json& provenance) {
    const std::string title = "Shadows in real scenes: maps, voxel rays and both";
    std::string html = pageStart(title);
    html +=
        "<style>.five { display: grid; grid-template-columns: repeat(5, 1fr); gap: .5rem; margin: "
        ".6rem 0; } .five figcaption { font-size: .8rem; }</style>\n<h1>" +
        title + "</h1>\n<p class=\"lead\">" + std::to_string(results["cells"].size()) +
        " cells: lit scenes that nobody staged, by four methods, " +
        std::to_string(kRealFrameCount) +
        " frames each, in which the camera moves about a pixel a frame. Every (visible point, "
        "light) pair is held against Embree. Settings: <code>" +
        text(results["settings"]) + "</code>.</p>\n";
    const std::vector<std::string> broken = realBrokenLines(results);
    html += broken.empty() ? "<p>Every cell holds.</p>\n"
                           : "<p class=\"note\">What does not hold:</p>\n<ul>\n";
    for (const std::string& line : broken)
        html += "<li class=\"note\">" + escaped(line) + "</li>\n";
    html += broken.empty() ? "<nav>" : "</ul>\n<nav>";
    std::vector<std::string> scenes;
    for (const Json& cell : results["cells"])
        if (scenes.empty() || scenes.back() != cell["scene"].get<std::string>())
            scenes.push_back(cell["scene"].get<std::string>());
    for (const std::string& scene : scenes)
        html += "<a href=\"#" + escaped(scene) + "\">" + escaped(scene) + "</a> ";
    html +=
        "<a href=\"real.json\">real.json</a> <a href=\"real.csv\">real.csv</a></nav>\n<p>In the "
        "pictures of errors <span class=\"key\" style=\"background:#d55e00\"></span>false shadow "
        "is where the method says dark and Embree lit, <span class=\"key\" "
        "style=\"background:#0072b2\"></span>false light the reverse. <em>Unexplained</em> is what "
        "no shift within the method's resolution explains; <em>without a name</em> what is left of "
        "that when shifts are aimed at the blocker and the truth is asked along the taps' own "
        "rays. <em>Acne</em> is what the receiver's own surface shadows, <em>contact</em> what "
        "lies within bias or offset, <em>flicker</em> answers that change from a frame to the next "
        "where Embree's do not. A cell holds while each count is at most what was measured once, a "
        "twentieth and 3 more (of dag-exact what was measured, of acne by rays none), nothing is "
        "without a name and some pairs are dark and some lit.</p>\n";
    for (const std::string& scene : scenes)
        addScene(html, results, scene);
    html += "<h2>Provenance</h2>\n<div class=\"scroll\"><table><tbody>\n";
    for (const auto& [key, value] : provenance.items())
        html +=
            "<tr><td>" + escaped(key) + "</td><td class=\"wide\">" + text(value) + "</td></tr>\n";
    return html + "</tbody></table></div>\n</body></html>\n";
}

void runReal(const RealCommand& command, const Console& console) {
    RealRequest request;
    request.backend = command.backend;
    request.cacheDirectory = command.cacheDirectory;
    request.files = realFiles(command.arguments, console); // refused before anything is put away
    const ReportRun run(command.output, "real", console);
    request.pictureDirectory = run.partial() + "/images";
    request.progress = run.progress();
    const Json measured = measureReal(request, console);
    const Json provenance = buildProvenance(command.backend);
    const std::vector<std::string> broken = realBrokenLines(measured);
    Json results = {{"provenance", provenance}};
    results.update(measured);
    results["broken"] = broken;
    run.write("real.json", jsonText(results));
    run.write("real.csv", runsCsv(measured["cells"]));
    run.write("index.html", realHtml(measured, provenance));
    const std::string report = run.publish();

    for (const std::string& line : broken)
        console.people() << line << "\n";
    console.people() << measured["cells"].size() << " cells, " << broken.size()
                     << " bounds do not hold; report: " << report << "\n";
    console.emit({{"report", report},
                  {"results", command.output + "/real.json"},
                  {"cell_count", measured["cells"].size()},
                  {"broken", broken},
                  {"wall_s", run.wallSeconds()}});
    if (!broken.empty())
        throw NotHeld(std::to_string(broken.size()) + " bounds of " +
                      std::to_string(measured["cells"].size()) + " cells do not hold, the first: " +
                      broken.front() + "; all stand in " + report);
}

} // namespace shadowdag
