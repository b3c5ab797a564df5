// SPDX-License-Identifier: Apache-2.0
// Reads the rows of mutants, and reports which check notices which fault.
#include "tools/report/csv.h"
#include "tools/settings/console.h"
#include "tools/studies/mutants.h"

#include "cuda/error.h"

#include <algorithm>
#include <iterator>
#include <ostream>
#include <set>

namespace shadowdag {

namespace {

/// Returns the names of the checks that notice a fault, each once, in order.
std::vector<std::string> checksOf(const Json& mutant) {
    std::vector<std::string> checks;
    for (const Json& notice : mutant["notices"]) {
        const std::string check = notice["check"];
        if (std::find(checks.begin(), checks.end(), check) == checks.end())
            checks.push_back(check);
    }
    return checks;
}

std::string joined(const std::vector<std::string>& words) {
    std::string all;
    for (const std::string& word : words)
        all += (all.empty() ? "" : ", ") + word;
    return all;
}

/// Returns the scene of a row of the failure table or of a sequence of frames, "" if there is none.
std::string sceneOf(const MutantTable& table, const std::string& judge) {
    for (const Failure& failure : table.failures)
        if (failure.name == judge)
            return failure.scene;
    for (const MutantFrames& frames : table.frames)
        if (frames.row.name == judge)
            return frames.row.scene;
    return "";
}

/// Returns what is wrong with a result, "" for nothing.
std::string complaintOf(const Json& mutant) {
    const std::string name = mutant["name"], checks = joined(checksOf(mutant));
    const bool isNoticed = !checks.empty(), isHarmless = mutant["harmless"] != "";
    if (name == kNoMutant)
        return isNoticed ? "without a fault " + checks + " complain" : "";
    if (!mutant["is_used"].get<bool>())
        return name + ": is never used; add a row of the failure table that uses it";
    if (isHarmless)
        return isNoticed ? name + ": is listed as harmless, but " + checks + " notice it" : "";
    return isNoticed
               ? ""
               : name + ": survives; no check notices that " + mutant["what"].get<std::string>();
}

class MutantStudy : public Study {
public:
    MutantStudy(const StudyFile& file, const StudyRequest& request, const Console& console)
        : file_(file), table_(readMutants(file)), console_(console) {
        if (!kHasMutants)
            throw Error(ErrorKind::kUsage, "study mutants: this program is built without "
                                           "assertions and contains no faults; configure with "
                                           "cmake --preset ci, which has them, and build");
        if (request.backend != Backend::kCpu)
            throw Error(ErrorKind::kUsage, "study mutants: its faults are in the code of the CPU; "
                                           "use --backend cpu");
        if (!request.scenes.empty())
            throw Error(ErrorKind::kUsage, "study mutants judges by rows of the failure table; "
                                           "give no scenes");
        std::vector<std::string> names{kNoMutant};
        for (const MutantRow& row : table_.rows)
            names.push_back(row.name);
        MutantRow all{kNoMutant, {}, ""}; // judged by all rows that judge one of the chosen
        for (const size_t index : chooseRows(names, request.names)) {
            if (index == 0 && !request.names.empty())
                all.judges = allJudges();
            else if (index > 0)
                rows_.push_back(table_.rows[index - 1]);
        }
        if (request.names.empty())
            all.judges = allJudges();
        if (!all.judges.empty())
            rows_.insert(rows_.begin(), all);
    }

