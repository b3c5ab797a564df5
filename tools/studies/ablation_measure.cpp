// SPDX-License-Identifier: Apache-2.0
// Measures both sides of every mechanism on a scene: results, counts, times in turn. More than 300
// lines because reading, timing and judging share the measurements.
#include "tools/studies/ablation.h"

#include "cuda/error.h"
#include "hybrid/judge/flicker.h"
#include "tools/settings/console.h"
#include "tools/workspace/calibration.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/reevaluate_pairs.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <map>
#include <memory>

namespace shadowdag {

namespace {

/// Results of all pairs of a frame with their judgement.
struct JudgedResults {
    int frame = 0;
    bool hasFlip = false, hasPlane = true, hasMovers = true;
    uint32_t resolutionLog2 = 0; ///< of voxels
    float offset = 0, biasTexels = 0;
    float believe = 0;
    std::vector<uint8_t> visibility;  ///< by pair
    std::vector<Route> pairRoute;     ///< by pair
    std::vector<uint32_t> faceTexels; ///< by map
    ErrorCounts errors;
    double flip = 0;

    /// Returns whether both are the same results, with the same inputs of the judgement.
    bool isOf(const JudgedResults& other) const {
        return frame == other.frame && hasFlip == other.hasFlip && hasPlane == other.hasPlane &&
               hasMovers == other.hasMovers && resolutionLog2 == other.resolutionLog2 &&
               offset == other.offset && biasTexels == other.biasTexels &&
               believe == other.believe && visibility == other.visibility &&
               pairRoute == other.pairRoute && faceTexels == other.faceTexels;
    }
};

/// A scene on which mechanisms are measured. Frames are counted from 0, the lead-in of sequences is
/// -1. A scene is shown one second after its start, when all built-in ones move, a failure at the
/// time of its row.
struct AblationScene {
    std::string name, settings; ///< of all frames
    bool isFailure = false;
    double startSeconds = 1.0, stepSeconds = 1.0 / 30;
    int sequenceFrames = 0;
    Workspace workspace;
    Judge judge{workspace};
    std::list<JudgedResults> judged;

    AblationScene(const AblationTable& table, const std::string& scene, const Failure* failure,
                  const Console& console)
        : name(failure ? failure->name : scene), settings(failure ? failure->always : ""),
          isFailure(failure != nullptr), sequenceFrames(table.sequenceFrames),
          workspace(loadSceneAndWorld(scene, -1, 1, true, console), {table.backend, "", {}}) {
        if (!failure)
            return;
        startSeconds = failure->startSeconds;
        if (failure->frameCount > 1) {
            stepSeconds = failure->stepSeconds;
            sequenceFrames = failure->frameCount - 1;
            startSeconds += failure->stepSeconds;
        }
    }

    int frameCount(bool isSequence) const { return isSequence ? sequenceFrames : 1; }
    void show(int frame) { workspace.setTime(float(startSeconds + frame * stepSeconds)); }
};

/// The measurements of one side of a mechanism on one scene, over its frames.
struct Reading {
    ErrorCounts errors;
    double flip = 0;    ///< mean
    uint64_t bytes = 0; ///< of the frame with the most
    uint64_t triangleCount = 0, texelCount = 0, pageCount = 0, rayCount = 0, lookupCount = 0,
             flickerCount = 0, flickerResultCount = 0;

    double of(GainMetric metric) const {
        switch (metric) {
        case GainMetric::kTime:
            break; // is of pairs of runs
        case GainMetric::kError:
            return errors.meanAbsVisibilityError();
        case GainMetric::kBytes:
            return double(bytes);
        case GainMetric::kTriangles:
            return double(triangleCount);
        case GainMetric::kTexels:
            return double(texelCount);
        case GainMetric::kFalseShadow:
            return double(errors.falseShadowCount);
        case GainMetric::kFalseLight:
            return double(errors.falseLightCount);
        case GainMetric::kFlicker:
            return double(flickerCount);
        case GainMetric::kFlip:
            return flip;
        case GainMetric::kWrong:
            return double(errors.falseShadowCount + errors.falseLightCount);
        }
        throw std::logic_error("a time is not a count");
    }

