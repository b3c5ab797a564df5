// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare failures`: the matrix of failures as a report.
#include "tools/failures.h"

#include "cuda/error.h"
#include "scenes/output_file.h"
#include "tools/console.h"
#include "tools/journal.h"
#include "tools/parse.h"
#include "tools/provenance.h"
#include "tools/report.h"
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

void requireHeld(const Json& matrix, const std::string& report) {
    const std::vector<std::string> broken = brokenLines(matrix);
    if (!broken.empty())
        throw NotHeld(std::to_string(broken.size()) + " of " +
                      std::to_string(matrix["cells"].size() + matrix["remedies"].size()) +
                      " cells and remedies do not hold, the first: " + broken.front() +
                      "; all stand in " + report);
}

void runFailures(const FailuresCommand& command, const Console& console) {
    const auto start = std::chrono::steady_clock::now();
    MatrixRequest request;
    request.backend = command.backend;
    if (!command.names.empty())
        request.names = parseList("--only", command.names);
    const DirectoryLock lock = prepareDirectory(command.output, false, false);
    const std::string partial = command.output + "/partial";
    // Tells a later compare that what lies in `partial` is ours.
    const Journal journal(partial + "/journal.json", "failures", false);
    request.pictureDirectory = partial + "/images";
    const Progress bar = console.progress("compare failures");
    request.progress = [&](double share) {
        checkInterrupted();
        if (bar)
            bar(share);
    };
    const Json matrix = measureFailures(request);
    const Json provenance = buildProvenance(command.backend);
    const std::vector<std::string> broken = brokenLines(matrix);
    Json results = {{"provenance", provenance}};
    results.update(matrix);
    results["broken"] = broken;
    writeFile(partial + "/failures.json", jsonText(results));
    writeFile(partial + "/failures.csv", runsCsv(matrix["cells"]));
    writeFile(partial + "/index.html", failuresHtml(matrix, provenance));
    checkInterrupted();
    swapReport(command.output);

    const std::string report = command.output + "/index.html";
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (const std::string& line : broken)
        console.people() << line << "\n";
    console.people() << matrix["cells"].size() << " cells, " << matrix["remedies"].size()
                     << " remedies, " << broken.size() << " do not hold; report: " << report
                     << "\n";
    console.emit({{"report", report},
                  {"results", command.output + "/failures.json"},
                  {"cell_count", matrix["cells"].size()},
                  {"remedy_count", matrix["remedies"].size()},
                  {"broken", broken},
                  {"wall_s", wall}});
    requireHeld(matrix, report);
}

} // namespace shadowdag