    std::vector<std::string> parts() const override {
        std::vector<std::string> names;
        for (const MutantRow& row : rows_)
            names.push_back(row.name);
        return names;
    }
    std::vector<std::string> scenes() const override {
        std::vector<std::string> scenes;
        for (const MutantRow& row : rows_)
            for (const std::string& judge : row.judges)
                if (const std::string scene = sceneOf(table_, judge);
                    std::find(scenes.begin(), scenes.end(), scene) == scenes.end())
                    scenes.push_back(scene);
        return scenes;
    }
    Json measure(size_t part, const StudyRequest& request) override {
        const MutantRow& row = rows_.at(part);
        const bool isHere = row.name == kNoMutant || chosenMutant() != Mutant::kNone;
        const Json result = isHere ? measureMutant(table_, row, request, console_)
                                   : measureInOwnProcess(file_, table_, row);
        return {{"mutants", Json::array({result})}};
    }
    Json join(std::vector<Json> parts) const override {
        Json results = Study::join(std::move(parts));
        setExcess(results["mutants"]);
        return results;
    }
    std::vector<std::string> brokenLines(const Json& results) const override {
        std::vector<std::string> lines;
        for (const Json& mutant : results["mutants"])
            if (const std::string line = complaintOf(mutant); !line.empty())
                lines.push_back(line);
        return lines;
    }
    std::string judged(const Json& results) const override {
        const Json c = counts(results);
        return c["fault_count"].dump() + " faults, " + c["noticed_count"].dump() + " noticed";
    }
    void print(const Json& results, const Console& console) const override {
        for (const Json& mutant : results["mutants"]) {
            const std::string checks = joined(checksOf(mutant));
            console.people() << mutant["name"].get<std::string>() << ": "
                             << (checks.empty() ? "nothing" : checks) << "\n";
        }
    }
    std::string csv(const Json& results) const override {
        Json rows = Json::array();
        for (const Json& mutant : results["mutants"]) {
            std::set<std::string> where;
            for (const Json& notice : mutant["notices"])
                where.insert(notice["row"].get<std::string>());
            rows.push_back({{"name", mutant["name"]},
                            {"what", mutant["what"]},
                            {"is_used", mutant["is_used"]},
                            {"harmless", mutant["harmless"]},
                            {"checks", joined(checksOf(mutant))},
                            {"rows", joined({where.begin(), where.end()})}});
        }
        return flatCsv(rows);
    }
    Json counts(const Json& results) const override {
        uint64_t faults = 0, noticed = 0;
        for (const Json& mutant : results["mutants"]) {
            const bool isFault = mutant["name"] != kNoMutant && mutant["harmless"] == "";
            faults += isFault;
            noticed += isFault && !mutant["notices"].empty();
        }
        return {{"fault_count", faults}, {"noticed_count", noticed}};
    }

private:
    std::vector<std::string> allJudges() const {
        std::vector<std::string> judges;
        for (const MutantRow& row : table_.rows)
            for (const std::string& judge : row.judges)
                if (std::find(judges.begin(), judges.end(), judge) == judges.end())
                    judges.push_back(judge);
        return judges;
    }

    StudyFile file_;
    MutantTable table_;
    std::vector<MutantRow> rows_;
    const Console& console_;
};

} // namespace

MutantTable readMutants(const StudyFile& file) {
    MutantTable table;
    readStudy(file, [&](StudyReader& study) {
        const FailureTable failures = readFailures(findStudy(study.required("failures")));
        table.failures = failures.rows;
        table.slack = failures.slack;
        study.number("limit_s", table.limitSeconds, 1, 86400);
        study.list("frames", "frames", [&](StudyReader& reader) {
            MutantFrames frames;
            frames.row.name = reader.required("name");
            frames.row.scene = reader.required("scene");
            frames.row.what = reader.required("what");
            frames.row.always = reader.settings("settings");
            reader.number("step_s", frames.row.stepSeconds, 0, 1e6);
            reader.number("frames", frames.row.frameCount, 1, 1000);
            reader.flag("moves_lights", frames.movesLights);
            frames.row.isBounded = false;
            table.frames.push_back(frames);
        });
        const auto readJudges = [&](StudyReader& reader) {
            std::vector<std::string> names;
            reader.texts("judges", names);
            for (const std::string& name : names)
                if (sceneOf(table, name).empty())
                    reader.refuse("judges", name,
                                  "must name rows of the study \"failures\" or of \"frames\"");
            return names;
        };
        const std::vector<std::string> judges = readJudges(study);
        study.rows([&](StudyReader& reader) {
            MutantRow row;
            row.name = reader.required("name");
            if (std::none_of(std::begin(kMutantTexts), std::end(kMutantTexts),
                             [&](const MutantText& text) { return row.name == text.name; }))
                reader.refuse("name", row.name, "must be a fault of cuda/mutant.h");
            row.judges = judges;
            for (const std::string& name : readJudges(reader))
                row.judges.push_back(name);
            reader.text("harmless", row.harmless);
            table.rows.push_back(row);
        });
        study.requireRows(table.rows.size());
    });
    return table;
}

std::unique_ptr<Study> makeMutantStudy(const StudyFile& file, const StudyRequest& request,
                                       const Console& console) {
    return std::make_unique<MutantStudy>(file, request, console);
}

} // namespace shadowdag