    Json json() const {
        Json json = toJson(errors);
        if (flip > 0)
            json["flip"] = flip;
        json["bytes"] = bytes;
        json["triangle_draw_count"] = triangleCount;
        json["texel_count"] = texelCount;
        json["page_count"] = pageCount;
        json["ray_count"] = rayCount;
        json["lookup_count"] = lookupCount;
        json["flicker_count"] = flickerCount;
        json["flicker_answer_count"] = flickerResultCount;
        return json;
    }
};

/// Returns the number added to values of a metric so that none is 0: one for a count, one wrong
/// pair for a mean error, a visible thousandth for FLIP.
double floorOf(GainMetric metric, const Reading& reading) {
    return metric == GainMetric::kError
               ? 1.0 / double(std::max<uint64_t>(1, reading.errors.pairCount))
           : metric == GainMetric::kFlip ? 1e-5
                                         : 1.0;
}

/// One side of a mechanism on one scene.
class Side {
public:
    Side(AblationScene& scene, const Mechanism& row, const CellSetup& setup)
        : scene_(scene), row_(row), setup_(setup), model_(modelOf(row.method, setup_)) {}

    /// Renders and judges all counted frames.
    Reading read() {
        Reading reading;
        FlickerMeter flicker(scene_.workspace.truth(), 1, 6000);
        for (int f = firstFrame(); f < scene_.frameCount(row_.isSequence); ++f) {
            if (f < 0 && row_.metric != GainMetric::kFlicker) {
                render(f, false);
                continue;
            }
            PairResults answers = pairResultsOf(render(f, true), renderer(), setup_.frame);
            if (!hasAll()) {
                leaveOut(setup_.hasMovers, setup_.hasPlane, answers);
                askAgain(scene_.workspace.world(), answers);
            }
            judge(f, answers, flicker, reading);
        }
        reading.flip /= double(scene_.frameCount(row_.isSequence));
        return reading;
    }

    /// Renders all frames and returns the time of the counted ones.
    double time() {
        double ms = 0;
        for (int f = firstFrame(); f < scene_.frameCount(row_.isSequence); ++f) {
            const double frameMs = render(f, false).stages.totalMs();
            if (f >= 0)
                ms += frameMs;
        }
        return ms;
    }

    /// Returns whether frames are rendered with the whole setup, with nothing removed afterwards.
    bool hasAll() const { return setup_.hasPlane && setup_.hasMovers; }

private:
    /// Sequences start with a frame that does not count.
    int firstFrame() const { return row_.isSequence ? -1 : 0; }
    FrameRenderer& renderer() { return scene_.workspace.renderer(setup_.resolutionLog2); }

    FrameResult render(int frame, bool recordPairs) {
        checkInterrupted();
        scene_.show(frame);
        FrameRenderer& own = renderer();
        if (frame == firstFrame() || !row_.isSequence || !setup_.keepsFrames)
            own.reset();
        FrameOptions options = setup_.frame;
        options.recordPairs = recordPairs;
        return own.render(scene_.workspace.camera(), *model_, options);
    }

    void judge(int frame, const PairResults& answers, FlickerMeter& flicker, Reading& reading) {
        if (row_.metric == GainMetric::kFlicker) {
            scene_.workspace.truth(); // as it is now: the flicker meter uses it as well
            const FlickerCounts::Class total =
                flicker
                    .add(
                        {errorInputs(scene_.workspace.world(), answers), scene_.workspace.camera()})
                    .total();
            reading.flickerCount += total.flickerCount;
            reading.flickerResultCount += total.answerCount;
        }
        if (frame < 0)
            return;
        const JudgedResults& judged = judgedAs(frame, answers);
        reading.errors.add(judged.errors);
        reading.flip += judged.flip;
        const FrameCounts& counts = answers.frame.counts;
        const bool usesRays = counts.rayCount > 0 || counts.provenPairCount > 0;
        reading.bytes = std::max(
            reading.bytes, counts.maps.mapBytes + (usesRays ? renderer().dagBytes() : 0) +
                               (!setup_.frame.rays.believesAll() ? renderer().exactBytes() : 0));
        reading.triangleCount += counts.maps.triangleDrawCount;
        reading.texelCount += counts.maps.texelCount;
        reading.pageCount += counts.maps.pageCount;
        reading.rayCount += counts.rayCount;
        reading.lookupCount += counts.lookupCount;
    }

