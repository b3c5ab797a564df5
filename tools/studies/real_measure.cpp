// SPDX-License-Identifier: Apache-2.0
// Measures the cells of a real scene: the camera's move, counts, unclassified errors, pictures.
#include "tools/studies/cell_tally.h"
#include "tools/studies/real_scenes.h"

#include "cuda/error.h"
#include "hybrid/judge/explain.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/image_io.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace shadowdag {

namespace {

constexpr size_t kRealListedPairCount = 8;      ///< number of unclassified errors that a cell lists
constexpr uint32_t kRealNullSampleCount = 2000; ///< right pairs sampled in a frame
constexpr uint64_t kLightSeed = 1;              ///< of placed lights

Json jsonOf(const glm::vec3& v) {
    return {v.x, v.y, v.z};
}

/// Measures the cells of one scene.
class RealMeasurement {
public:
    RealMeasurement(const RealTable& table, LoadedScene scene, bool arePlaced,
                    const RealScene* known, const StudyRequest& request, const Console& console)
        : table_(table), arePlaced_(arePlaced), known_(known), request_(request),
          name_(sceneStem(scene.argument)),
          workspace_(std::move(scene), {request.backend, known ? known->camera : std::string(),
                                        VoxelSource{{}, request.cacheDirectory, false}, &console}),
          judge_(workspace_, 1, kRealNullSampleCount) {
        workspace_.setTime(0.0f);
        camera_ = workspace_.camera();
    }

    /// Adds the cell of a method. @param known in the form of the cell
    void measure(MatrixMethod method, const std::string& known, Json& results) {
        CellSetup setup = cellSetup({table_.settings});
        const std::unique_ptr<CostModel> model = modelOf(method, setup);
        FrameRenderer& renderer = workspace_.renderer(setup.resolutionLog2);
        renderer.reset();
        CellTally tally(workspace_);
        Json unnamed = Json::array();
        std::map<std::string, uint64_t> names;
        double poolDivisor = 1.0;
        PairResults answers;
        for (int f = 0; f < table_.frameCount; ++f) {
            const Camera camera = cameraAt(f);
            answers =
                pairResultsOf(renderer.render(camera, *model, setup.frame), renderer, setup.frame);
            if (stepWorld_ == 0.0f)
                setStep(answers.gbuffer);
            step();
            const ErrorReport report = tally.add(judge_, f, answers, camera);
            list(errorInputs(workspace_.world(), answers), report, f, names, unnamed);
            poolDivisor = std::max(poolDivisor, double(answers.frame.counts.maps.degradeDivisor));
            step();
        }
        const std::string name = kMatrixMethodNames[size_t(method)];
        Json json = {{"scene", name_},
                     {"geometry_hash", workspace_.scene().geometryHash},
                     {"triangle_count", workspace_.world().triangles().count()},
                     {"light_count", workspace_.world().lights().size()},
                     {"lights", arePlaced_ ? "placed" : "own"},
                     {"camera_numbers", cameraText(camera_)}, // of the first frame
                     {"method", name},
                     {"known", known}};
        json.update(tally.json());
        const ErrorCounts& errors = tally.errors();
        uint64_t namedCount = 0;
        for (const auto& [failure, count] : names)
            namedCount += count;
        json["unnamed_count"] = json["unexplained_count"].get<uint64_t>() -
                                (errors.settledFalseShadowCount + errors.settledFalseLightCount) -
                                namedCount;
        json["named_counts"] = names;
        json["named_count"] = namedCount;
        json["unnamed"] = unnamed;
        const double pairs = double(std::max<uint64_t>(errors.pairCount, 1));
        json["false_shadow_share"] = double(errors.falseShadowCount) / pairs;
        json["false_light_share"] = double(errors.falseLightCount) / pairs;
        json["wrong_share"] = double(errors.falseShadowCount + errors.falseLightCount) / pairs;
        json["magnified_share"] = double(errors.magnifiedCount) / pairs;
        json["acne_share"] = double(errors.acneCount) / pairs;
        for (const Untrusted& cell : known_ ? known_->untrusted : std::vector<Untrusted>())
            if (cell.method == method)
                json["untrusted"] = cell.reason;
        json["pool_divisor"] = poolDivisor;
        json["explaining_has_power"] = explainingHasPower(table_, method, json);
        const Json bounds = realBounds(table_, known_, method, json["explaining_has_power"]);
        Json broken = realBroken(json, bounds);
        if (known_ && !findKnown(known_->known, method, true))
            broken.push_back("unknown");
        json["bounds"] = bounds;
        json["broken"] = broken;
        draw(answers, setup, fileNameOf(method), json, results["pictures"]);
        results["cells"].push_back(std::move(json));
    }

private:
    void step() {
        checkInterrupted();
        ++done_;
        if (request_.progress)
            request_.progress(double(done_) / (2.0 * table_.frameCount * kMatrixMethodCount));
    }

    /// Returns the camera of a frame: in each frame farther to the right by a pixel's width at the
    /// median distance of the first frame's samples.
    Camera cameraAt(int frame) const {
        Camera camera = camera_;
        camera.positionWorld += camera.right() * (stepWorld_ * float(frame));
        return camera;
    }

