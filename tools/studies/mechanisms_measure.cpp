// SPDX-License-Identifier: Apache-2.0
// Both sides of every mechanism on every scene: answers, counts, times in turn. Over 500 lines
// because what is read, how it is timed and what is judged of it share one reading.
#include "tools/studies/mechanisms.h"

#include "cuda/error.h"
#include "hybrid/judge/flicker.h"
#include "tools/settings/console.h"
#include "tools/settings/parse.h"
#include "tools/studies/mechanisms_scene.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/reevaluate_pairs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace shadowdag {

namespace {

/// What one side of a mechanism gave on one scene, over its frames.
struct Reading {
    ErrorCounts errors;
    double flip = 0;    ///< mean
    uint64_t bytes = 0; ///< of the frame with most
    uint64_t triangleCount = 0, texelCount = 0, pageCount = 0, rayCount = 0, lookupCount = 0,
             flickerCount = 0, flickerAnswerCount = 0;

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
        throw std::logic_error("a time is no count");
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
        json["flicker_answer_count"] = flickerAnswerCount;
        return json;
    }
};

/// Returns what is added to values of a metric so that none is 0: one of a count, one wrong pair
/// of a mean error, a thousandth of a FLIP that is visible.
double floorOf(GainMetric metric, const Reading& reading) {
    return metric == GainMetric::kError
               ? 1.0 / double(std::max<uint64_t>(1, reading.errors.pairCount))
           : metric == GainMetric::kFlip ? 1e-5
                                         : 1.0;
}

/// Returns the settings of both sides of a row. What a single frame would keep is of no use to it.
std::string alwaysOf(const Mechanism& row) {
    if (row.isSequence)
        return row.always;
    return "static_optimization=off" + (row.always.empty() ? "" : " " + row.always);
}

/// One side of a mechanism on one scene.
class Side {
public:
    Side(MechanismScene& scene, const Mechanism& row, const CellSetup& setup)
        : scene_(scene), row_(row), setup_(setup), model_(modelOf(row.method, setup_)) {}

    /// Renders and judges all counted frames.
    Reading read() {
        Reading reading;
        FlickerMeter flicker(scene_.truth(), 1, 6000);
        const int first = firstFrame();
        for (int f = first; f < scene_.frameCount(row_.isSequence); ++f) {
            if (f < 0 && row_.metric != GainMetric::kFlicker) {
                render(f, false);
                continue;
            }
            Answers answers = render(f, true);
            answers.gbuffer = renderer().gbuffer();
            answers.method = {renderer().rayInputs(setup_.frame.rays), renderer().shadowMaps(),
                              setup_.frame.bias};
            if (!hasAll()) {
                leaveOut(setup_.hasMovers, setup_.hasPlane, answers);
                askAgain(scene_.world(), answers);
            }
            judge(f, answers, flicker, f >= 0, reading);
        }
        reading.flip /= double(scene_.frameCount(row_.isSequence));
        return reading;
    }

    /// Renders all frames and returns the time of those that count.
    double time() {
        double ms = 0;
        for (int f = firstFrame(); f < scene_.frameCount(row_.isSequence); ++f) {
            const double frameMs = render(f, false).frame.stages.totalMs();
            if (f >= 0)
                ms += frameMs;
        }
        return ms;
    }

    /// Returns whether frames are rendered as the setup says: nothing is left out afterwards.
    bool hasAll() const { return setup_.hasPlane && setup_.hasMovers; }

private:
    /// Sequences are led in by a frame that does not count.
    int firstFrame() const { return row_.isSequence ? -1 : 0; }
    FrameRenderer& renderer() { return scene_.renderer(setup_.resolutionLog2); }

    Answers render(int frame, bool recordPairs) {
        checkInterrupted();
        scene_.show(frame);
        FrameRenderer& own = renderer();
        if (frame == firstFrame() || !row_.isSequence || !setup_.keepsFrames)
            own.reset();
        FrameOptions options = setup_.frame;
        options.recordPairs = recordPairs;
        Answers answers;
        answers.frame = own.render(scene_.camera(), *model_, options);
        return answers;
    }

    void judge(int frame, const Answers& answers, FlickerMeter& flicker, bool isCounted,
               Reading& reading) {
        scene_.truth(); // as it is now: the flicker meter asks it as well
        const FrameResult& result = answers.frame;
        const ErrorInputs inputs{answers.gbuffer,
                                 scene_.world().triangles(),
                                 viewOf(scene_.world().lights()),
                                 result.pairs,
                                 result.visibility,
                                 result.pairRoute,
                                 result.pairServer,
                                 answers.method};
        if (row_.metric == GainMetric::kFlicker)
            addFlicker(flicker.add({inputs, scene_.camera()}), reading);
        if (!isCounted)
            return;
        const MechanismTruth& truth = scene_.truthOf(frame, answers.gbuffer, result.pairs);
        const JudgedAnswers& judged = judgedAs(frame, answers, inputs, truth);
        reading.errors.add(judged.errors);
        reading.flip += judged.flip;
        const FrameCounts& counts = result.counts;
        const bool usesRays = counts.rayCount > 0 || counts.provenPairCount > 0;
        reading.bytes =
            std::max(reading.bytes,
                     counts.maps.mapBytes + (usesRays ? renderer().dagBytes() : 0) +
                         (setup_.frame.rays.kind == RayKind::kExact ? renderer().exactBytes() : 0));
        reading.triangleCount += counts.maps.triangleDrawCount;
        reading.texelCount += counts.maps.texelCount;
        reading.pageCount += counts.maps.pageCount;
        reading.rayCount += counts.rayCount;
        reading.lookupCount += counts.lookupCount;
    }

