// SPDX-License-Identifier: Apache-2.0
// The cells of the matrix of failures: stages, frames, pairs asked again, counts, pictures.
#include "tools/studies/failures.h"

#include "cuda/error.h"
#include "hybrid/gl/gl_options.h"
#include "hybrid/judge/flicker.h"
#include "scenes/fail_scenes.h"
#include "tools/settings/parse.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/image_io.h"
#include "tools/workspace/reevaluate_pairs.h"
#include "tools/workspace/scene_setup.h"
#include "voxel/voxelize.h"

#include <algorithm>
#include <map>
#include <memory>

namespace shadowdag {

namespace {

constexpr uint32_t kFlickerPointCount = 6000;

/// A failure scene with voxels and renderers, made when first asked for, and the truth, all at one
/// time.
class Stage {
public:
    Stage(const FailScene& description, Backend backend)
        : backend_(backend), scene_(makeFailScene(description)), world_(scene_, {}),
          truth_(world_) {}

    void show(double timeSeconds) {
        if (float(timeSeconds) == world_.timeSeconds())
            return;
        const std::vector<uint32_t> moved = world_.setTime(float(timeSeconds));
        for (auto& [key, renderer] : renderers_)
            renderer->worldChanged(moved);
        if (!moved.empty())
            truth_.update(world_);
    }

    /// Returns renderer number `role` of a resolution: each keeps frames of its own.
    FrameRenderer& renderer(uint32_t resolutionLog2, int role = 0) {
        Dag& dag = dags_[resolutionLog2];
        if (!dag.isBuilt())
            dag = voxelize(world_.triangles(), viewOf(world_.staticTriangles()),
                           sceneGrid(world_, resolutionLog2));
        std::unique_ptr<FrameRenderer>& renderer = renderers_[{resolutionLog2, role}];
        if (!renderer)
            renderer = std::make_unique<FrameRenderer>(backend_, world_, dag);
        return *renderer;
    }

    const World& world() const { return world_; }
    const Truth& truth() const { return truth_; }
    const Camera& camera() const { return world_.cameras().at(0); }

private:
    Backend backend_;
    Scene scene_;
    World world_;
    Truth truth_;
    std::map<uint32_t, Dag> dags_;
    std::map<std::pair<uint32_t, int>, std::unique_ptr<FrameRenderer>> renderers_;
};

/// One cell: its frames in order.
class Cell {
public:
    Cell(Stage& stage, const Failure& failure, MatrixMethod method, const CellSetup& setup)
        : stage_(stage), failure_(failure), setup_(setup), model_(modelOf(method, setup_)),
          flicker_(stage.truth(), 1, kFlickerPointCount) {}

    /// Renders and judges all frames. @param truths what Embree answers, by frame; filled as needed
    void measure(std::vector<std::vector<uint8_t>>& truths) {
        FrameRenderer& renderer = stage_.renderer(setup_.resolutionLog2);
        renderer.reset();
        for (int f = 0; f < failure_.frameCount; ++f) {
            stage_.show(failure_.startSeconds + f * failure_.stepSeconds);
            if (!setup_.keepsFrames)
                renderer.reset();
            Answers answers = answer(renderer);
            if (truths[size_t(f)].empty())
                truths[size_t(f)] = stage_.truth().visibility(
                    answers.gbuffer, stage_.world().lights(), answers.frame.pairs);
            judge(answers, truths[size_t(f)]);
            if (!setup_.redraws && f > 0) // what the next frame asks
                renderer.render(stage_.camera(), *model_, setup_.frame);
            if (f + 1 == failure_.frameCount)
                last_ = {answers.frame.pairs, answers.frame.visibility,
                         shadePairs(renderer.gbuffer(), stage_.world(), answers.frame.pairs,
                                    answers.frame.visibility),
                         shadePairs(renderer.gbuffer(), stage_.world(), answers.frame.pairs,
                                    truths[size_t(f)])};
        }
    }

    CellCounts counts() const {
        return cellCounts(errors_, missingTapCount_, flickers_.total().flickerCount);
    }

