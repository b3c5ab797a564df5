// SPDX-License-Identifier: Apache-2.0
// The cells of real scenes: a scene made ready, the camera's move, counts, errors without a name,
// pictures.
#include "tools/studies/real_scenes.h"

#include "cuda/error.h"
#include "hybrid/judge/flicker.h"
#include "scenes/gltf.h"
#include "tools/settings/parse.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/image_io.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

namespace shadowdag {

namespace {

constexpr uint32_t kFlickerPointCount = 6000;
constexpr size_t kListedPairCount = 8; ///< errors without a name that a cell lists

std::string stemOf(const std::string& file) {
    return std::filesystem::path(file).stem().string();
}

/// Scenes go by their stems: of two that are equal one would overwrite the other's pictures.
void requireUniqueStems(const std::vector<std::string>& files) {
    std::map<std::string, std::string> firstOf;
    for (const std::string& file : files) {
        const auto [first, isNew] = firstOf.emplace(stemOf(file), file);
        if (!isNew)
            throw Error(ErrorKind::kUsage, first->second + " and " + file + " are both called '" +
                                               first->first +
                                               "' in the report; rename one or compare them apart");
    }
}

const RealScene* realSceneOf(const std::string& name) {
    const auto found = std::find_if(realScenes().begin(), realScenes().end(),
                                    [&](const RealScene& scene) { return scene.name == name; });
    return found == realScenes().end() ? nullptr : &*found;
}

Json jsonOf(const glm::vec3& v) {
    return {v.x, v.y, v.z};
}

/// A scene with voxels and truth, and its camera's move.
class RealStage {
public:
    RealStage(const std::string& file, const CellSetup& setup, const RealRequest& request,
              const Console& console)
        : scene_(loadSceneAndWorld(file, -1, 1, true, console)), name_(stemOf(file)),
          known_(realSceneOf(name_)),
          isOther_(known_ && known_->geometryHash != scene_.geometryHash) {
        checkInterrupted();
        scene_.world->setTime(0.0f);
        camera_ = chooseCamera(*scene_.world, known_ && !isOther_ ? known_->camera : std::string());
        checkInterrupted();
        dag_ =
            cachedDag(scene_, setup.resolutionLog2, {{}, request.cacheDirectory, false}, console);
        checkInterrupted();
        truth_ = std::make_unique<Truth>(*scene_.world);
        renderer_ = std::make_unique<FrameRenderer>(request.backend, *scene_.world, dag_);
    }

    /// Returns the camera of a frame: a pixel's width at the median distance of what the first
    /// frame sees farther to the right in each.
    Camera cameraAt(int frame) const {
        Camera camera = camera_;
        camera.positionWorld += camera.right() * (stepWorld_ * float(frame));
        return camera;
    }

    /// Sets the step from what the first frame shows.
    void setStep(const GBufferView& gbuffer) {
        std::vector<float> distances;
        for (size_t i = 0; i < gbuffer.count(); ++i)
            if (gbuffer.triangle[i] != kBackground)
                distances.push_back(gbuffer.depthView[i]);
        if (distances.empty())
            throw Error(ErrorKind::kInput, name_ + ": the camera sees nothing but background; "
                                                   "give the scene a camera");
        const auto middle = distances.begin() + ptrdiff_t(distances.size() / 2);
        std::nth_element(distances.begin(), middle, distances.end());
        stepWorld_ = *middle * 2.0f * std::tan(0.5f * camera_.yfov) / float(gbuffer.height);
    }
    bool hasStep() const { return stepWorld_ > 0.0f; }

    const std::string& name() const { return name_; }
    const LoadedScene& scene() const { return scene_; }
    const World& world() const { return *scene_.world; }
    const Truth& truth() const { return *truth_; }
    FrameRenderer& renderer() { return *renderer_; }
    bool isKnown() const { return known_ && !isOther_; }
    bool isOtherFile() const { return isOther_; }

private:
    LoadedScene scene_;
    std::string name_;
    const RealScene* known_;
    bool isOther_;
    Camera camera_;
    float stepWorld_ = 0.0f;
    Dag dag_;
    std::unique_ptr<Truth> truth_;
    std::unique_ptr<FrameRenderer> renderer_;
};

/// One cell: its frames in order.
class RealCell {
public:
    RealCell(RealStage& stage, MatrixMethod method, const CellSetup& setup)
        : stage_(stage), setup_(setup), model_(modelOf(method, setup_)),
          flicker_(stage.truth(), 1, kFlickerPointCount) {}

