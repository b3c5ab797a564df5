// SPDX-License-Identifier: Apache-2.0
// The checks of one row of the failure table.
#include "tools/studies/mutants.h"
#include "tools/studies/stability.h"

#include "tools/workspace/judge.h"
#include "tools/workspace/self_checks.h"

#include <algorithm>
#include <map>

namespace shadowdag {

namespace {

/// Returns a setup that must give the same answers by other code.
CellSetup otherWay(CellSetup setup, MatrixMethod method) {
    setup.frame.rays.batch = RayBatch::kSingle;
    setup.frame.maps.useAtomicRasterizer = true;
    setup.frame.maps.culling = MapCulling::kSphere;
    setup.frame.maps.useStaticOptimization = false;
    setup.frame.reorderLights = !setup.frame.reorderLights;
    if (method == MatrixMethod::kDagAll) // proofs are by voxels; maps and triangles may disagree
        setup.frame.pruning = PairPruning::kNone;
    return setup;
}

uint64_t countDifferences(const PairResults& a, const PairResults& b) {
    if (a.frame.pairs.light != b.frame.pairs.light ||
        a.frame.pairs.sampleStart != b.frame.pairs.sampleStart)
        return std::max(a.frame.pairs.count(), b.frame.pairs.count());
    uint64_t different = 0;
    for (size_t p = 0; p < a.frame.visibility.size(); ++p)
        different += a.frame.visibility[p] != b.frame.visibility[p];
    return different;
}

} // namespace

CellJudgement judgeCells(const Failure& row, const Slack& slack, const StudyRequest& request,
                         const Console& console) {
    CellJudgement judgement;
    std::vector<Notice>& notices = judgement.notices;
    const Json results = measureFailure(row, slack, request, console);
    for (const Json& cell : results["cells"]) {
        const std::string method = cell["method"], remedy = cell["remedy"];
        const auto add = [&](const std::string& check, uint64_t count) {
            notices.push_back({check, row.name, method, remedy, count});
        };
        CellCounts counts;
        for (size_t m = 0; m < counts.size(); ++m)
            counts[m] = cell[kCellMeasureNames[m]].get<uint64_t>();
        const auto of = [&](CellMeasure measure) { return counts[size_t(measure)]; };
        const uint64_t wrong = of(CellMeasure::kFalseShadow) + of(CellMeasure::kFalseLight);
        judgement.cells.push_back(
            {{"row", row.name},
             {"method", method},
             {"remedy", remedy},
             {"wrong_count", wrong},
             {"explained_count", wrong - of(CellMeasure::kUnexplained) - of(CellMeasure::kAcne) -
                                     of(CellMeasure::kContact) - of(CellMeasure::kMagnified)}});
        for (const KnownCell& known : row.known) {
            if (method != kMatrixMethodNames[size_t(known.method)] ||
                known.isOn != (remedy != "off"))
                continue;
            const auto wrongOf = [](const CellCounts& of) {
                return of[size_t(CellMeasure::kFalseShadow)] + of[size_t(CellMeasure::kFalseLight)];
            };
            if (known.method == MatrixMethod::kDagNone && wrongOf(counts) > wrongOf(known.counts))
                add("exact", wrongOf(counts) - wrongOf(known.counts));
            const CellCounts most = boundOf(known.counts, slack), least = boundOf(counts, slack);
            for (size_t m = 0; m < counts.size(); ++m) {
                if (counts[m] > most[m])
                    add(kCellMeasureNames[m], counts[m] - known.counts[m]);
                if (known.counts[m] > least[m])
                    add(std::string(kCellMeasureNames[m]) + " too low",
                        known.counts[m] - counts[m]);
            }
        }
    }
    for (const Json& remedy : results["remedies"])
        if (!remedy["is_seen"].get<bool>())
            notices.push_back({"remedy", row.name, remedy["method"], "", 1});
    return judgement;
}

void setExcess(Json& mutants) {
    const auto healthy = std::find_if(mutants.begin(), mutants.end(), [](const Json& mutant) {
        return mutant["name"] == kNoMutant;
    });
    if (healthy == mutants.end())
        return;
    const auto keyOf = [](const Json& cell) {
        return cell["row"].get<std::string>() + "\n" + cell["method"].get<std::string>() + "\n" +
               cell["remedy"].get<std::string>();
    };
    std::map<std::string, Json> without;
    for (const Json& cell : (*healthy)["cells"])
        without[keyOf(cell)] = cell;
    for (Json& mutant : mutants) {
        std::map<std::string, std::pair<int64_t, int64_t>> excess; // wrong, explained
        for (const Json& cell : mutant["cells"]) {
            const auto found = without.find(keyOf(cell));
            if (found == without.end())
                continue;
            const auto more = [&](const char* key) {
                return cell[key].get<int64_t>() - found->second[key].get<int64_t>();
            };
            if (more("wrong_count") <= 0)
                continue;
            auto& [wrong, explained] = excess[cell["row"].get<std::string>()];
            wrong += more("wrong_count");
            explained += more("explained_count");
        }
        mutant["excess"] = Json::array();
        for (const auto& [row, counts] : excess)
            mutant["excess"].push_back(
                {{"row", row}, {"wrong_count", counts.first}, {"explained_count", counts.second}});
    }
    for (Json& mutant : mutants)
        mutant.erase("cells");
}

std::vector<Notice> judgeFrames(const MutantFrames& frames, const StudyRequest& request,
                                const Console& console) {
    const Failure& row = frames.row;
    std::map<std::pair<std::string, std::string>, uint64_t> found; // by check and method
    StabilityGroup moving{row.name, StabilityPart::kTime, row.scene, ""};
    moving.kind = "moving lights";
    Workspace workspace(frames.movesLights ? loadedScene(stabilityScene(moving))
                                           : loadSceneAndWorld(row.scene, -1, 1, true, console),
                        {request.backend, "", {}});
    Judge judge(workspace);
    for (int m = 0; m < kMatrixMethodCount; ++m) {
        CellSetup setup = cellSetup({row.always, row.on});
        const std::unique_ptr<CostModel> model = modelOf(MatrixMethod(m), setup);
        const CellSetup setups[] = {setup, otherWay(setup, MatrixMethod(m))};
        for (size_t role = 0; role < 2; ++role)
            workspace.renderer(setup.resolutionLog2, role).reset();
        for (int f = 0; f < row.frameCount; ++f) {
            workspace.setTime(float(row.startSeconds + f * row.stepSeconds));
            PairResults answers[2];
            for (size_t role = 0; role < 2; ++role) {
                FrameRenderer& renderer = workspace.renderer(setup.resolutionLog2, role);
                if (!setup.keepsFrames)
                    renderer.reset();
                answers[role] =
                    pairResultsOf(renderer.render(workspace.camera(), *model, setups[role].frame),
                                  renderer, setups[role].frame);
                const auto add = [&](const char* check, uint64_t count) {
                    found[{check, kMatrixMethodNames[m]}] += count;
                };
                if (role != 0) {
                    add("picture", countWrongColors(workspace.world(), answers[role]));
                    continue;
                }
                const SelfChecks checks =
                    checkFrame(workspace, answers[role], judge.judge(f, answers[role]));
                add("pairs", checks.wrongListPairCount);
                add("samples", checks.misplacedSampleCount);
                add("hidden", checks.hiddenSampleCount);
                add("resolution", checks.coarserMapCount);
                add("lookup", checks.wrongLookupCount);
                add("belief", checks.beyondBeliefCount);
                add("level", checks.coarserCellCount);
                add("proven", checks.exact.provenWrongCount);
                add("picture", checks.wrongColorCount);
            }
            found[{"other way", kMatrixMethodNames[m]}] += countDifferences(answers[0], answers[1]);
        }
    }
    std::vector<Notice> notices;
    for (const auto& [where, count] : found)
        if (count > 0)
            notices.push_back({where.first, row.name, where.second, "on", count});
    return notices;
}

} // namespace shadowdag
