// SPDX-License-Identifier: Apache-2.0
// The checks of one row of the failure table.
#include "tools/studies/mutants.h"
#include "tools/studies/stability.h"

#include "hybrid/judge/explain.h"
#include "hybrid/judge/own_taps.h"
#include "tools/workspace/judge.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace shadowdag {

namespace {

/// A pair is asked about only where rounding cannot decide it.
constexpr double kMargin = 1e-5;

enum class Belongs : uint8_t { kNo, kYes, kEither };

/// Returns whether a value that must be positive is, within kMargin of a scale.
Belongs isPositive(double value, double scale) {
    return value > kMargin * scale    ? Belongs::kYes
           : value < -kMargin * scale ? Belongs::kNo
                                      : Belongs::kEither;
}

/// Returns whether a sample and a light are a pair by the definition in docs/method.md.
Belongs isPairByDefinition(const Light& light, const glm::dvec3& position,
                           const glm::dvec3& normal) {
    if (light.kind == Light::kSun)
        return isPositive(-glm::dot(glm::dvec3(light.directionWorld), normal), 1.0);
    const glm::dvec3 toLight = glm::dvec3(light.positionWorld) - position;
    const double distance = glm::length(toLight), range = light.rangeWorld;
    Belongs all = isPositive(range - distance, range);
    const auto also = [&](Belongs one) {
        all = all == Belongs::kNo || one == Belongs::kNo ? Belongs::kNo
              : all == Belongs::kYes                     ? one
                                                         : all;
    };
    // The spacing of floats at the coordinates is a part of the rounding.
    const double scale = distance + glm::length(position) + glm::length(toLight);
    also(isPositive(glm::dot(toLight, normal), scale));
    if (light.kind == Light::kSpot)
        also(isPositive(-glm::dot(toLight, glm::dvec3(light.directionWorld)) -
                            double(light.cosOuter) * distance,
                        scale));
    return all;
}

uint64_t countWrongPairs(const World& world, const PairResults& answers) {
    const GBufferView& gbuffer = answers.gbuffer;
    const PairList& pairs = answers.frame.pairs;
    const std::vector<Light>& lights = world.lights();
    uint64_t wrong = 0;
    for (size_t s = 0; s < gbuffer.count(); ++s) {
        uint64_t at = pairs.sampleStart[s];
        for (uint32_t l = 0; l < lights.size(); ++l) {
            const bool isListed = at < pairs.sampleStart[s + 1] && pairs.light[at] == l;
            at += isListed;
            const Belongs belongs =
                gbuffer.triangle[s] == kBackground
                    ? Belongs::kNo
                    : isPairByDefinition(lights[l], glm::dvec3(gbuffer.positionWorld[s]),
                                         glm::dvec3(gbuffer.normalWorld[s]));
            wrong += belongs == (isListed ? Belongs::kNo : Belongs::kYes);
        }
        wrong += pairs.sampleStart[s + 1] - at; // listed twice or out of order
    }
    return wrong;
}

/// Counts the samples that are a twentieth of a pixel or more off the ray of their pixel.
uint64_t countWrongSamples(const Camera& camera, const GBufferView& gbuffer) {
    const glm::dvec3 eye(camera.positionWorld),
        forward = glm::normalize(glm::dvec3(camera.forward));
    const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(camera.up)));
    const glm::dvec3 up = glm::cross(right, forward);
    const double pixel = 2.0 * std::tan(0.5 * double(camera.yfov)) / gbuffer.height;
    uint64_t wrong = 0;
    for (size_t s = 0; s < gbuffer.count(); ++s) {
        if (gbuffer.triangle[s] == kBackground)
            continue;
        const double x = double(s % gbuffer.width) + 0.5 - 0.5 * gbuffer.width;
        const double y = 0.5 * gbuffer.height - double(s / gbuffer.width) - 0.5;
        const glm::dvec3 way = glm::dvec3(gbuffer.positionWorld[s]) - eye;
        const double depth = glm::dot(way, forward);
        const glm::dvec3 onRay = (forward + right * (x * pixel) + up * (y * pixel)) * depth;
        const double rounding = 0x1p-22 * (glm::length(eye) + glm::length(way));
        wrong += !(glm::length(way - onRay) <= 0.05 * pixel * depth + rounding);
    }
    return wrong;
}

/// Counts the pixels whose colour is not that of their pairs, beyond the rounding of a sum.
uint64_t countWrongColors(const World& world, const PairResults& answers) {
    const std::vector<glm::vec3> expected =
        shadePairs(answers.gbuffer, world, answers.frame.pairs, answers.frame.visibility);
    uint64_t wrong = 0;
    for (size_t s = 0; s < expected.size(); ++s)
        for (int c = 0; c < 3; ++c) {
            const float is = answers.frame.color[s][c], should = expected[s][c];
            if (!(std::fabs(is - should) <= 1e-4f * (std::fabs(is) + std::fabs(should)) + 1e-9f)) {
                ++wrong;
                break;
            }
        }
    return wrong;
}

/// Counts the maps whose texels are not those that the frame's records ask for.
uint64_t countWrongResolutions(const PairResults& answers) {
    uint64_t wrong = 0;
    size_t drawn = 0;
    const View<const ShadowMapInfo> maps = answers.method.maps.maps;
    for (const MapRecord& record : answers.frame.maps) {
        if (record.route != Route::kMap)
            continue;
        const double asked =
            double(record.quantities.faceTexels) / double(answers.frame.counts.maps.degradeDivisor);
        wrong += drawn >= maps.count || !(double(maps[drawn].faceTexels) + 1.0 > asked);
        ++drawn;
    }
    return wrong;
}

/// Counts the pairs of maps whose visibility is not that of the stored depths, read by taps
/// that are made in double; where rounding chooses the texels, pairs are left out.
uint64_t countWrongLookups(const PairResults& answers) {
    const PairList& pairs = answers.frame.pairs;
    const ShadowMapView& maps = answers.method.maps;
    constexpr double kRounding = 2.0 / 255.0;
    uint64_t wrong = 0;
    for (size_t s = 0; s < answers.gbuffer.count(); ++s)
        for (uint64_t p = pairs.sampleStart[s]; p < pairs.sampleStart[s + 1]; ++p) {
            const PairServer server = answers.frame.pairServer[p];
            if (!server.isMap())
                continue;
            const OwnTaps taps =
                makeOwnTaps(maps.maps[server.map()], answers.gbuffer.positionWorld[s],
                            answers.gbuffer.normalWorld[s], answers.method.bias);
            if (taps.isAtBorder)
                continue;
            const glm::dvec2 range = ownVisibility(maps, server.map(), taps);
            const double is = answers.frame.visibility[p] / 255.0;
            wrong += is < range.x - kRounding || is > range.y + kRounding;
        }
    return wrong;
}

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
                add("picture", countWrongColors(workspace.world(), answers[role]));
                if (role != 0)
                    continue;
                add("pairs", countWrongPairs(workspace.world(), answers[role]));
                add("samples", countWrongSamples(workspace.camera(), answers[role].gbuffer));
                add("resolution", countWrongResolutions(answers[role]));
                add("lookup", countWrongLookups(answers[role]));
                const float believe = setup.frame.rays.believe;
                if (MatrixMethod(m) == MatrixMethod::kDagAll && believe <= kMagnifiedFootprints)
                    add("belief", judge.judge(f, answers[role]).total.magnifiedCount);
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