    /// Judges answers, or returns what equal answers of the frame were judged as: the same
    /// visibility of every pair by the same method, at the same resolutions of maps and rays.
    const JudgedAnswers& judgedAs(int frame, const Answers& answers, const ErrorInputs& inputs,
                                  const MechanismTruth& truth) {
        const FrameResult& result = answers.frame;
        JudgedAnswers judged{frame,
                             row_.asksFlip(),
                             setup_.hasPlane,
                             setup_.hasMovers,
                             uint32_t(setup_.resolutionLog2),
                             setup_.frame.rays.offset,
                             setup_.frame.bias.constantTexels,
                             setup_.frame.rays.kind,
                             result.visibility,
                             result.pairRoute,
                             {},
                             {},
                             0};
        for (const MapRecord& map : result.maps)
            judged.faceTexels.push_back(map.quantities.faceTexels);
        for (const JudgedAnswers& known : scene_.judged())
            if (known.isOf(judged))
                return known;
        ErrorOptions options;
        options.nullSampleCount = 0;
        options.rays = setup_.frame.rays;
        options.bias = answers.method.bias;
        judged.errors = computeError(inputs, scene_.truth(), truth.visibility, options).total;
        if (judged.hasFlip) {
            const std::vector<glm::vec3> color =
                hasAll()
                    ? result.color
                    : shadePairs(answers.gbuffer, scene_.world(), result.pairs, result.visibility);
            judged.flip = computeFlip(truth.display, toneMap(color, truth.exposure),
                                      setup_.frame.width, setup_.frame.height);
        }
        scene_.judged().push_back(std::move(judged));
        return scene_.judged().back();
    }

    static void addFlicker(const FlickerCounts& counts, Reading& reading) {
        reading.flickerCount += counts.total().flickerCount;
        reading.flickerAnswerCount += counts.total().answerCount;
    }

    MechanismScene& scene_;
    const Mechanism& row_;
    CellSetup setup_;
    std::unique_ptr<CostModel> model_;
};

double ratio(const Gain& gain) {
    return std::exp(-gain.log);
}

/// What a mechanism gave on a scene.
struct SceneGains {
    Gain own, time, error, bytes;
    bool hasTime = false;
};

/// Measures one mechanism on one scene and adds that to its row.
class MechanismMeasurement {
public:
    MechanismMeasurement(const MechanismsRequest& request, MechanismScene& scene,
                         std::map<std::string, Reading>& readings)
        : request_(request), scene_(scene), readings_(readings) {}

    /// Renders a frame by maps of the largest pages, so that no mechanism is charged for memory
    /// that grows.
    void warmUp() {
        static const Mechanism row{"warm-up", "", MatrixMethod::kMaps, GainMetric::kTime,
                                   "",        "", "page_size=256"};
        Side(scene_, row, setupOf(row, row.on)).time();
    }

    SceneGains measure(const Mechanism& row, Json& json) {
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
        Json entry = {{"scene", scene_.name()},
                      {"is_failure", scene_.isFailure()},
                      {"off", offReading.json()},
                      {"on", onReading.json()},
                      {"error_ratio", ratio(gains.error)},
                      {"bytes_ratio", ratio(gains.bytes)}};
        gains.hasTime = request_.repeats > 0 && off.hasAll() && on.hasAll();
        if (gains.hasTime)
            gains.time = measureTimes(row, off, on, entry);
        if (row.metric != GainMetric::kTime)
            gains.own = gainBy(row.metric);
        else
            gains.own = gains.time;
        entry["own_ratio"] = ratio(gains.own);
        json["scenes"].push_back(std::move(entry));
        return gains;
    }

private:
    CellSetup setupOf(const Mechanism& row, const std::string& side) const {
        CellSetup setup = cellSetup({scene_.settings(), alwaysOf(row), side});
        setup.frame.width = request_.width;
        setup.frame.height = request_.height;
        if (!scene_.isFailure()) {
            setup.resolutionLog2 = request_.resolutionLog2;
            setup.frame.maps.poolBytes = 1ull << 30; // a full pool would make other maps
        }
        return setup;
    }

    /// Equal settings give equal readings, whatever row asks.
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

    /// Runs both sides in turn: what should pay in time `repeats` times, else once.
    Gain measureTimes(const Mechanism& row, Side& off, Side& on, Json& entry) const {
        std::vector<double> offMs, onMs;
        const int runs = row.metric == GainMetric::kTime ? request_.repeats : 1;
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

    const MechanismsRequest& request_;
    MechanismScene& scene_;
    std::map<std::string, Reading>& readings_;
};

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
            {"is_default", row.isDefault ? Json(row.isDefault(FrameOptions{})) : Json()},
            {"kept_for", row.keptFor},
            {"source", row.source},
            {"is_sequence", row.isSequence},
            {"scenes", Json::array()}};
}