    /// Judges results, or returns the judgement of equal results of the frame: the same visibility
    /// of every pair by the same method, at the same resolutions of maps and rays.
    const JudgedResults& judgedAs(int frame, const PairResults& answers) {
        const FrameResult& result = answers.frame;
        JudgedResults judged{frame,
                             row_.asksFlip(),
                             setup_.hasPlane,
                             setup_.hasMovers,
                             uint32_t(setup_.resolutionLog2),
                             setup_.frame.rays.offset,
                             setup_.frame.bias.constantTexels,
                             setup_.frame.rays.believe,
                             result.visibility,
                             result.pairRoute,
                             {},
                             {},
                             0};
        for (const MapRecord& map : result.maps)
            judged.faceTexels.push_back(map.quantities.faceTexels);
        for (const JudgedResults& known : scene_.judged)
            if (known.isOf(judged))
                return known;
        judged.errors = scene_.judge.judge(frame, answers).total;
        if (judged.hasFlip) {
            const FrameTruth& truth = scene_.judge.picture(frame, answers.gbuffer, result.pairs);
            const std::vector<glm::vec3> color =
                hasAll() ? result.color
                         : shadePairs(answers.gbuffer, scene_.workspace.world(), result.pairs,
                                      result.visibility);
            judged.flip = computeFlip(truth.display, toneMap(color, truth.exposure),
                                      setup_.frame.width, setup_.frame.height);
        }
        scene_.judged.push_back(std::move(judged));
        return scene_.judged.back();
    }

    AblationScene& scene_;
    const Mechanism& row_;
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
};

double ratio(const Gain& gain) {
    return std::exp(-gain.log);
}

/// Measures mechanisms on one scene.
class AblationMeasurement {
public:
    AblationMeasurement(const AblationTable& table, AblationScene& scene)
        : table_(table), scene_(scene) {}

    /// Renders a frame by maps of the largest pages, so that growing memory is not charged to a
    /// mechanism.
    void warmUp() {
        static const Mechanism row{"warm-up", "", MatrixMethod::kMaps, GainMetric::kTime,
                                   "",        "", "page_size=256"};
        Side(scene_, row, setupOf(row, row.on)).time();
    }

    /// Returns two frames, two seconds apart, with the cost of every map by both methods.
    std::vector<ObservedFrame> observe() {
        std::vector<ObservedFrame> frames;
        for (uint32_t f = 0; f < 2; ++f) {
            scene_.show(int(60 * f));
            FrameOptions options;
            options.width = table_.width;
            options.height = table_.height;
            options.maps.poolBytes = 1ull << 30;
            frames.push_back(
                measureCalibrationFrame(scene_.workspace.renderer(table_.resolutionLog2),
                                        scene_.workspace.camera(), options, 1)
                    .observed);
            frames.back().scene = scene_.name;
            frames.back().view =
                std::to_string(options.width) + "x" + std::to_string(options.height);
            frames.back().frame = f;
        }
        return frames;
    }

    /// Returns the row's entry, with its gains.
    Json measure(const Mechanism& row) {
        const CellSetup offSetup = setupOf(row, row.off), onSetup = setupOf(row, row.on);
        Side off(scene_, row, offSetup), on(scene_, row, onSetup);
        const Reading& offReading = read(row, row.off, off);
        const Reading& onReading = read(row, row.on, on);
        SceneGains gains;
        const auto gainBy = [&](GainMetric metric) {
            return gainOf(offReading.of(metric), onReading.of(metric), floorOf(metric, offReading));
        };
        gains.error = gainBy(row.errorMetric);
        gains.bytes = gainBy(GainMetric::kBytes);
        Json entry = {{"scene", scene_.name},
                      {"is_failure", scene_.isFailure},
                      {"off", offReading.json()},
                      {"on", onReading.json()},
                      {"error_ratio", ratio(gains.error)},
                      {"bytes_ratio", ratio(gains.bytes)}};
        gains.hasTime = table_.repeats > 0 && off.hasAll() && on.hasAll();
        if (gains.hasTime)
            gains.time = measureTimes(row, off, on, entry);
        if (row.metric != GainMetric::kTime)
            gains.own = gainBy(row.metric);
        else
            gains.own = gains.time;
        entry["own_ratio"] = ratio(gains.own);
        return {{"entry", entry}, {"gains", gainsJson(gains)}};
    }

private:
    CellSetup setupOf(const Mechanism& row, const std::string& side) const {
        CellSetup setup = cellSetup({scene_.settings, alwaysOf(row), side});
        setup.frame.width = table_.width;
        setup.frame.height = table_.height;
        if (!scene_.isFailure) {
            setup.resolutionLog2 = table_.resolutionLog2;
            setup.frame.maps.poolBytes = 1ull << 30; // a full pool would make other maps
        }
        return setup;
    }

    /// Equal settings give equal measurements, in whatever row.
    const Reading& read(const Mechanism& row, const std::string& settings, Side& side) {
        const std::string key = kMatrixMethodNames[size_t(row.method)] + (" " + row.always) + " " +
                                settings + (row.isSequence ? " sequence" : "") +
                                (row.asksFlip()                       ? " flip"
                                 : row.metric == GainMetric::kFlicker ? " flicker"
                                                                      : "");
        const auto found = readings_.find(key);
        return found != readings_.end() ? found->second
                                        : readings_.emplace(key, side.read()).first->second;
    }