    Json json() const {
        Json json = toJson(errors_);
        json["missing_tap_count"] = missingTapCount_;
        json["flicker_answer_count"] = flickers_.total().answerCount;
        json["flicker_count"] = flickers_.total().flickerCount;
        json["flicker_held_count"] = flickers_.of(FlickerChange::kHeld).flickerCount;
        json["flicker_resolution_switch_count"] =
            flickers_.of(FlickerChange::kResolutionSwitch).flickerCount;
        json["flicker_method_switch_count"] =
            flickers_.of(FlickerChange::kMethodSwitch).flickerCount;
        json["traced_map_count"] = tracedMapCount_;
        json["drawn_map_count"] = drawnMapCount_;
        json["texel_count"] = texelCount_;
        return json;
    }

    /// The last frame: its answers and what it looks like, by the method and by the truth.
    struct Picture {
        PairList pairs;
        std::vector<uint8_t> visibility;
        std::vector<glm::vec3> color, truthColor;
    };
    const Picture& last() const { return last_; }

private:
    Answers answer(FrameRenderer& renderer) {
        Answers a;
        const bool asksOldMaps = !setup_.redraws && hasMaps_;
        if (asksOldMaps) { // another renderer draws the frame, so that the old maps stay
            FrameRenderer& witness = stage_.renderer(setup_.resolutionLog2, 1);
            witness.reset();
            a.frame = witness.render(stage_.camera(), *model_, setup_.frame);
            a.gbuffer = witness.gbuffer();
            a.method = {witness.rayInputs(setup_.frame.rays), renderer.shadowMaps(),
                        setup_.frame.bias};
            if (a.method.maps.maps.count != a.frame.counts.drawnMapCount)
                throw Error(ErrorKind::kUsage, failure_.name +
                                                   ": redraw=off needs the same maps in "
                                                   "all frames");
        } else {
            a.frame = renderer.render(stage_.camera(), *model_, setup_.frame);
            a.gbuffer = renderer.gbuffer();
            a.method = {renderer.rayInputs(setup_.frame.rays), renderer.shadowMaps(),
                        setup_.frame.bias};
        }
        a.missingTapCount = a.frame.counts.missingTapCount;
        leaveOut(setup_.hasMovers, setup_.hasPlane, a);
        if (asksOldMaps || !setup_.hasMovers || !setup_.hasPlane)
            askAgain(stage_.world(), a);
        hasMaps_ = true;
        return a;
    }

    void judge(const Answers& answers, const std::vector<uint8_t>& truth) {
        const ErrorInputs inputs{answers.gbuffer,
                                 stage_.world().triangles(),
                                 viewOf(stage_.world().lights()),
                                 answers.frame.pairs,
                                 answers.frame.visibility,
                                 answers.frame.pairRoute,
                                 answers.frame.pairServer,
                                 answers.method};
        ErrorOptions options;
        options.nullSampleCount = 0;
        options.rays = setup_.frame.rays;
        options.bias = answers.method.bias;
        errors_.add(computeError(inputs, stage_.truth(), truth, options).total);
        missingTapCount_ += answers.missingTapCount;
        tracedMapCount_ += answers.frame.counts.tracedMapCount;
        drawnMapCount_ += answers.frame.counts.drawnMapCount;
        texelCount_ += answers.frame.counts.maps.texelCount;
        if (failure_.frameCount > 1)
            flickers_.add(flicker_.add({inputs, stage_.camera()}));
    }

    Stage& stage_;
    const Failure& failure_;
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
    FlickerMeter flicker_;
    bool hasMaps_ = false;
    ErrorCounts errors_;
    FlickerCounts flickers_;
    uint64_t missingTapCount_ = 0, tracedMapCount_ = 0, drawnMapCount_ = 0, texelCount_ = 0;
    Picture last_;
};

const FailScene& sceneOf(const std::vector<FailScene>& scenes, const Failure& failure) {
    const auto found = std::find_if(scenes.begin(), scenes.end(), [&](const FailScene& scene) {
        return scene.name == failure.scene;
    });
    if (found == scenes.end())
        throw Error(ErrorKind::kUsage, "failure " + failure.name + " names the scene '" +
                                           failure.scene + "', which there is not");
    return *found;
}

/// Returns the names of the measures that are over what is known, or "unknown".
Json brokenOf(const std::string& failure, MatrixMethod method, bool isOn, const CellCounts& counts,
              Json& bounds) {
    Json broken = Json::array();
    const auto& known = knownCells();
    const auto found = std::find_if(known.begin(), known.end(), [&](const KnownCell& cell) {
        return cell.failure == failure && cell.method == method && cell.isOn == isOn;
    });
    bounds = Json::object();
    if (found == known.end()) {
        broken.push_back("unknown");
        return broken;
    }
    const CellCounts bound = boundOf(found->counts);
    for (size_t m = 0; m < counts.size(); ++m) {
        bounds[kCellMeasureNames[m]] = bound[m];
        if (counts[m] > bound[m])
            broken.push_back(kCellMeasureNames[m]);
    }
    return broken;
}

/// Measures the cells of one failure and adds them to the matrix.
class FailureMeasurement {
public:
    FailureMeasurement(const Failure& failure, const FailScene& scene, const MatrixRequest& request,
                       Json& matrix)
        : failure_(failure), stage_(scene, request.backend), request_(request), matrix_(matrix),
          truths_(size_t(failure.frameCount)) {}

