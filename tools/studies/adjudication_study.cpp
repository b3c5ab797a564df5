// SPDX-License-Identifier: Apache-2.0
// Reads the rows of adjudications, and reports which tracers answer which pairs wrongly.
#include "tools/report/csv.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"
#include "tools/settings/words.h"
#include "tools/studies/adjudication.h"
#include "tools/studies/cell_setup.h"
#include "tools/studies/real_scenes.h"

#include "cuda/error.h"

#include <algorithm>
#include <map>
#include <ostream>
#include <tuple>

namespace shadowdag {

namespace {

class AdjudicationStudy : public Study {
public:
    AdjudicationStudy(const StudyFile& file, const StudyRequest& request, const Console& console)
        : table_(readAdjudication(file)), console_(console) {
        if (request.backend != Backend::kCpu)
            throw Error(ErrorKind::kUsage, "study adjudication: its tracers run on the CPU; use "
                                           "--backend cpu");
        const bool hasFiles =
            std::any_of(table_.rows.begin(), table_.rows.end(),
                        [](const AdjudicationRow& row) { return !row.geometryHash.empty(); });
        if (!request.scenes.empty() && !request.names.empty() && !hasFiles)
            throw Error(ErrorKind::kUsage, "--only and scenes of your own contradict each other: "
                                           "the scenes given are judged; drop one");
        if (request.scenes.empty() && hasFiles)
            throw Error(ErrorKind::kUsage, "study " + file.name +
                                               " judges files that do not come with the program: "
                                               "give their folder after the study's name");
        std::map<std::string, std::string> given; // by stem
        if (!request.scenes.empty()) {
            RealTable places; // directories are read as those of study real
            places.placedLightCount = int(table_.placedLightCount);
            for (const std::string& scene : realFiles(places, request.scenes, console))
                given[sceneStem(scene)] = scene;
        }
        if (request.scenes.empty() || hasFiles)
            addRows(request.names, given);
        if (request.names.empty())
            for (const auto& [name, scene] : given)
                rows_.push_back({name, scene, "", table_.givenPairLimit, 0.0});
        if (std::all_of(rows_.begin(), rows_.end(),
                        [](const AdjudicationRow& row) { return row.scene.empty(); }))
            throw Error(ErrorKind::kUsage, "study " + file.name +
                                               ": the scenes given hold none of the files of its "
                                               "rows, " +
                                               joined(names(rows_)));
    }

    std::vector<std::string> parts() const override { return names(rows_); }
    std::vector<std::string> scenes() const override {
        std::vector<std::string> scenes;
        for (const AdjudicationRow& row : rows_)
            if (!row.scene.empty())
                scenes.push_back(row.scene);
        return scenes;
    }
    bool usesCache() const override { return true; }
    bool needsLights() const override { return table_.placedLightCount == 0; }
    Json measure(size_t part, const StudyRequest& request) override {
        const AdjudicationRow& row = rows_.at(part);
        if (row.scene.empty())
            return {{"verdicts", Json::array()},
                    {"cells", Json::array()},
                    {"skipped", {{{"scene", row.name}, {"reason", "its file was not given"}}}}};
        return measureAdjudication(table_, row, request, console_);
    }
    std::vector<std::string> brokenLines(const Json& results) const override {
        std::vector<std::string> lines;
        if (results["verdicts"].empty())
            lines.push_back("every row was skipped, so nothing was judged");
        for (const Json& cell : results["cells"])
            if (isFaultless(cell["tracer"]) && cell["wrong_count"] != 0)
                lines.push_back(cell["scene"].get<std::string>() + " by " +
                                cell["tracer"].get<std::string>() + ": " +
                                cell["wrong_count"].dump() + " of " + cell["pair_count"].dump() +
                                " pairs are proven wrong; none may be");
        for (const Json& scene : results["verdicts"])
            for (const auto& [tracer, right] : {std::pair{"truth", "exact_right_count"},
                                                std::pair{"exact packets", "truth_right_count"}})
                if (isFaultless(tracer) && scene["disputed"][right] != 0)
                    lines.push_back(scene["scene"].get<std::string>() + " by " + tracer + ": " +
                                    scene["disputed"][right].dump() + " of " +
                                    scene["disputed"]["count"].dump() +
                                    " disputed pairs are proven wrong; none may be");
        for (const Json& scene : results["verdicts"])
            if (scene["ambiguous_count"].get<double>() >
                table_.mostAmbiguousShare * scene["pair_count"].get<double>())
                lines.push_back(scene["scene"].get<std::string>() + ": " +
                                scene["ambiguous_count"].dump() + " of " +
                                scene["pair_count"].dump() +
                                " pairs are ambiguous, more than the study allows");
        return lines;
    }
    std::string judged(const Json& results) const override {
        const Json c = counts(results);
        return c["pair_count"].dump() + " pairs, " + c["ambiguous_count"].dump() + " ambiguous, " +
               c["faultless_wrong_count"].dump() + " answered wrongly by " + faultlessNames() +
               "; " + c["disputed_count"].dump() +
               " pairs disputed between the truth and exact rays, " +
               c["disputed_ambiguous_count"].dump() + " of these ambiguous";
    }
    void print(const Json& results, const Console& console) const override {
        for (const Json& cell : results["cells"])
            console.people() << cell["scene"].get<std::string>() << " by "
                             << cell["tracer"].get<std::string>() << ": "
                             << cell["wrong_count"].dump() << " of " << cell["pair_count"].dump()
                             << " wrong\n";
        for (const Json& row : results["skipped"])
            console.people() << row["scene"].get<std::string>()
                             << " is skipped: " << row["reason"].get<std::string>() << "\n";
    }
    std::string csv(const Json& results) const override {
        return flatCsv(results["cells"], {"wrong_pairs"});
    }
    Json counts(const Json& results) const override {
        uint64_t pairs = 0, ambiguous = 0, wrong = 0, disputed = 0, disputedAmbiguous = 0;
        for (const Json& scene : results["verdicts"]) {
            pairs += scene["pair_count"].get<uint64_t>();
            ambiguous += scene["ambiguous_count"].get<uint64_t>();
            disputed += scene["disputed"]["count"].get<uint64_t>();
            disputedAmbiguous += scene["disputed"]["ambiguous_count"].get<uint64_t>();
        }
        for (const Json& cell : results["cells"])
            if (isFaultless(cell["tracer"]))
                wrong += cell["wrong_count"].get<uint64_t>();
        return {{"pair_count", pairs},
                {"ambiguous_count", ambiguous},
                {"faultless_wrong_count", wrong},
                {"disputed_count", disputed},
                {"disputed_ambiguous_count", disputedAmbiguous},
                {"skipped_count", results["skipped"].size()}};
    }
    std::string needsBeyondGl() const override { return "rays against triangles"; }

private:
    static std::vector<std::string> names(const std::vector<AdjudicationRow>& rows) {
        std::vector<std::string> names;
        for (const AdjudicationRow& row : rows)
            names.push_back(row.name);
        return names;
    }
    static std::string joined(const std::vector<std::string>& words) {
        std::string all;
        for (const std::string& word : words)
            all += (all.empty() ? "" : ", ") + word;
        return all;
    }
    /// Adds the chosen rows of the study, those of files with the file that was given, and removes
    /// these from `given`.
    void addRows(const std::vector<std::string>& chosen,
                 std::map<std::string, std::string>& given) {
        for (const size_t index : chooseRows(names(table_.rows), chosen)) {
            rows_.push_back(table_.rows[index]);
            const auto found = given.find(rows_.back().name);
            if (rows_.back().geometryHash.empty() || found == given.end())
                continue;
            rows_.back().scene = found->second;
            given.erase(found);
        }
    }