    /// Renders and judges all frames. @param truths what Embree answers, by frame; filled as needed
    void measure(std::vector<std::vector<uint8_t>>& truths, const std::function<void()>& step) {
        FrameRenderer& renderer = stage_.renderer();
        renderer.reset();
        for (int f = 0; f < kRealFrameCount; ++f) {
            const Camera camera = stage_.cameraAt(f);
            frame_ = renderer.render(camera, *model_, setup_.frame);
            if (!stage_.hasStep())
                stage_.setStep(renderer.gbuffer());
            step();
            std::vector<uint8_t>& truth = truths[size_t(f)];
            if (truth.empty())
                truth = stage_.truth().visibility(renderer.gbuffer(), stage_.world().lights(),
                                                  frame_.pairs);
            judge(camera, truth, f);
            step();
        }
    }

    CellCounts counts() const {
        return cellCounts(errors_, missingTapCount_, flickers_.total().flickerCount);
    }

    Json json() const {
        Json json = toJson(errors_);
        const CellCounts all = counts();
        for (size_t m = 0; m < all.size(); ++m)
            json[kCellMeasureNames[m]] = all[m];
        json["unnamed_count"] = all[size_t(CellMeasure::kUnexplained)] -
                                (errors_.settledFalseShadowCount + errors_.settledFalseLightCount);
        json["unnamed"] = unnamed_;
        const FlickerCounts::Class flicker = flickers_.total();
        json["flicker_answer_count"] = flicker.answerCount;
        json["flicker_held_count"] = flickers_.of(FlickerChange::kHeld).flickerCount;
        json["flicker_resolution_switch_count"] =
            flickers_.of(FlickerChange::kResolutionSwitch).flickerCount;
        json["flicker_method_switch_count"] =
            flickers_.of(FlickerChange::kMethodSwitch).flickerCount;
        json["traced_map_count"] = tracedMapCount_;
        json["drawn_map_count"] = drawnMapCount_;
        json["texel_count"] = texelCount_;
        json["pool_divisor"] = poolDivisor_;
        return json;
    }

    const FrameResult& last() const { return frame_; }

private:
    void judge(const Camera& camera, const std::vector<uint8_t>& truth, int f) {
        const FrameRenderer& renderer = stage_.renderer();
        const ErrorInputs inputs{
            renderer.gbuffer(),
            stage_.world().triangles(),
            viewOf(stage_.world().lights()),
            frame_.pairs,
            frame_.visibility,
            frame_.pairRoute,
            frame_.pairServer,
            {renderer.rayInputs(setup_.frame.rays), renderer.shadowMaps(), setup_.frame.bias}};
        ErrorOptions options;
        options.nullSampleCount = 0;
        options.rays = setup_.frame.rays;
        options.bias = setup_.frame.bias;
        const ErrorReport report = computeError(inputs, stage_.truth(), truth, options);
        errors_.add(report.total);
        list(inputs, report, f);
        missingTapCount_ += frame_.counts.missingTapCount;
        tracedMapCount_ += frame_.counts.tracedMapCount;
        drawnMapCount_ += frame_.counts.drawnMapCount;
        texelCount_ += frame_.counts.maps.texelCount;
        poolDivisor_ = std::max(poolDivisor_, double(frame_.counts.maps.degradeDivisor));
        flickers_.add(flicker_.add({inputs, camera}));
    }

    /// Lists the first errors without a name, with what it takes to look at one.
    void list(const ErrorInputs& inputs, const ErrorReport& report, int f) {
        const PairList& pairs = inputs.pairs;
        for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample)
            for (uint64_t p = pairs.sampleStart[sample]; p < pairs.sampleStart[sample + 1]; ++p) {
                if (report.verdicts[p] != PairVerdict::kUnexplained ||
                    unnamed_.size() >= kListedPairCount)
                    continue;
                const uint32_t light = pairs.light[p];
                const glm::vec3 position = inputs.gbuffer.positionWorld[sample],
                                normal = inputs.gbuffer.normalWorld[sample],
                                lightWorld = pointAtLight(inputs.lights[light], position);
                const uint32_t receiver = inputs.gbuffer.triangle[sample];
                const TruthBlocker blocker =
                    stage_.truth().blocker(position, normal, receiver, lightWorld);
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
                unnamed_.push_back(std::move(one));
            }
    }

    RealStage& stage_;
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
    FlickerMeter flicker_;
    FrameResult frame_;
    ErrorCounts errors_;
    FlickerCounts flickers_;
    Json unnamed_ = Json::array();
    uint64_t missingTapCount_ = 0, tracedMapCount_ = 0, drawnMapCount_ = 0, texelCount_ = 0;
    double poolDivisor_ = 1.0;
};

/// Writes the truth once and a method's errors.
class RealPictures {
public:
    RealPictures(RealStage& stage, const CellSetup& setup, const std::string& directory)
        : stage_(stage), directory_(directory), width_(setup.frame.width),
          height_(setup.frame.height) {}

