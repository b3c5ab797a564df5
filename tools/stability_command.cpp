// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare stability`: bands of errors in time, under perturbation, numerically and over
// resolution, as a report.
#include "tools/stability.h"

#include "scenes/output_file.h"
#include "tools/charts_run.h"
#include "tools/console.h"
#include "tools/journal.h"
#include "tools/parse.h"
#include "tools/provenance.h"
#include "tools/report.h"
#include "tools/report_directory.h"

#include <chrono>
#include <fstream>
#include <ostream>

namespace shadowdag {

namespace {

void writeFile(const std::string& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

} // namespace

void runStability(const StabilityCommand& command, const Console& console) {
    const auto start = std::chrono::steady_clock::now();
    StabilityRequest request;
    request.backend = command.backend;
    if (!command.names.empty())
        request.names = parseList("--only", command.names);
    const std::string script =
        command.noCharts ? "" : findCharts("stability_chart.py", "pass --no-charts");
    const DirectoryLock lock = prepareDirectory(command.output, false, false);
    const std::string partial = command.output + "/partial";
    // Tells a later compare that what lies in `partial` is ours.
    const Journal journal(partial + "/journal.json", "stability", false);
    const Progress bar = console.progress("compare stability");
    request.progress = [&](double share) {
        checkInterrupted();
        if (bar)
            bar(share);
    };
    const Json measured = measureStability(request);
    const Json provenance = buildProvenance(command.backend);
    const std::vector<std::string> broken = unstableLines(measured);
    Json results = {{"provenance", provenance}};
    results.update(measured);
    results["broken"] = broken;
    writeFile(partial + "/stability.json", jsonText(results));
    writeFile(partial + "/stability.csv", flatCsv(measured["checks"]));
    Json charts;
    if (!script.empty()) {
        drawCharts(script, partial + "/stability.json", partial + "/charts");
        std::ifstream file(partial + "/charts/charts.json");
        charts = Json::parse(file);
    }
    writeFile(partial + "/index.html", stabilityHtml(measured, provenance, charts));
    checkInterrupted();
    swapReport(command.output);

    const std::string report = command.output + "/index.html";
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (const std::string& line : broken)
        console.people() << line << "\n";
    console.people() << measured["checks"].size() << " checks, " << broken.size()
                     << " do not hold; report: " << report << "\n";
    console.emit({{"report", report},
                  {"results", command.output + "/stability.json"},
                  {"check_count", measured["checks"].size()},
                  {"broken", broken},
                  {"wall_s", wall}});
    if (!broken.empty())
        throw NotHeld(
            std::to_string(broken.size()) + " of " + std::to_string(measured["checks"].size()) +
            " checks do not hold, the first: " + broken.front() + "; all stand in " + report);
}

} // namespace shadowdag
