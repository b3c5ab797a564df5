// SPDX-License-Identifier: Apache-2.0
// Reads the mechanisms, and turns the measurements of scenes into a judgement per row.
#include "tools/studies/ablation.h"

#include "cuda/error.h"
#include "tools/report/csv.h"
#include "tools/settings/console.h"
#include "tools/settings/parse.h"
#include "tools/workspace/cost_file.h"

#include <algorithm>
#include <bit>
#include <ostream>

namespace shadowdag {

namespace {

Json rowJson(const Mechanism& row) {
    return {{"name", row.name},
            {"kind", "mechanism"},
            {"what", row.what},
            {"method", kMatrixMethodNames[size_t(row.method)]},
            {"metric", kGainMetricNames[size_t(row.metric)]},
            {"error_metric", kGainMetricNames[size_t(row.errorMetric)]},
            {"always", alwaysOf(row)},
            {"off_settings", row.off},
            {"on_settings", row.on},
            {"is_default", isDefault(row)},
            {"kept_for", row.keptFor},
            {"source", row.source},
            {"is_sequence", row.isSequence},
            {"scenes", Json::array()}};
}

void addGains(const SceneGains& gains, bool isFailure, MechanismEvidence& evidence) {
    if (isFailure) {
        evidence.ownOnFailures.push_back(gains.own);
        return;
    }
    evidence.own.push_back(gains.own);
    evidence.error.push_back(gains.error);
    evidence.bytes.push_back(gains.bytes);
    if (gains.hasTime)
        evidence.time.push_back(gains.time);
}

class AblationStudy : public Study {
public:
    AblationStudy(AblationTable table, const StudyRequest& request, const Console& console)
        : table_(std::move(table)), names_(request.names), console_(console) {
        table_.backend = request.backend;
        if (!request.scenes.empty()) {
            table_.scenes = request.scenes;
            table_.failures.clear();
        }
        chooseNames();
        // Failures in the order in which rows refer to them.
        std::vector<Failure> shown;
        for (const Mechanism& row : table_.rows)
            for (const std::string& name : row.shownBy)
                for (const Failure& failure : table_.failures)
                    if (failure.name == name &&
                        std::none_of(shown.begin(), shown.end(),
                                     [&](const Failure& f) { return f.name == name; }))
                        shown.push_back(failure);
        table_.failures = shown;
    }

    std::vector<std::string> parts() const override {
        std::vector<std::string> names = table_.scenes;
        for (const Failure& failure : table_.failures)
            names.push_back("failure " + failure.name);
        return names;
    }
    std::vector<std::string> scenes() const override {
        std::vector<std::string> scenes = table_.scenes;
        for (const Failure& failure : table_.failures)
            scenes.push_back(failure.scene);
        return scenes;
    }
    Json measure(size_t part, const StudyRequest& request) override {
        if (part < table_.scenes.size())
            return measureAblation(table_, table_.scenes[part], nullptr, request, console_);
        const Failure& failure = table_.failures.at(part - table_.scenes.size());
        return measureAblation(table_, failure.scene, &failure, request, console_);
    }
    Json join(std::vector<Json> parts) const override {
        Json results = {
            {"scenes", table_.scenes},
            {"size", std::to_string(table_.width) + "x" + std::to_string(table_.height)},
            {"resolution", 1u << table_.resolutionLog2},
            {"sequence_frame_count", table_.sequenceFrames},
            {"repeat_count", table_.repeats},
            {"mechanisms", Json::array()}};
        for (size_t r = 0; r < table_.rows.size(); ++r) {
            Json row = rowJson(table_.rows[r]);
            MechanismEvidence evidence;
            for (size_t p = 0; p < parts.size(); ++p)
                if (const Json& of = parts[p]["rows"][r]; !of.is_null()) {
                    row["scenes"].push_back(of["entry"]);
                    addGains(gainsFromJson(of["gains"]), p >= table_.scenes.size(), evidence);
                }
            addJudgement(evidence, !table_.rows[r].keptFor.empty(), row);
            results["mechanisms"].push_back(std::move(row));
        }
        if (!table_.hasTerms)
            return results;
        std::vector<ObservedFrame> observed;
        for (size_t p = 0; p < table_.scenes.size(); ++p)
            for (ObservedFrame& frame : observationsFromJson(parts[p]["observed"], "journal"))
                observed.push_back(std::move(frame));
        for (Json& row : judgeCostTerms(observed, names_))
            results["mechanisms"].push_back(std::move(row));
        return results;
    }
    std::vector<std::string> brokenLines(const Json& results) const override {
        return disagreements(results);
    }
    std::string judged(const Json& results) const override {
        return std::to_string(results["mechanisms"].size()) + " mechanisms";
    }
    void print(const Json& results, const Console& console) const override {
        for (const Json& row : results["mechanisms"])
            console.people() << row["name"].get<std::string>() << ": "
                             << row["verdict"].get<std::string>() << "; "
                             << row["reason"].get<std::string>() << "\n";
    }
    std::string csv(const Json& results) const override { return mechanismsCsv(results); }
    bool drawsCharts() const override { return true; }
    Json counts(const Json& results) const override {
        return {{"mechanism_count", results["mechanisms"].size()}};
    }
    bool mustHold() const override { return false; }
    bool takesTimes() const override { return true; }
    std::string needsBeyondGl() const override {
        return "rays against triangles, and retained pages and polygon levels of detail (SOR and "
               "PLOD of "
               "--variants)";
    }

private:
    /// Keeps the requested rows and terms. Throws Error kUsage for an unknown name, and for rows
    /// that need times if none are measured.
    void chooseNames() {
        const std::vector<std::string> terms = costTermNames();
        std::vector<Mechanism> rows;
        std::string known;
        for (const Mechanism& row : table_.rows) {
            known += (known.empty() ? "" : ", ") + row.name;
            if (names_.empty() || std::find(names_.begin(), names_.end(), row.name) != names_.end())
                rows.push_back(row);
        }
        bool hasTerms = names_.empty();
        for (const std::string& name : names_) {
            const bool isTerm = std::find(terms.begin(), terms.end(), name) != terms.end();
            hasTerms |= isTerm;
            if (!isTerm && std::none_of(rows.begin(), rows.end(),
                                        [&](const Mechanism& row) { return row.name == name; }))
                throw Error(ErrorKind::kUsage, "--only '" + name + "': must be one of " + known +
                                                   ", or a term of the cost model, " +
                                                   terms.front() + " to " + terms.back());
        }
        table_.hasTerms &= hasTerms;
        table_.rows = rows;
        for (const Mechanism& row : rows)
            if (row.metric == GainMetric::kTime && table_.repeats == 0)
                throw Error(ErrorKind::kUsage,
                            "mechanism '" + row.name +
                                "' should gain time, but times are not measured; use "
                                "1 run or more, or other rows");
    }