    void draw(const FrameResult& frame, const std::vector<uint8_t>& truth,
              const std::string& method, Json& cell, Json& pictures) {
        if (directory_.empty())
            return;
        if (truthDisplay_.empty()) {
            const std::vector<glm::vec3> color =
                shadePairs(stage_.renderer().gbuffer(), stage_.world(), frame.pairs, truth);
            truthDisplay_ = toneMap(color, autoExposure(color));
            const std::string file = stage_.name() + "_truth.png";
            writePng(directory_ + "/" + file, width_, height_, truthDisplay_);
            pictures.push_back({{"scene", stage_.name()}, {"truth", file}});
        }
        const std::string file = stage_.name() + "_" + method + "_error.png";
        writePng(
            directory_ + "/" + file, width_, height_,
            errorPicture(truthDisplay_, countPixelErrors(frame.pairs, frame.visibility, truth)));
        cell["image"] = file;
    }

private:
    RealStage& stage_;
    std::string directory_;
    uint32_t width_, height_;
    std::vector<glm::vec3> truthDisplay_;
};

} // namespace

std::vector<std::string> realFiles(const std::vector<std::string>& arguments,
                                   const Console& console) {
    namespace fs = std::filesystem;
    std::vector<std::string> files;
    for (const std::string& argument : arguments) {
        if (!fs::is_directory(argument)) {
            files.push_back(argument);
            continue;
        }
        std::vector<std::string> inside;
        for (const fs::directory_entry& entry : fs::directory_iterator(argument)) {
            const std::string extension = entry.path().extension().string();
            if (extension == ".glb" || extension == ".gltf")
                inside.push_back(entry.path().string());
        }
        std::sort(inside.begin(), inside.end());
        size_t litCount = 0;
        for (const std::string& file : inside) {
            checkInterrupted();
            if (!readGltf(file).lights.empty()) {
                files.push_back(file);
                ++litCount;
            }
        }
        if (litCount == 0)
            throw Error(ErrorKind::kUsage,
                        argument + ": no .glb or .gltf file in it has lights; name another "
                                   "directory, or scenes");
        console.note(argument + ": " + std::to_string(litCount) + " of " +
                     std::to_string(inside.size()) + " scenes have lights");
    }
    if (files.empty())
        throw Error(ErrorKind::kUsage,
                    "compare real needs scenes: give .glb or .gltf files, or a directory of them");
    sceneNames(files); // throws where one is there twice
    requireUniqueStems(files);
    return files;
}

Json measureReal(const RealRequest& request, const Console& console) {
    requireUniqueStems(request.files);
    const CellSetup setup = cellSetup({realSettings(), request.settings});
    Json results = {
        {"settings", realSettings() + (request.settings.empty() ? "" : " ") + request.settings},
        {"frame_count", kRealFrameCount},
        {"cells", Json::array()},
        {"pictures", Json::array()}};
    size_t done = 0;
    const auto step = [&] {
        checkInterrupted();
        ++done;
        if (request.progress)
            request.progress(double(done) / double(request.files.size() * kMatrixMethodCount *
                                                   kRealFrameCount * 2));
    };
    for (const std::string& file : request.files) {
        RealStage stage(file, setup, request, console);
        RealPictures pictures(stage, setup, request.pictureDirectory);
        std::vector<std::vector<uint8_t>> truths(kRealFrameCount);
        for (int m = 0; m < kMatrixMethodCount; ++m) {
            const MatrixMethod method = MatrixMethod(m);
            RealCell cell(stage, method, setup);
            cell.measure(truths, step);
            const bool isKnown = stage.isKnown() && request.settings.empty();
            const std::string name = kMatrixMethodNames[size_t(m)];
            Json json = {{"scene", stage.name()},
                         {"geometry_hash", stage.scene().geometryHash},
                         {"triangle_count", stage.world().triangles().count()},
                         {"light_count", stage.world().lights().size()},
                         {"method", name},
                         {"known", isKnown               ? "yes"
                                   : stage.isOtherFile() ? "another file"
                                   : stage.isKnown()     ? "other settings"
                                                         : "no"}};
            json.update(cell.json());
            const auto& cells = knownRealCells();
            const auto known = std::find_if(cells.begin(), cells.end(), [&](const KnownCell& k) {
                return k.failure == stage.name() && k.method == method;
            });
            const bool hasKnown = isKnown && known != cells.end();
            const Json bounds = realBounds(isKnown ? stage.name() : "", method,
                                           hasKnown ? &known->counts : nullptr);
            Json broken = realBroken(json, bounds);
            if (isKnown && !hasKnown)
                broken.push_back("unknown");
            json["bounds"] = bounds;
            json["broken"] = broken;
            pictures.draw(cell.last(), truths.back(), name, json, results["pictures"]);
            results["cells"].push_back(std::move(json));
        }
    }
    return results;
}

} // namespace shadowdag
