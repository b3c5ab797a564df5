// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare mechanisms`: what each mechanism buys, as a report.
#include "scenes/output_file.h"
#include "tools/charts_run.h"
#include "tools/console.h"
#include "tools/journal.h"
#include "tools/mechanisms.h"
#include "tools/parse.h"
#include "tools/provenance.h"
#include "tools/report_directory.h"

#include <chrono>
#include <ostream>

namespace shadowdag {

namespace {

void writeFile(const std::string& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

} // namespace

void runMechanisms(const MechanismsCommand& command, const Console& console) {
    const auto start = std::chrono::steady_clock::now();
    MechanismsRequest request;
    request.backend = command.backend;
    if (!command.names.empty())
        request.names = parseList("--only", command.names);
    const std::string script = command.noCharts ? "" : findCharts("mechanisms_chart.py");
    const DirectoryLock lock = prepareDirectory(command.output, false, false);
    const std::string partial = command.output + "/partial";
    // Tells a later compare that what lies in `partial` is ours.
    const Journal journal(partial + "/journal.json", "mechanisms", false);
    const Progress bar = console.progress("compare mechanisms");
    request.progress = [&](double share) {
        checkInterrupted();
        if (bar)
            bar(share);
    };
    Json results = {{"provenance", buildProvenance(command.backend)}};
    results.update(compareMechanisms(request));
    const std::vector<std::string> lines = disagreements(results);
    results["disagreements"] = lines;
    writeFile(partial + "/mechanisms.json", jsonText(results));
    writeFile(partial + "/mechanisms.csv", mechanismsCsv(results));
    if (!command.noCharts)
        drawCharts(script, partial + "/mechanisms.json", partial + "/charts");
    writeFile(partial + "/index.html",
              mechanismsHtml(results, results["provenance"],
                             command.noCharts ? "" : "charts/mechanisms.svg"));
    checkInterrupted();
    swapReport(command.output);

    for (const Json& row : results["mechanisms"])
        console.people() << row["name"].get<std::string>() << ": "
                         << row["verdict"].get<std::string>() << "; "
                         << row["reason"].get<std::string>() << "\n";
    for (const std::string& line : lines)
        console.people() << "default against verdict: " << line << "\n";
    const std::string report = command.output + "/index.html";
    console.people() << results["mechanisms"].size() << " mechanisms, " << lines.size()
                     << " defaults are not as their verdicts say; report: " << report << "\n";
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.emit({{"report", report},
                  {"results", command.output + "/mechanisms.json"},
                  {"mechanism_count", results["mechanisms"].size()},
                  {"disagreements", lines},
                  {"wall_s", wall}});
}

} // namespace shadowdag
