// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare stability`: bands of errors in time, under perturbation, numerically and over
// resolution, as a report.
#include "tools/studies/stability.h"

#include "tools/report/csv.h"
#include "tools/report/report_run.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"

#include <ostream>

namespace shadowdag {

void runStability(const StabilityCommand& command, const Console& console) {
    StabilityRequest request;
    request.backend = command.backend;
    if (!command.names.empty())
        request.names = parseList("--only", command.names);
    stabilityGroupsNamed(request.names); // refused before anything is put away
    const ReportRun run(command.output, "stability", console, !command.noCharts);
    request.progress = run.progress();
    const Json measured = measureStability(request);
    const std::vector<std::string> broken = unstableLines(measured);
    Json results = {{"provenance", buildProvenance(command.backend)}};
    results.update(measured);
    results["broken"] = broken;
    results["study"] = stabilityStudy();
    run.write("stability.json", jsonText(results));
    run.write("stability.csv", flatCsv(measured["checks"]));
    const std::string report = run.publish();

    for (const std::string& line : broken)
        console.people() << line << "\n";
    console.people() << measured["checks"].size() << " checks, " << broken.size()
                     << " do not hold; report: " << report << "\n";
    console.emit({{"report", report},
                  {"results", command.output + "/stability.json"},
                  {"check_count", measured["checks"].size()},
                  {"broken", broken},
                  {"wall_s", run.wallSeconds()}});
    if (!broken.empty())
        throw NotHeld(
            std::to_string(broken.size()) + " of " + std::to_string(measured["checks"].size()) +
            " checks do not hold, the first: " + broken.front() + "; all stand in " + report);
}

} // namespace shadowdag
