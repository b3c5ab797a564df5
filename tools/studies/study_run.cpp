// SPDX-License-Identifier: Apache-2.0
// The runner of studies: directory, journal, parts, report, verdict.
#include "tools/report/report_package.h"
#include "tools/report/results_identity.h"
#include "tools/settings/console.h"
#include "tools/settings/json_file.h"
#include "tools/settings/provenance.h"
#include "tools/studies/study.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/report_directory.h"
#include "tools/workspace/scene_setup.h"
#include "tools/workspace/timing.h"
#include "tools/workspace/whole_file.h"

#include "cuda/error.h"
#include "scenes/builtin.h"

#include <chrono>
#include <filesystem>
#include <ostream>
#include <set>

namespace shadowdag {

namespace {

/// Measures all parts; those in the journal are reused.
Json measureParts(Study& study, StudyRequest request, const std::function<void(double)>& progress,
                  Journal& journal) {
    const std::vector<std::string> parts = study.parts();
    std::vector<Json> measured;
    for (size_t i = 0; i < parts.size(); ++i) {
        request.progress = [&](double share) {
            checkInterrupted();
            if (progress)
                progress((double(i) + share) / double(parts.size()));
        };
        if (!journal.find(parts[i]))
            journal.set(parts[i], study.measure(i, request));
        measured.push_back(*journal.find(parts[i]));
        request.progress(1.0);
    }
    return study.join(std::move(measured));
}

/// Throws what loading the scenes throws: scenes that are not there, files that are damaged or have
/// no lights where the study needs some.
void requireScenes(const std::vector<std::string>& scenes, bool needsLights) {
    for (const std::string& scene : scenes)
        requireScene(scene);
    const Console silent(Console::Listener{[](const std::string&) {}, {}});
    for (const std::string& scene : std::set<std::string>(scenes.begin(), scenes.end())) {
        checkInterrupted();
        if (!scene.starts_with("builtin:"))
            loadSceneAndWorld(scene, -1, 1, needsLights, silent);
    }
}

} // namespace

Json Study::join(std::vector<Json> parts) const {
    Json results = Json::object();
    for (Json& part : parts)
        for (auto& [key, value] : part.items()) {
            if (!results.contains(key))
                results[key] = std::move(value);
            else if (value.is_array())
                for (Json& item : value)
                    results[key].push_back(std::move(item));
        }
    return results;
}

Json measureAll(Study& study, const StudyRequest& request) {
    Journal journal("", "", false);
    return measureParts(study, request, request.progress, journal);
}

void runStudy(const StudyFile& file, Study& study, const StudyRequest& asked,
              const StudyCommand& command, const Console& console) {
    const auto start = std::chrono::steady_clock::now();
    const std::string kind = file.json["kind"], resultsFile = kind + ".json";
    std::error_code ignored;
    if (command.resume &&
        !std::filesystem::exists(command.output + "/partial/journal.json", ignored))
        throw Error(ErrorKind::kUsage, "--resume: " + command.output +
                                           " contains no unfinished study; run without --resume");
    const ReportPackage package(study.drawsCharts() && !command.noCharts, console);
    const std::vector<std::string> scenes = study.scenes();
    requireScenes(scenes, study.needsLights());
    if (const std::string remark = remarkOnReplaced(command.output, {{"study", file.json}});
        !remark.empty())
        console.note(remark);
    const ReportDirectory held(command.output, command.resume, false);
    const std::string partial = command.output + "/partial";
    const Json provenance = buildProvenance(asked.backend);
    Json key = provenance;
    key["study"] = file.json;
    key["names"] = asked.names;
    key["inputs"] = inputHashes(scenes, {});
    Journal journal(partial + "/journal.json", key, command.resume);
    if (const std::string remark = remarkOn(journal); !remark.empty())
        console.note("resume: " + remark);
    StudyRequest request = asked;
    request.pictureDirectory = partial + "/images";
    const CpuUse use;
    const Json measured =
        measureParts(study, request, console.progress("study " + file.name), journal);
    std::vector<std::string> warnings = fewPairsWarnings(measured);
    if (const std::string busy = busyRemark(use.otherShare()); study.takesTimes() && !busy.empty())
        warnings.push_back(busy);
    const std::vector<std::string> broken = study.brokenLines(measured);

    Json results = {{"provenance", provenance}, {"study", file.json}, {"inputs", key["inputs"]}};
    results.update(measured);
    if (study.takesTimes())
        results["other_cpu_share"] = otherShareJson(use.otherShare());
    if (!warnings.empty())
        results["warnings"] = warnings;
    results[study.mustHold() ? "broken" : "disagreements"] = broken;
    const auto write = [&](const std::string& name, const std::string& text) {
        writeWholeFile(partial + "/" + name, text);
    };
    write(resultsFile, jsonText(results));
    write(kind + ".csv", study.csv(results));
    package.writePage(kind, partial);
    checkInterrupted();
    swapReport(command.output);

    const std::string report =
        command.output + "/" + (package.hasPage() ? "index.html" : resultsFile);
    study.print(results, console);
    for (const std::string& warning : warnings)
        console.note("warning: " + warning);
    for (const std::string& line : broken)
        console.people() << line << "\n";
    console.people() << study.judged(results) << ", " << broken.size()
                     << " do not hold; report: " << report << "\n";
    Json said = {{"report", report}, {"results", command.output + "/" + resultsFile}};
    said.update(study.counts(results));
    said[study.mustHold() ? "broken" : "disagreements"] = broken;
    said["wall_s"] =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.emit(said);
    if (study.mustHold() && !broken.empty())
        throw NotHeld(study.judged(results) + ": " + std::to_string(broken.size()) +
                      " do not hold, the first: " + broken.front() + "; all are listed in " +
                      report);
}

} // namespace shadowdag