    /// Returns "truth, exact packets or exact single": those that may answer nothing wrongly.
    std::string faultlessNames() const {
        std::vector<std::string> names;
        for (const Tracer tracer : table_.faultless)
            names.push_back(kTracerNames[size_t(tracer)]);
        return names.empty() ? "tracers that may answer nothing wrongly" : orText(names);
    }
    bool isFaultless(const std::string& tracer) const {
        return std::any_of(table_.faultless.begin(), table_.faultless.end(), [&](Tracer faultless) {
            return tracer == kTracerNames[size_t(faultless)];
        });
    }

    AdjudicationTable table_;
    std::vector<AdjudicationRow> rows_;
    const Console& console_;
};

} // namespace

AdjudicationTable readAdjudication(const StudyFile& file) {
    AdjudicationTable table;
    readStudy(file, [&](StudyReader& study) {
        table.settings = study.settings("settings");
        study.number("pairs_of_given_scenes", table.givenPairLimit, 0, 1e9);
        study.number("placed_lights", table.placedLightCount, 0, kMaxPlacedLightCount);
        study.number("ambiguous_share", table.mostAmbiguousShare, 0, 1);
        std::string size = "640x360";
        study.text("disputed_size", size);
        try {
            std::tie(table.disputedWidth, table.disputedHeight) = parseSize("disputed_size", size);
        } catch (const Error& error) {
            throw Error(ErrorKind::kInput, file.path + ": " + error.what());
        }
        for (const size_t tracer : study.choices("faultless", kTracerNames))
            table.faultless.push_back(Tracer(tracer));
        study.rows([&](StudyReader& reader) {
            AdjudicationRow row;
            row.name = reader.required("name");
            reader.text("scene", row.scene);
            reader.text("geometry_hash", row.geometryHash);
            if (row.scene.empty() == row.geometryHash.empty())
                reader.refuse("scene", row.scene,
                              "must be given, or \"geometry_hash\" of a file with the row's name, "
                              "and not both");
            reader.number("pairs", row.pairLimit, 0, 1e9);
            reader.number("time_s", row.timeSeconds, 0, 1e6);
            table.rows.push_back(row);
        });
        study.requireRows(table.rows.size());
    });
    return table;
}

std::unique_ptr<Study> makeAdjudicationStudy(const StudyFile& file, const StudyRequest& request,
                                             const Console& console) {
    return std::make_unique<AdjudicationStudy>(file, request, console);
}

} // namespace shadowdag
