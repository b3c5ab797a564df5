// SPDX-License-Identifier: Apache-2.0
// Stability in time: results that change from one frame to the next while Embree's do not, along a
// camera path and under moving lights, with hysteresis of maps and routes on and off.
#include "tools/studies/stability.h"
#include "tools/studies/stability_stage.h"

#include "hybrid/judge/flicker.h"

#include <algorithm>

namespace shadowdag {

namespace {

constexpr uint32_t kPointCount = 6000;

} // namespace

void measureTime(const StabilityTable& table, const StabilityGroup& group, Json& results) {
    Workspace workspace(loadedScene(stabilityScene(group)), {table.backend, "", {}});
    Judge judge(workspace);
    double before = 0; // flicker at changes of the method with less kept
    for (const TimeCase& run : table.cases) {
        std::vector<std::string> settings = stabilitySettings(table, group);
        settings.push_back(run.settings);
        const StabilityMethod method(run.method, settings, table.width / 2);
        FlickerMeter meter(workspace.truth(), 1, kPointCount);
        FlickerCounts flicker;
        ErrorCounts errors;
        uint64_t traced = 0, drawn = 0;
        workspace.renderer(method.setup().resolutionLog2).reset();
        for (int f = 0; f < table.frameCount; ++f) {
            workspace.setTime(float(f * table.stepSeconds));
            const StabilityFrame frame =
                method.measure(workspace, judge, f, [&](const ErrorInputs& inputs) {
                    flicker.add(meter.add({inputs, workspace.camera()}));
                });
            errors.add(frame.errors);
            traced += frame.frame.counts.tracedMapCount;
            drawn += frame.frame.counts.drawnMapCount;
        }
        workspace.setTime(0);
        const FlickerCounts::Class total = flicker.total();
        // The cases of a method stand together, from nothing kept to more.
        const bool isFirst = &run == &table.cases.front() || (&run - 1)->method != run.method;
        Json row = {{"group", group.name},
                    {"case", run.name},
                    {"kind", group.kind},
                    {"method", kMatrixMethodNames[size_t(run.method)]},
                    {"settings", run.settings},
                    {"frame_count", table.frameCount},
                    {"pair_count", errors.pairCount},
                    {"answer_count", total.answerCount},
                    {"flicker_count", total.flickerCount},
                    {"truth_change_count", flicker.truthChangeCount},
                    {"unanswered_count", flicker.missingResultCount},
                    {"missing_tap_count", flicker.missingTapCount},
                    {"drawn_map_count", drawn},
                    {"traced_map_count", traced}};
        requireEvidence(row, errors.pairCount, errors.occludedCount);
        row["wrong_share"] = shareOf(row, "pairs", errors.falseShadowCount + errors.falseLightCount,
                                     errors.pairCount);
        const char* const names[kFlickerChangeCount] = {"held", "resolution_switch",
                                                        "method_switch"};
        for (int c = 0; c < kFlickerChangeCount; ++c) {
            const FlickerCounts::Class& one = flicker.byChange[size_t(c)];
            const std::string stem = names[c];
            row[stem + "_answer_count"] = one.answerCount;
            row[stem + "_flicker_count"] = one.flickerCount;
            row[stem + "_unexplained_count"] = one.flickerCount - one.explainedCount -
                                               one.contactCount - one.acneCount -
                                               one.magnifiedCount;
        }
        BandInputs inputs;
        inputs.count = double(total.answerCount);
        inputs.truthChange =
            shareOf(row, "followed results", flicker.truthChangeCount, total.answerCount);
        inputs.outlineCount = std::max(1, group.outlineCount);
        const FlickerCounts::Class& held = flicker.of(FlickerChange::kHeld);
        row["held_flicker_share"] =
            shareOf(row, "kept results", held.flickerCount, held.answerCount);
        row["flicker_share"] =
            shareOf(row, "followed results", total.flickerCount, total.answerCount);
        row["switch_flicker_share"] = shareOf(
            row, "followed results", total.flickerCount - held.flickerCount, total.answerCount);
        Json& checks = results["checks"];
        addChecks(table, checks, group.part, row, "held_flicker_share",
                  row["held_flicker_share"].get<double>(), inputs);
        inputs.base = before;
        if (!isFirst)
            addChecks(table, checks, group.part, row, "switch_flicker_share",
                      row["switch_flicker_share"].get<double>(), inputs);
        else
            for (const char* measure :
                 {"resolution_switch_answer_count", "method_switch_answer_count"})
                addChecks(table, checks, group.part, row, measure, row[measure].get<double>(),
                          inputs);
        before = row["switch_flicker_share"].get<double>();
        results["time"].push_back(std::move(row));
    }
}

} // namespace shadowdag