/// Gathers what is measured scene by scene into a judgement by row.
struct RowResult {
    const Mechanism* row;
    Json json;
    MechanismEvidence evidence;

    void add(const SceneGains& gains, bool isFailure) {
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
};

const Failure& failureOf(const std::string& name) {
    const auto found = std::find_if(failures().begin(), failures().end(),
                                    [&](const Failure& f) { return f.name == name; });
    SDAG_ASSERT(found != failures().end());
    return *found;
}

} // namespace

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

void refuseUnknownMechanisms(const std::vector<std::string>& names) {
    const std::vector<std::string> terms = costTermNames();
    std::string known;
    for (const Mechanism& row : mechanisms())
        known += (known.empty() ? "" : ", ") + row.name;
    for (const std::string& name : names)
        if (std::none_of(mechanisms().begin(), mechanisms().end(),
                         [&](const Mechanism& row) { return row.name == name; }) &&
            std::find(terms.begin(), terms.end(), name) == terms.end())
            throw Error(ErrorKind::kUsage, "--only '" + name + "': must be one of " + known +
                                               ", or a term of the cost model, " + terms.front() +
                                               " to " + terms.back());
}

Json compareMechanisms(const MechanismsRequest& request) {
    refuseUnknownMechanisms(request.names);
    const std::vector<std::string> terms = costTermNames();
    const auto isAsked = [&](const std::string& name) {
        return request.names.empty() ||
               std::find(request.names.begin(), request.names.end(), name) != request.names.end();
    };
    std::vector<RowResult> rows;
    for (const Mechanism& row : mechanisms())
        if (isAsked(row.name)) {
            if (row.metric == GainMetric::kTime && request.repeats == 0)
                throw Error(ErrorKind::kUsage, "mechanism '" + row.name +
                                                   "' should pay in time, and none is taken; ask "
                                                   "for 1 run or more, or for others");
            rows.push_back({&row, rowJson(row), {}});
        }
    const bool hasTerms = request.hasTerms && std::any_of(terms.begin(), terms.end(), isAsked);

    std::vector<ObservedFrame> observed;
    std::vector<std::string> shownBy;
    for (const RowResult& row : rows)
        for (const std::string& name : row.row->shownBy)
            if (std::find(shownBy.begin(), shownBy.end(), name) == shownBy.end())
                shownBy.push_back(name);
    size_t done = 0;
    const size_t stepCount =
        request.scenes.size() * (rows.size() + (hasTerms ? 4 : 0)) + shownBy.size();
    const auto step = [&](size_t count) {
        done += count;
        if (request.progress)
            request.progress(double(done) / double(stepCount));
    };

    for (const std::string& name : request.scenes) {
        MechanismScene scene(name, request);
        std::map<std::string, Reading> readings;
        if (request.repeats > 0)
            MechanismMeasurement(request, scene, readings).warmUp();
        for (RowResult& row : rows) {
            row.add(MechanismMeasurement(request, scene, readings).measure(*row.row, row.json),
                    false);
            step(1);
        }
        if (hasTerms) {
            for (int f = 0; f < 2; ++f)
                observed.push_back(scene.observe(f));
            step(4);
        }
    }
    for (const std::string& name : shownBy) {
        MechanismScene scene(failureOf(name), request);
        std::map<std::string, Reading> readings;
        for (RowResult& row : rows)
            if (std::find(row.row->shownBy.begin(), row.row->shownBy.end(), name) !=
                row.row->shownBy.end())
                row.add(MechanismMeasurement(request, scene, readings).measure(*row.row, row.json),
                        true);
        step(1);
    }

    Json results = {{"scenes", request.scenes},
                    {"size", std::to_string(request.width) + "x" + std::to_string(request.height)},
                    {"resolution", 1u << request.resolutionLog2},
                    {"sequence_frame_count", request.sequenceFrames},
                    {"repeat_count", request.repeats},
                    {"mechanisms", Json::array()}};
    for (RowResult& row : rows) {
        addJudgement(row.evidence, !row.row->keptFor.empty(), row.json);
        results["mechanisms"].push_back(std::move(row.json));
    }
    if (hasTerms)
        for (Json& row : judgeCostTerms(observed, request.names))
            results["mechanisms"].push_back(std::move(row));
    return results;
}

std::vector<std::string> disagreements(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& row : results["mechanisms"]) {
        if (row["agrees"].get<bool>())
            continue;
        const Json& isDefault = row["is_default"];
        lines.push_back(row["name"].get<std::string>() + ": " + row["verdict"].get<std::string>() +
                        ", and is " +
                        (isDefault.is_null()     ? "there to be asked for"
                         : isDefault.get<bool>() ? "on by default"
                                                 : "off by default") +
                        "; " + row["reason"].get<std::string>());
    }
    return lines;
}

} // namespace shadowdag
