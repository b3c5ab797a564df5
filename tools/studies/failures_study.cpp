// SPDX-License-Identifier: Apache-2.0
// Reads the rows of failures, and reports their results.
#include "tools/report/csv.h"
#include "tools/settings/console.h"
#include "tools/studies/cell_setup.h"
#include "tools/studies/failures.h"

#include <algorithm>

namespace shadowdag {

namespace {

class FailureStudy : public Study {
public:
    FailureStudy(const StudyFile& file, const StudyRequest& request, const Console& console)
        : table_(readFailures(file)), console_(console) {
        std::vector<std::string> names;
        for (const Failure& row : table_.rows)
            names.push_back(row.name);
        for (const size_t index : chooseRows(names, request.names)) {
            if (request.scenes.empty())
                rows_.push_back(table_.rows[index]);
            for (const std::string& scene : request.scenes) {
                Failure row = table_.rows[index];
                row.name = rowNameOn(row.name, scene);
                row.scene = scene;
                row.isBounded = false;
                rows_.push_back(row);
            }
        }
    }

    std::vector<std::string> parts() const override {
        std::vector<std::string> names;
        for (const Failure& row : rows_)
            names.push_back(row.name);
        return names;
    }
    std::vector<std::string> scenes() const override {
        std::vector<std::string> scenes;
        for (const Failure& row : rows_)
            scenes.push_back(row.scene);
        return scenes;
    }
    Json measure(size_t part, const StudyRequest& request) override {
        return measureFailure(rows_.at(part), table_.slack, request, console_);
    }
    /// Adds the description of each setting, for the page.
    Json join(std::vector<Json> parts) const override {
        Json results = Study::join(std::move(parts)), settings = Json::array();
        for (const CellSetting& setting : cellSettings())
            settings.push_back({{"key", setting.key}, {"help", setting.help}});
        results["settings"] = settings;
        return results;
    }
    std::vector<std::string> brokenLines(const Json& results) const override {
        return failureLines(results);
    }
    std::string judged(const Json& results) const override {
        const bool hasBounds =
            std::any_of(results["cells"].begin(), results["cells"].end(),
                        [](const Json& cell) { return !cell["bounds"].empty(); });
        return std::to_string(results["cells"].size()) + " cells" +
               (hasBounds ? ", " : " without bounds, ") +
               std::to_string(results["remedies"].size()) + " remedies";
    }
    void print(const Json& results, const Console& console) const override {
        for (const Json& cell : results["left_out"])
            console.note("omitted: " + cell["failure"].get<std::string>() + " by " +
                         cell["method"].get<std::string>() + ": " + cell["why"].get<std::string>());
    }
    std::string csv(const Json& results) const override { return runsCsv(results["cells"]); }
    Json counts(const Json& results) const override {
        return {{"cell_count", results["cells"].size()},
                {"remedy_count", results["remedies"].size()},
                {"left_out_count", results["left_out"].size()}};
    }

private:
    FailureTable table_;
    std::vector<Failure> rows_;
    const Console& console_;
};

} // namespace

FailureTable readFailures(const StudyFile& file) {
    FailureTable table;
    readStudy(file, [&](StudyReader& study) {
        table.slack = readSlack(study);
        study.rows([&](StudyReader& reader) {
            Failure row;
            row.name = reader.required("name");
            row.scene = reader.required("scene");
            row.what = reader.required("what");
            row.remedy = reader.required("remedy");
            row.source = reader.required("source");
            reader.text("listed", row.listed);
            row.always = reader.settings("always");
            row.off = reader.settings("off");
            row.on = reader.settings("on");
            if (row.off.empty() != row.on.empty())
                reader.refuse("on", row.on, "must be given with \"off\", or neither of them");
            reader.number("start_s", row.startSeconds, 0, 1e6);
            reader.number("step_s", row.stepSeconds, 0, 1e6);
            reader.number("frames", row.frameCount, 1, 1000);
            reader.list("seen", "seen", [&](StudyReader& seen) {
                RemedySeen one{};
                one.method = MatrixMethod(seen.choice("method", kMatrixMethodNames));
                one.measure = CellMeasure(seen.choice("measure", kCellMeasureNames));
                seen.requiredNumber("factor", one.factor, 0, 1e9);
                row.seen.push_back(one);
            });
            if (!row.seen.empty() && !row.hasRemedy())
                reader.refuse("seen", file.json["rows"][table.rows.size()]["seen"],
                              "needs a remedy, \"off\" and \"on\"");
            row.known = readKnown(reader, row.hasRemedy());
            table.rows.push_back(row);
        });
        study.requireRows(table.rows.size());
        study.list("tests", "test", [&](StudyReader& test) {
            table.tests.push_back(
                {test.required("listed"), test.required("what"), test.required("test")});
        });
    });
    return table;
}

std::vector<std::string> failureLines(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& cell : results["cells"])
        for (const Json& measure : cell["broken"]) {
            const std::string name = measure.get<std::string>();
            const Json bound = cell["bounds"].value(name, Json());
            lines.push_back(
                cell["failure"].get<std::string>() + " by " + cell["method"].get<std::string>() +
                ", remedy " + cell["remedy"].get<std::string>() + ": " +
                (name == "unknown"
                     ? std::string("it has no recorded counts; run tools/studies/update_known.py")
                     : name + " is " + cell[name].dump() +
                           (bound.is_null() ? ", so that nothing was judged"
                                            : ", bound " + bound.dump())));
        }
    for (const Json& remedy : results["remedies"])
        if (!remedy["is_seen"].get<bool>())
            lines.push_back(remedy["failure"].get<std::string>() + " by " +
                            remedy["method"].get<std::string>() + ": the remedy is not visible, " +
                            remedy["measure"].get<std::string>() + " is " + remedy["off"].dump() +
                            " without and " + remedy["on"].dump() + " with it");
    return lines;
}

std::unique_ptr<Study> makeFailureStudy(const StudyFile& file, const StudyRequest& request,
                                        const Console& console) {
    return std::make_unique<FailureStudy>(file, request, console);
}

} // namespace shadowdag
