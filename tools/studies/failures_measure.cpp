// SPDX-License-Identifier: Apache-2.0
// Measures the cells of a failure: frames, reevaluated pairs, counts, pictures.
#include "tools/settings/experiment.h"
#include "tools/studies/cell_tally.h"
#include "tools/studies/failures.h"

#include "cuda/error.h"
#include "hybrid/gl/gl_options.h"
#include "tools/workspace/error_image.h"
#include "tools/workspace/image_io.h"
#include "tools/workspace/reevaluate_pairs.h"

#include <algorithm>
#include <map>

namespace shadowdag {

namespace {

constexpr uint32_t kNullSampleCount = 400; ///< right pairs sampled in a frame

/// Measures the cells of one failure and adds them to the results.
class FailureMeasurement {
public:
    FailureMeasurement(const Failure& failure, const Slack& slack, const StudyRequest& request,
                       const Console& console, Json& results)
        : failure_(failure), slack_(slack), request_(request), results_(results),
          workspace_(loadSceneAndWorld(failure.scene, -1, 1, true, console),
                     {request.backend, "", {}}),
          judge_(workspace_, 1, kNullSampleCount) {}

    void measure() {
        std::map<std::pair<int, bool>, CellCounts> counts;
        for (int m = 0; m < kMatrixMethodCount; ++m) {
            const MatrixMethod method = MatrixMethod(m);
            const bool isSwitched = failure_.hasRemedy() && (readsAny(method, failure_.off) ||
                                                             readsAny(method, failure_.on));
            if (!leavesOut(method, isSwitched)) {
                if (isSwitched)
                    counts[{m, false}] = measureCell(method, false, true);
                counts[{m, true}] = measureCell(method, true, isSwitched);
                if (!isSwitched)
                    counts[{m, false}] = counts[{m, true}];
            }
            if (request_.progress)
                request_.progress(double(m + 1) / kMatrixMethodCount);
        }
        for (const RemedySeen& seen : failure_.seen) {
            if (!counts.contains({int(seen.method), true}) || !failure_.isBounded)
                continue;
            const uint64_t off = counts[{int(seen.method), false}][size_t(seen.measure)],
                           on = counts[{int(seen.method), true}][size_t(seen.measure)];
            results_["remedies"].push_back(
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
    /// Returns whether the backend does not support the method with and without the remedy, and
    /// reports it.
    bool leavesOut(MatrixMethod method, bool isSwitched) {
        if (request_.backend != Backend::kGl)
            return false;
        for (const bool isOn : {false, true}) {
            if (!isOn && !isSwitched)
                continue;
            CellSetup setup = cellSetup({failure_.always, isOn ? failure_.on : failure_.off});
            modelOf(method, setup); // sets the method
            const std::string why = unfollowedByGl(setup.frame);
            if (why.empty())
                continue;
            results_["left_out"].push_back({{"failure", failure_.name},
                                            {"method", kMatrixMethodNames[size_t(method)]},
                                            {"why", "--backend gl " + why}});
            return true;
        }
        return false;
    }

    CellCounts measureCell(MatrixMethod method, bool isOn, bool isSwitched) {
        const std::string& own = isOn ? failure_.on : failure_.off;
        CellSetup setup = cellSetup({failure_.always, own});
        const std::unique_ptr<CostModel> model = modelOf(method, setup);
        CellTally tally(workspace_);
        FrameRenderer& renderer = workspace_.renderer(setup.resolutionLog2);
        renderer.reset();
        PairResults answers;
        for (int f = 0; f < failure_.frameCount; ++f) {
            workspace_.setTime(float(failure_.startSeconds + f * failure_.stepSeconds));
            if (!setup.keepsFrames)
                renderer.reset();
            answers = answer(renderer, setup, *model, !setup.redraws && f > 0);
            tally.add(judge_, f, answers, workspace_.camera(), failure_.frameCount > 1);
            if (!setup.redraws && f > 0) // the requests of the next frame
                renderer.render(workspace_.camera(), *model, setup.frame);
        }
        const CellCounts counts = tally.counts();
        const std::string name = kMatrixMethodNames[size_t(method)];
        Json json = {{"failure", failure_.name},
                     {"scene", failure_.scene.starts_with("builtin:") ? failure_.scene.substr(8)
                                                                      : failure_.scene},
                     {"method", name},
                     {"remedy", !failure_.hasRemedy() ? "none"
                                : !isSwitched         ? "not read"
                                : isOn                ? "on"
                                                      : "off"},
                     {"settings",
                      failure_.always + (failure_.always.empty() || own.empty() ? "" : " ") + own}};
        json.update(tally.json());
        addBounds(method, isOn, counts, json);
        if (!request_.pictureDirectory.empty() && isPictured(method))
            draw(renderer, answers, setup, fileNameOf(method), isOn, json);
        results_["cells"].push_back(std::move(json));
        return counts;
    }

    /// Renders a frame with a setup. @param asksOldMaps use the maps of the frame before: another
    /// renderer draws the frame, so that these remain
    PairResults answer(FrameRenderer& renderer, const CellSetup& setup, const CostModel& model,
                       bool asksOldMaps) {
        FrameRenderer& drawn =
            asksOldMaps ? workspace_.renderer(setup.resolutionLog2, 1) : renderer;
        if (asksOldMaps)
            drawn.reset();
        PairResults answers = pairResultsOf(drawn.render(workspace_.camera(), model, setup.frame),
                                            drawn, setup.frame);
        if (asksOldMaps) {
            answers.method.maps = renderer.shadowMaps();
            if (answers.method.maps.maps.count != answers.frame.counts.drawnMapCount)
                throw Error(ErrorKind::kUsage,
                            failure_.name + ": redraw=off needs the same maps in all frames");
        }
        leaveOut(setup.hasMovers, setup.hasPlane, answers);
        if (asksOldMaps || !setup.hasMovers || !setup.hasPlane)
            askAgain(workspace_.world(), answers);
        return answers;
    }

    /// Adds "broken", the names of the measures above their bounds, or "unknown", and "bounds".
    void addBounds(MatrixMethod method, bool isOn, const CellCounts& counts, Json& json) const {
        Json broken = Json::array(), bounds = Json::object();
        const KnownCell* known = findKnown(failure_.known, method, isOn);
        if (!known && failure_.isBounded)
            broken.push_back("unknown");
        if (json["pair_count"] == 0) // nothing was judged
            broken.push_back("pair_count");
        if (known && failure_.isBounded) {
            const CellCounts bound = boundOf(known->counts, slack_);
            for (size_t m = 0; m < counts.size(); ++m) {
                bounds[kCellMeasureNames[m]] = bound[m];
                if (counts[m] > bound[m])
                    broken.push_back(kCellMeasureNames[m]);
            }
        }
        json["broken"] = broken;
        json["bounds"] = bounds;
    }

    /// Returns whether the page shows the method: it must show the remedy, if there is one.
    bool isPictured(MatrixMethod method) const {
        if (failure_.seen.empty())
            return method == MatrixMethod::kMaps || method == MatrixMethod::kDagAll;
        return std::any_of(failure_.seen.begin(), failure_.seen.end(),
                           [&](const RemedySeen& seen) { return seen.method == method; });
    }

    /// Draws the last frame by the method and by the truth.
    void draw(const FrameRenderer& renderer, const PairResults& answers, const CellSetup& setup,
              const std::string& method, bool isOn, Json& json) {
        const PairList& pairs = answers.frame.pairs;
        const bool isFirst = results_["pictures"].empty();
        const FrameTruth& truth =
            judge_.picture(failure_.frameCount - 1, renderer.gbuffer(), pairs);
        const auto write = [&](const std::string& file, const std::vector<glm::vec3>& picture) {
            writePng(request_.pictureDirectory + "/" + file, setup.frame.width, setup.frame.height,
                     picture);
        };
        if (isFirst) {
            const std::string file = fileSlug(failure_.name) + "_truth.png";
            write(file, truth.display);
            results_["pictures"].push_back({{"failure", failure_.name}, {"truth", file}});
        }
        const std::string stem = fileSlug(failure_.name) + "_" + method + (isOn ? "_on" : "_off");
        json["images"] = {{"color", stem + ".png"}, {"error", stem + "_error.png"}};
        write(stem + ".png", toneMap(shadePairs(renderer.gbuffer(), workspace_.world(), pairs,
                                                answers.frame.visibility),
                                     truth.exposure));
        write(stem + "_error.png",
              errorPicture(truth.display,
                           countPixelErrors(pairs, answers.frame.visibility, truth.visibility)));
    }

    const Failure& failure_;
    const Slack& slack_;
    const StudyRequest& request_;
    Json& results_;
    Workspace workspace_;
    Judge judge_;
};

} // namespace

Json measureFailure(const Failure& row, const Slack& slack, const StudyRequest& request,
                    const Console& console) {
    Json results = {{"cells", Json::array()},
                    {"remedies", Json::array()},
                    {"pictures", Json::array()},
                    {"left_out", Json::array()}};
    FailureMeasurement(row, slack, request, console, results).measure();
    return results;
}

} // namespace shadowdag
