// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare real`: real scenes against their bounds, as a report.
#include "tools/studies/real_scenes.h"

#include "tools/report/csv.h"
#include "tools/report/report_run.h"
#include "tools/settings/provenance.h"

#include <ostream>

namespace shadowdag {

Json realStudy() {
    Json rows = Json::array();
    for (const RealScene& scene : realScenes()) {
        Json unexplained = Json::array();
        for (const NamedErrors& errors : namedErrors())
            if (errors.scene == scene.name)
                unexplained.push_back({{"method", kMatrixMethodNames[size_t(errors.method)]},
                                       {"failure", errors.failure},
                                       {"reason", errors.reason}});
        rows.push_back({{"name", scene.name}, {"what", scene.what}, {"unexplained", unexplained}});
    }
    return {{"rows", rows}};
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
    const std::vector<std::string> broken = realBrokenLines(measured);
    Json results = {{"provenance", buildProvenance(command.backend)}};
    results.update(measured);
    results["broken"] = broken;
    results["study"] = realStudy();
    run.write("real.json", jsonText(results));
    run.write("real.csv", runsCsv(measured["cells"]));
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