    /// Sets the step from the first frame.
    void setStep(const GBufferView& gbuffer) {
        std::vector<float> distances;
        for (size_t i = 0; i < gbuffer.count(); ++i)
            if (gbuffer.triangle[i] != kBackground)
                distances.push_back(gbuffer.depthView[i]);
        if (distances.empty())
            throw Error(ErrorKind::kInput, name_ + ": the camera sees only background; "
                                                   "give the scene a camera");
        const auto middle = distances.begin() + ptrdiff_t(distances.size() / 2);
        std::nth_element(distances.begin(), middle, distances.end());
        stepWorld_ = *middle * 2.0f * std::tan(0.5f * camera_.yfov) / float(gbuffer.height);
    }

    /// Counts the unexplained errors that a test of their geometry names, by name, and lists the
    /// first others, with the data to inspect each.
    void list(const ErrorInputs& inputs, const ErrorReport& report, int f,
              std::map<std::string, uint64_t>& names, Json& unnamed) {
        const PairList& pairs = inputs.pairs;
        const PairJudge judge(inputs, workspace_.truth(), 1);
        for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample)
            for (uint64_t p = pairs.sampleStart[sample]; p < pairs.sampleStart[sample + 1]; ++p) {
                if (report.verdicts[p] != PairVerdict::kUnexplained)
                    continue;
                const FailureName failure =
                    judge.nameOf(uint32_t(sample), p, inputs.visibility[p] < kHalfLit);
                if (failure != FailureName::kNone) {
                    ++names[failureNameText(failure)];
                    continue;
                }
                if (unnamed.size() >= kRealListedPairCount)
                    continue;
                const uint32_t light = pairs.light[p];
                const glm::vec3 position = inputs.gbuffer.positionWorld[sample],
                                normal = inputs.gbuffer.normalWorld[sample],
                                lightWorld = pointAtLight(inputs.lights[light], position);
                const uint32_t receiver = inputs.gbuffer.triangle[sample];
                const TruthBlocker blocker =
                    workspace_.truth().blocker(position, normal, receiver, lightWorld);
                Json one = {
                    {"frame", f},
                    {"pixel", {sample % inputs.gbuffer.width, sample / inputs.gbuffer.width}},
                    {"light", light},
                    {"error", inputs.visibility[p] < kHalfLit ? "false shadow" : "false light"},
                    {"visibility", inputs.visibility[p] / 255.0},
                    {"route", inputs.pairRoute[p] == Route::kRays ? "rays" : "map"},
                    {"position", jsonOf(position)},
                    {"normal", jsonOf(normal)},
                    {"light_position", jsonOf(lightWorld)},
                    {"receiver_triangle", receiver}};
                if (blocker.triangle != kBackground) {
                    one["blocker_triangle"] = blocker.triangle;
                    one["blocker_distance"] = blocker.distanceWorld;
                }
                if (inputs.pairRoute[p] != Route::kRays)
                    one["face_texels"] =
                        inputs.method.maps.maps[inputs.pairServer[p].map()].faceTexels;
                unnamed.push_back(std::move(one));
            }
    }

    /// Writes the truth once and a method's errors.
    void draw(const PairResults& answers, const CellSetup& setup, const std::string& method,
              Json& cell, Json& pictures) {
        if (request_.pictureDirectory.empty())
            return;
        const PairList& pairs = answers.frame.pairs;
        const FrameTruth& truth = judge_.picture(table_.frameCount - 1, answers.gbuffer, pairs);
        const auto write = [&](const std::string& file, const std::vector<glm::vec3>& picture) {
            writePng(request_.pictureDirectory + "/" + file, setup.frame.width, setup.frame.height,
                     picture);
        };
        if (pictures.empty()) {
            const std::string file = fileSlug(name_) + "_truth.png";
            write(file, truth.display);
            pictures.push_back({{"scene", name_}, {"truth", file}});
        }
        const std::string file = fileSlug(name_) + "_" + method + "_error.png";
        write(file, errorPicture(truth.display, countPixelErrors(pairs, answers.frame.visibility,
                                                                 truth.visibility)));
        cell["image"] = file;
    }

    const RealTable& table_;
    bool arePlaced_; ///< the lights
    const RealScene* known_;
    const StudyRequest& request_;
    std::string name_;
    Workspace workspace_;
    Judge judge_;
    Camera camera_;
    float stepWorld_ = 0.0f;
    int done_ = 0;
};

} // namespace

Json measureReal(const RealTable& table, const std::string& file, const StudyRequest& request,
                 const Console& console) {
    LoadedScene scene =
        loadSceneAndWorld(file, -1, kLightSeed, table.placedLightCount == 0, console);
    const bool arePlaced = scene.world->lights().empty();
    if (arePlaced) {
        WorldOptions options;
        options.placedLightCount = table.placedLightCount;
        options.seed = kLightSeed;
        scene.world = std::make_unique<World>(*scene.scene, options);
        checkInterrupted();
    }
    const RealScene* named = table.find(sceneStem(file));
    const bool isKnown = named && named->geometryHash == scene.geometryHash;
    Json results = {{"settings", table.settings},
                    {"frame_count", table.frameCount},
                    {"cells", Json::array()},
                    {"pictures", Json::array()}};
    RealMeasurement measurement(table, std::move(scene), arePlaced, isKnown ? named : nullptr,
                                request, console);
    for (int m = 0; m < kMatrixMethodCount; ++m)
        measurement.measure(MatrixMethod(m),
                            isKnown ? "yes"
                            : named ? "another file"
                                    : "no",
                            results);
    return results;
}

} // namespace shadowdag