    /// Runs both sides in turn: `repeats` times if the mechanism should gain time, else once.
    Gain measureTimes(const Mechanism& row, Side& off, Side& on, Json& entry) const {
        std::vector<double> offMs, onMs;
        const int runs = row.metric == GainMetric::kTime ? table_.repeats : 1;
        for (int run = 0; run < runs; ++run) {
            offMs.push_back(off.time());
            onMs.push_back(on.time());
        }
        const Gain gain = gainOfRuns(offMs, onMs);
        entry["off"]["time_ms"] = offMs;
        entry["on"]["time_ms"] = onMs;
        entry["time_ratio"] = ratio(gain);
        entry["time_spread"] = gain.spread;
        return gain;
    }

    const AblationTable& table_;
    AblationScene& scene_;
    std::map<std::string, Reading> readings_;
};

} // namespace

std::string alwaysOf(const Mechanism& row) {
    if (row.isSequence)
        return row.always;
    return "static_optimization=off" + (row.always.empty() ? "" : " " + row.always);
}

Json gainsJson(const SceneGains& gains) {
    const auto json = [](const Gain& gain) { return Json::array({gain.log, gain.spread}); };
    return {{"own", json(gains.own)},
            {"time", gains.hasTime ? json(gains.time) : Json()},
            {"error", json(gains.error)},
            {"bytes", json(gains.bytes)}};
}

SceneGains gainsFromJson(const Json& json) {
    const auto gain = [&](const char* key) {
        return Gain{json[key][0].get<double>(), json[key][1].get<double>()};
    };
    SceneGains gains{gain("own"), {}, gain("error"), gain("bytes"), !json["time"].is_null()};
    if (gains.hasTime)
        gains.time = gain("time");
    return gains;
}

Json measureAblation(const AblationTable& table, const std::string& scene, const Failure* failure,
                     const StudyRequest& request, const Console& console) {
    AblationScene of(table, scene, failure, console);
    AblationMeasurement measurement(table, of);
    Json part = {{"rows", Json::array()}, {"observed", Json()}};
    if (table.repeats > 0 && !failure)
        measurement.warmUp();
    for (const Mechanism& row : table.rows) {
        const bool isAsked = !failure || std::find(row.shownBy.begin(), row.shownBy.end(),
                                                   failure->name) != row.shownBy.end();
        part["rows"].push_back(isAsked ? measurement.measure(row) : Json());
        if (request.progress)
            request.progress(double(part["rows"].size()) / double(table.rows.size() + 1));
    }
    if (table.hasTerms && !failure)
        part["observed"] = toJson(measurement.observe());
    return part;
}

void addJudgement(const MechanismEvidence& evidence, bool isKept, Json& json) {
    const Judgement judgement = judge(evidence, isKept);
    const auto add = [&](const char* name, const Gain& gain, const std::vector<Gain>& scenes) {
        if (scenes.empty())
            return;
        json[name + std::string("_ratio")] = ratio(gain);
        json[name + std::string("_spread")] = gain.spread;
    };
    add("own", judgement.own, evidence.own);
    add("time", judgement.time, evidence.time);
    add("error", judgement.error, evidence.error);
    add("bytes", judgement.bytes, evidence.bytes);
    json["best_gain_on_failures"] = std::exp(judgement.bestOnFailures);
    json["verdict"] = kMechanismVerdictNames[size_t(judgement.verdict)];
    json["reason"] = judgement.reason;
    const Json& isDefault = json.at("is_default");
    const bool wantsOn = judgement.verdict == MechanismVerdict::kOn;
    json["agrees"] = (isDefault.is_null() || isDefault.get<bool>() == wantsOn) &&
                     judgement.verdict != MechanismVerdict::kDelete;
}

std::vector<std::string> disagreements(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& row : results["mechanisms"]) {
        if (row["agrees"].get<bool>())
            continue;
        const Json& isDefault = row["is_default"];
        lines.push_back(row["name"].get<std::string>() + ": " + row["verdict"].get<std::string>() +
                        ", and is " +
                        (isDefault.is_null()     ? "available as an option"
                         : isDefault.get<bool>() ? "on by default"
                                                 : "off by default") +
                        "; " + row["reason"].get<std::string>());
    }
    return lines;
}

} // namespace shadowdag
