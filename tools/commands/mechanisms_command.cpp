// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare mechanisms`: what each mechanism buys, as a report.
#include "tools/report/report_run.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/studies/mechanisms.h"

#include <ostream>

namespace shadowdag {

void runMechanisms(const MechanismsCommand& command, const Console& console) {
    MechanismsRequest request;
    request.backend = command.backend;
    if (!command.names.empty())
        request.names = parseList("--only", command.names);
    refuseUnknownMechanisms(request.names); // before anything is put away
    const ReportRun run(command.output, "mechanisms", console, !command.noCharts);
    request.progress = run.progress();
    Json results = {{"provenance", buildProvenance(command.backend)}};
    results.update(compareMechanisms(request));
    const std::vector<std::string> lines = disagreements(results);
    results["disagreements"] = lines;
    run.write("mechanisms.json", jsonText(results));
    run.write("mechanisms.csv", mechanismsCsv(results));
    const std::string report = run.publish();

    for (const Json& row : results["mechanisms"])
        console.people() << row["name"].get<std::string>() << ": "
                         << row["verdict"].get<std::string>() << "; "
                         << row["reason"].get<std::string>() << "\n";
    for (const std::string& line : lines)
        console.people() << "default against verdict: " << line << "\n";
    console.people() << results["mechanisms"].size() << " mechanisms, " << lines.size()
                     << " defaults are not as their verdicts say; report: " << report << "\n";
    console.emit({{"report", report},
                  {"results", command.output + "/mechanisms.json"},
                  {"mechanism_count", results["mechanisms"].size()},
                  {"disagreements", lines},
                  {"wall_s", run.wallSeconds()}});
}

} // namespace shadowdag
