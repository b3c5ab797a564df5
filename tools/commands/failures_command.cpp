// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare failures`: the matrix of failures as a report.
#include "tools/studies/failures.h"

#include "cuda/error.h"
#include "tools/report/csv.h"
#include "tools/report/report_run.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"

#include <ostream>

namespace shadowdag {

void requireHeld(const Json& matrix, const std::string& report) {
    const std::vector<std::string> broken = brokenLines(matrix);
    if (!broken.empty())
        throw NotHeld(std::to_string(broken.size()) + " of " +
                      std::to_string(matrix["cells"].size() + matrix["remedies"].size()) +
                      " cells and remedies do not hold, the first: " + broken.front() +
                      "; all stand in " + report);
}

void runFailures(const FailuresCommand& command, const Console& console) {
    MatrixRequest request;
    request.backend = command.backend;
    if (!command.names.empty())
        request.names = parseList("--only", command.names);
    failuresNamed(request.names); // refused before anything is put away
    const ReportRun run(command.output, "failures", console);
    request.pictureDirectory = run.partial() + "/images";
    request.progress = run.progress();
    const Json matrix = measureFailures(request);
    const std::vector<std::string> broken = brokenLines(matrix);
    Json results = {{"provenance", buildProvenance(command.backend)}};
    results.update(matrix);
    results["broken"] = broken;
    results["study"] = failuresStudy();
    results["settings"] = failureSettingHelps();
    run.write("failures.json", jsonText(results));
    run.write("failures.csv", runsCsv(matrix["cells"]));
    const std::string report = run.publish();

    for (const Json& cell : matrix["left_out"])
        console.note("left out: " + cell["failure"].get<std::string>() + " by " +
                     cell["method"].get<std::string>() + ": " + cell["why"].get<std::string>());
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
                  {"left_out_count", matrix["left_out"].size()},
                  {"wall_s", run.wallSeconds()}});
    requireHeld(matrix, report);
}

} // namespace shadowdag