    void measure(const std::function<void()>& step) {
        std::map<std::pair<int, bool>, CellCounts> counts;
        for (int m = 0; m < kMatrixMethodCount; ++m) {
            const MatrixMethod method = MatrixMethod(m);
            const bool isSwitched = failure_.hasRemedy() && (readsAny(method, failure_.off) ||
                                                             readsAny(method, failure_.on));
            if (leavesOut(method, isSwitched)) {
                step();
                continue;
            }
            if (isSwitched)
                counts[{m, false}] = measureCell(method, false, true);
            counts[{m, true}] = measureCell(method, true, isSwitched);
            if (!isSwitched)
                counts[{m, false}] = counts[{m, true}];
            step();
        }
        for (const RemedySeen& seen : failure_.seen) {
            if (!counts.contains({int(seen.method), true}))
                continue; // left out
            const uint64_t off = counts[{int(seen.method), false}][size_t(seen.measure)],
                           on = counts[{int(seen.method), true}][size_t(seen.measure)];
            matrix_["remedies"].push_back(
                {{"failure", failure_.name},
                 {"method", kMatrixMethodNames[size_t(seen.method)]},
                 {"measure", kCellMeasureNames[size_t(seen.measure)]},
                 {"off", off},
                 {"on", on},
                 {"factor", seen.factor},
                 {"is_seen", double(off) > seen.factor * double(on) && off > 20}});
        }
    }

private:
    /// Returns whether the backend cannot do the method with and without the remedy, and says so.
    bool leavesOut(MatrixMethod method, bool isSwitched) {
        if (request_.backend != Backend::kGl)
            return false;
        for (const bool isOn : {false, true}) {
            if (!isOn && !isSwitched)
                continue;
            CellSetup setup = cellSetup({failure_.always, isOn ? failure_.on : failure_.off});
            modelOf(method, setup); // sets what the method is
            const std::string why = unfollowedByGl(setup.frame);
            if (why.empty())
                continue;
            const std::string name = kMatrixMethodNames[size_t(method)];
            matrix_["left_out"].push_back(
                {{"failure", failure_.name}, {"method", name}, {"why", "--backend gl " + why}});
            return true;
        }
        return false;
    }

    CellCounts measureCell(MatrixMethod method, bool isOn, bool isSwitched) {
        const std::string& own = isOn ? failure_.on : failure_.off;
        Cell cell(stage_, failure_, method, cellSetup({failure_.always, own}));
        cell.measure(truths_);
        const std::string name = kMatrixMethodNames[size_t(method)];
        const CellCounts counts = cell.counts();
        Json bounds,
            json = {{"failure", failure_.name},
                    {"scene", failure_.scene},
                    {"method", name},
                    {"remedy", !failure_.hasRemedy() ? "none"
                               : !isSwitched         ? "not read"
                               : isOn                ? "on"
                                                     : "off"},
                    {"settings",
                     failure_.always + (failure_.always.empty() || own.empty() ? "" : " ") + own}};
        json.update(cell.json());
        json["mean_error_millionths"] = counts[size_t(CellMeasure::kMeanError)];
        json["unexplained_count"] = counts[size_t(CellMeasure::kUnexplained)];
        const Json broken = brokenOf(failure_.name, method, isOn, counts, bounds);
        json["broken"] = broken;
        json["bounds"] = bounds;
        if (!request_.pictureDirectory.empty() && isPictured(method))
            draw(cell.last(), name, isOn, json);
        matrix_["cells"].push_back(std::move(json));
        return counts;
    }

    /// Returns whether the page shows the method: it must show the remedy, or there is none.
    bool isPictured(MatrixMethod method) const {
        if (!failure_.hasRemedy())
            return method == MatrixMethod::kMaps || method == MatrixMethod::kDag;
        return std::any_of(failure_.seen.begin(), failure_.seen.end(),
                           [&](const RemedySeen& seen) { return seen.method == method; });
    }