    AblationTable table_;
    std::vector<std::string> names_;
    const Console& console_;
};

Mechanism readMechanism(StudyReader& reader, const std::vector<Failure>& failures) {
    Mechanism row{};
    row.name = reader.required("name");
    row.what = reader.required("what");
    row.method = MatrixMethod(reader.choice("method", kMatrixMethodNames));
    row.metric = GainMetric(reader.choice("metric", kGainMetricNames));
    row.errorMetric = GainMetric::kError;
    if (reader.find("error_metric"))
        row.errorMetric = GainMetric(reader.choice("error_metric", kGainMetricNames));
    if (row.errorMetric != GainMetric::kError && row.errorMetric != GainMetric::kFlip)
        reader.refuse("error_metric", kGainMetricNames[size_t(row.errorMetric)],
                      "must be mean_abs_visibility_error or flip");
    row.always = reader.settings("always");
    for (const auto& [key, side] : {std::pair("off", &row.off), {"on", &row.on}}) {
        *side = reader.settings(key);
        if (!readsAny(row.method, *side))
            reader.refuse(key, *side, "must contain a setting that the row's method reads");
    }
    reader.texts("default_if", row.defaultIf);
    for (const std::string& setting : row.defaultIf)
        try {
            cellSetup({setting});
        } catch (const Error& error) {
            reader.refuse("default_if", setting, std::string("is not a setting: ") + error.what());
        }
    reader.texts("shown_by", row.shownBy);
    for (const std::string& name : row.shownBy)
        if (std::none_of(failures.begin(), failures.end(),
                         [&](const Failure& failure) { return failure.name == name; }))
            reader.refuse("shown_by", name, "must name rows of the study \"failures\"");
    reader.flag("sequence", row.isSequence);
    reader.text("kept_for", row.keptFor);
    row.source = reader.required("source");
    return row;
}

} // namespace

Json isDefault(const Mechanism& row) {
    if (row.defaultIf.empty())
        return {};
    const FrameOptions usual = cellSetup({}).frame;
    return std::any_of(row.defaultIf.begin(), row.defaultIf.end(), [&](const std::string& setting) {
        return cellSetup({setting}).frame == usual;
    });
}

std::string mechanismsCsv(const Json& results) {
    Json rows = Json::array();
    for (const Json& row : results["mechanisms"])
        for (const Json& scene : row["scenes"]) {
            Json line = {{"mechanism", row["name"]},  {"method", row["method"]},
                         {"always", row["always"]},   {"off", row["off_settings"]},
                         {"on", row["on_settings"]},  {"metric", row["metric"]},
                         {"verdict", row["verdict"]}, {"is_default", row["is_default"]},
                         {"scene", scene["scene"]},   {"is_failure", scene["is_failure"]}};
            for (const char* key :
                 {"own_ratio", "time_ratio", "time_spread", "error_ratio", "bytes_ratio"})
                line[key] = scene.value(key, Json());
            rows.push_back(std::move(line));
        }
    return flatCsv(rows);
}

AblationTable readAblation(const StudyFile& file) {
    AblationTable table;
    readStudy(file, [&](StudyReader& study) {
        study.texts("scenes", table.scenes);
        std::string size = "320x180", failures;
        study.text("size", size);
        std::tie(table.width, table.height) = parseSize("size", size);
        uint32_t resolution = 2048;
        study.number("resolution", resolution, 16, 4096);
        if (!std::has_single_bit(resolution))
            study.refuse("resolution", resolution, "must be a power of two");
        table.resolutionLog2 = uint32_t(std::countr_zero(resolution));
        study.number("sequence_frames", table.sequenceFrames, 1, 1000);
        study.number("repeats", table.repeats, 0, 1000);
        study.flag("cost_terms", table.hasTerms);
        study.text("failures", failures);
        if (!failures.empty())
            table.failures = readFailures(findStudy(failures)).rows;
        study.rows([&](StudyReader& reader) {
            table.rows.push_back(readMechanism(reader, table.failures));
        });
    });
    return table;
}

std::unique_ptr<Study> makeAblationStudy(const StudyFile& file, const StudyRequest& request,
                                         const Console& console) {
    return std::make_unique<AblationStudy>(readAblation(file), request, console);
}

} // namespace shadowdag