    void draw(const Cell::Picture& picture, const std::string& method, bool isOn, Json& json) {
        if (exposure_ == 0) {
            exposure_ = autoExposure(picture.truthColor);
            truthDisplay_ = toneMap(picture.truthColor, exposure_);
            const std::string file = failure_.name + "_truth.png";
            write(file, truthDisplay_);
            matrix_["pictures"].push_back({{"failure", failure_.name}, {"truth", file}});
        }
        const std::string stem = failure_.name + "_" + method + (isOn ? "_on" : "_off");
        json["images"] = {{"color", stem + ".png"}, {"error", stem + "_error.png"}};
        write(stem + ".png", toneMap(picture.color, exposure_));
        write(stem + "_error.png",
              errorPicture(truthDisplay_,
                           countPixelErrors(picture.pairs, picture.visibility, truthOfLast())));
    }

    const std::vector<uint8_t>& truthOfLast() const { return truths_.back(); }

    void write(const std::string& file, const std::vector<glm::vec3>& picture) const {
        const CellSetup setup = cellSetup({});
        writePng(request_.pictureDirectory + "/" + file, setup.frame.width, setup.frame.height,
                 picture);
    }

    const Failure& failure_;
    Stage stage_;
    const MatrixRequest& request_;
    Json& matrix_;
    std::vector<std::vector<uint8_t>> truths_;
    float exposure_ = 0;
    std::vector<glm::vec3> truthDisplay_;
};

} // namespace

CellCounts cellCounts(const ErrorCounts& errors, uint64_t missingTapCount, uint64_t flickerCount) {
    return {errors.falseShadowCount,
            errors.falseLightCount,
            errors.unexplainedFalseShadowCount + errors.unexplainedFalseLightCount,
            errors.acneCount,
            errors.contactCount,
            missingTapCount,
            uint64_t(errors.meanAbsVisibilityError() * 1e6 + 0.5),
            flickerCount};
}

std::vector<const Failure*> failuresNamed(const std::vector<std::string>& names) {
    std::vector<const Failure*> rows;
    for (const std::string& name : names) {
        const auto found = std::find_if(failures().begin(), failures().end(),
                                        [&](const Failure& f) { return f.name == name; });
        if (found == failures().end()) {
            std::string all;
            for (const Failure& f : failures())
                all += (all.empty() ? "" : ", ") + f.name;
            throw Error(ErrorKind::kUsage, "--only '" + name + "': must be one of " + all);
        }
        rows.push_back(&*found);
    }
    if (rows.empty())
        for (const Failure& f : failures())
            rows.push_back(&f);
    return rows;
}

Json measureFailures(const MatrixRequest& request) {
    const std::vector<const Failure*> rows = failuresNamed(request.names);
    Json matrix = {{"cells", Json::array()},
                   {"remedies", Json::array()},
                   {"pictures", Json::array()},
                   {"left_out", Json::array()}};
    const std::vector<FailScene> scenes = failScenes();
    size_t done = 0;
    for (const Failure* row : rows)
        FailureMeasurement(*row, sceneOf(scenes, *row), request, matrix).measure([&] {
            if (request.progress)
                request.progress(double(++done) / double(rows.size() * kMatrixMethodCount));
        });
    return matrix;
}

std::vector<std::string> brokenLines(const Json& matrix) {
    std::vector<std::string> lines;
    for (const Json& cell : matrix["cells"])
        for (const Json& measure : cell["broken"]) {
            const std::string name = measure.get<std::string>();
            lines.push_back(
                cell["failure"].get<std::string>() + " by " + cell["method"].get<std::string>() +
                ", remedy " + cell["remedy"].get<std::string>() + ": " +
                (name == "unknown"
                     ? std::string("no bound is known; run tools/report/failure_known.py")
                     : name + " is " + cell[name].dump() + ", bound " +
                           cell["bounds"][name].dump()));
        }
    for (const Json& remedy : matrix["remedies"])
        if (!remedy["is_seen"].get<bool>())
            lines.push_back(remedy["failure"].get<std::string>() + " by " +
                            remedy["method"].get<std::string>() + ": the remedy is not seen, " +
                            remedy["measure"].get<std::string>() + " is " + remedy["off"].dump() +
                            " without and " + remedy["on"].dump() + " with it");
    return lines;
}

} // namespace shadowdag
