// SPDX-License-Identifier: Apache-2.0
// Judges the pairs of a scene's frame, and scores tracers by them.
#include "tools/studies/adjudication.h"
#include "tools/studies/cell_setup.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/judge/adjudicator.h"
#include "hybrid/judge/embree_baseline.h"
#include "scenes/split_mix.h"
#include "tools/workspace/workspace.h"

#include <functional>
#include <iterator>
#include <optional>

namespace shadowdag {

namespace {

constexpr size_t kListedPairCount = 8, kListedDisputeCount = 64;
constexpr const char* kVerdictNames[] = {"lit", "dark", "ambiguous"};
constexpr uint64_t kSeed = 1; ///< of samples of pairs and of placed lights

/// A pair of the frame that is judged.
struct JudgedPair {
    uint64_t pair;
    uint32_t sample, light;
};

/// Returns all pairs, or one of each of `limit` equal parts of their list, drawn by the seed.
std::vector<JudgedPair> samplePairs(const PairList& pairs, uint64_t limit) {
    const uint64_t all = pairs.count(), count = limit == 0 || limit > all ? all : limit;
    std::vector<JudgedPair> sampled;
    uint32_t sample = 0;
    for (uint64_t i = 0; i < count; ++i) {
        const uint64_t begin = uint64_t(double(all) * double(i) / double(count)),
                       end = uint64_t(double(all) * double(i + 1) / double(count));
        const uint64_t within = splitMix64(kSeed + i * kSplitMixGamma) % (end - begin);
        const uint64_t pair = count == all ? i : begin + within;
        while (pairs.sampleStart[sample + 1] <= pair)
            ++sample;
        sampled.push_back({pair, sample, pairs.light[pair]});
    }
    return sampled;
}

/// Answers of a tracer, by judged pair: 1 dark, 0 lit.
using Answers = std::vector<uint8_t>;

/// The pairs of one frame, the adjudicator's rulings on them, and the answers of tracers.
class Trial {
public:
    Trial(const AdjudicationTable& table, const AdjudicationRow& row, const StudyRequest& request,
          const Console& console)
        : table_(table), workspace_(load(table, row, console),
                                    {request.backend, "",
                                     VoxelSource{{}, request.cacheDirectory, false}, &console}) {
        workspace_.setTime(float(row.timeSeconds));
        keepFrame(MatrixMethod::kDagNone, {});
        pairs_ = frame_.pairs;
        judged_ = samplePairs(pairs_, row.pairLimit);
    }

    const Workspace& workspace() const { return workspace_; }
    uint64_t frameCount() const { return pairs_.count(); }
    const std::vector<JudgedPair>& judged() const { return judged_; }
    uint32_t width() const { return gbuffer().width; }

    /// Returns the rulings on pairs of the last frame.
    std::vector<Ruling> rule(const std::vector<JudgedPair>& pairs) {
        if (!adjudicator_)
            adjudicator_.emplace(workspace_.world().triangles());
        std::vector<Ruling> rulings(pairs.size());
        cpuParallelRanges(pairs.size(), 64, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i)
                rulings[i] = adjudicator_->rule(floatPair(pairs[i]), lightOf(pairs[i]));
        });
        return rulings;
    }

    Answers answer(Tracer tracer) {
        switch (tracer) {
        case Tracer::kTruth:
            return ofFrame(
                workspace_.truth().visibility(gbuffer(), workspace_.world().lights(), pairs_));
        case Tracer::kExactPackets:
            return keepFrame(MatrixMethod::kDagNone, "ray_batch=stream");
        case Tracer::kExactSingle:
            return keepFrame(MatrixMethod::kDagNone, "ray_batch=single");
        case Tracer::kEmbreeMethod:
            return keepFrame(MatrixMethod::kDagNone, {}, TriangleRays::kEmbree);
        case Tracer::kEmbree1:
            return byEmbree(EmbreeCall::kOccluded1, false);
        case Tracer::kEmbree16:
            return byEmbree(EmbreeCall::kOccluded16, false);
        case Tracer::kEmbreeRobust1:
            return byEmbree(EmbreeCall::kOccluded1, true);
        case Tracer::kEmbreeRobust16:
            return byEmbree(EmbreeCall::kOccluded16, true);
        case Tracer::kVoxels:
            return keepFrame(MatrixMethod::kDagAll, {});
        case Tracer::kMaps:
            break;
        }
        return keepFrame(MatrixMethod::kMaps, {});
    }

    /// Rules on all pairs of a frame of the study's size in which truth and exact packets differ.
    /// The pairs judged before are of another frame: tracers cannot answer them any more.
    Json disputes() {
        CellSetup setup = cellSetup({table_.settings, "ray_batch=stream"});
        setup.frame.width = table_.disputedWidth;
        setup.frame.height = table_.disputedHeight;
        const std::unique_ptr<CostModel> model = modelOf(MatrixMethod::kDagNone, setup);
        renderer_->reset();
        frame_ = renderer_->render(workspace_.camera(), *model, setup.frame);
        judged_.clear();
        pairs_ = frame_.pairs;
        const std::vector<uint8_t> truth =
            workspace_.truth().visibility(gbuffer(), workspace_.world().lights(), pairs_);
        std::vector<JudgedPair> disputed;
        for (uint32_t sample = 0; sample + 1 < pairs_.sampleStart.size(); ++sample)
            for (uint64_t p = pairs_.sampleStart[sample]; p < pairs_.sampleStart[sample + 1]; ++p)
                if ((truth[p] < kHalfLit) != (frame_.visibility[p] < kHalfLit))
                    disputed.push_back({p, sample, pairs_.light[p]});
        const std::vector<Ruling> rulings = rule(disputed);
        uint64_t ambiguous = 0, truthRight = 0;
        Json listed = Json::array();
        for (size_t i = 0; i < disputed.size(); ++i) {
            const JudgedPair& pair = disputed[i];
            const bool isDarkByTruth = truth[pair.pair] < kHalfLit;
            const Verdict verdict = rulings[i].verdict;
            ambiguous += verdict == Verdict::kAmbiguous;
            truthRight += verdict == (isDarkByTruth ? Verdict::kDark : Verdict::kLit);
            if (listed.size() < kListedDisputeCount)
                listed.push_back({{"x", pair.sample % width()},
                                  {"y", pair.sample / width()},
                                  {"light", pair.light},
                                  {"truth_is_dark", isDarkByTruth},
                                  {"verdict", kVerdictNames[size_t(verdict)]},
                                  {"is_witnessed", rulings[i].isWitnessed}});
        }
        return {{"frame_pair_count", pairs_.count()},
                {"count", disputed.size()},
                {"ambiguous_count", ambiguous},
                {"truth_right_count", truthRight},
                {"exact_right_count", disputed.size() - ambiguous - truthRight},
                {"pairs", listed}};
    }

private:
    static LoadedScene load(const AdjudicationTable& table, const AdjudicationRow& row,
                            const Console& console) {
        LoadedScene scene =
            loadSceneAndWorld(row.scene, -1, kSeed, table.placedLightCount == 0, console);
        if (!scene.world->lights().empty())
            return scene;
        return loadSceneAndWorld(row.scene, int(table.placedLightCount), kSeed, true, console);
    }
    GBufferView gbuffer() const { return renderer_->gbuffer(); }
    const Light& lightOf(const JudgedPair& pair) const {
        return workspace_.world().lights()[pair.light];
    }
    FloatPair floatPair(const JudgedPair& pair) const {
        return {gbuffer().positionWorld[pair.sample], gbuffer().normalWorld[pair.sample],
                gbuffer().triangle[pair.sample]};
    }

    Answers keepFrame(MatrixMethod method, const std::string& settings,
                      TriangleRays by = TriangleRays::kExact) {
        CellSetup setup = cellSetup({table_.settings, settings});
        const std::unique_ptr<CostModel> model = modelOf(method, setup);
        setup.frame.rays.triangleRays = by;
        renderer_ = &workspace_.renderer(setup.resolutionLog2);
        renderer_->reset();
        frame_ = renderer_->render(workspace_.camera(), *model, setup.frame);
        if (!pairs_.light.empty() && frame_.pairs.light != pairs_.light)
            throw Error(ErrorKind::kUsage, "study adjudication: two methods have different pairs; "
                                           "give no setting that changes the view");
        return ofFrame(frame_.visibility);
    }
    Answers ofFrame(const std::vector<uint8_t>& visibility) const {
        Answers answers;
        for (const JudgedPair& pair : judged_)
            answers.push_back(visibility[pair.pair] < kHalfLit);
        return answers;
    }
    /// Embree over the truth's local triangles, along the segments of the truth.
    Answers byEmbree(EmbreeCall call, bool isRobust) {
        const Truth& truth = workspace_.truth();
        TriangleView triangles = workspace_.world().triangles();
        std::vector<glm::vec3> local;
        for (const glm::vec3& p : triangles.positions)
            local.emplace_back(glm::dvec3(p) - truth.originWorld());
        triangles.positions = viewOf(local);
        EmbreeBaselineOptions options;
        options.isRobust = isRobust;
        const EmbreeBaseline embree(triangles, options);
        std::vector<WorldSegment> segments;
        for (const JudgedPair& pair : judged_) {
            const FloatPair asked = floatPair(pair);
            const TruthRay ray = truth.pairRay(asked.sampleWorld, asked.normalWorld, asked.receiver,
                                               pointAtLight(lightOf(pair), asked.sampleWorld));
            segments.push_back({ray.startLocal, ray.startLocal + ray.direction * ray.tFar});
        }
        return embree.occluded(call, segments);
    }

    const AdjudicationTable& table_;
    Workspace workspace_;
    FrameRenderer* renderer_ = nullptr;
    FrameResult frame_;
    PairList pairs_;
    std::vector<JudgedPair> judged_;
    std::optional<Adjudicator> adjudicator_; ///< made at its first ruling
};

Json verdictsOf(const std::string& name, const Trial& trial, const std::vector<Ruling>& rulings) {
    uint64_t counts[3] = {}, witnessed = 0;
    for (const Ruling& ruling : rulings) {
        ++counts[size_t(ruling.verdict)];
        witnessed += ruling.isWitnessed;
    }
    const World& world = trial.workspace().world();
    return {{"scene", name},
            {"geometry_hash", trial.workspace().scene().geometryHash},
            {"triangle_count", world.triangles().count()},
            {"light_count", world.lights().size()},
            {"frame_pair_count", trial.frameCount()},
            {"pair_count", rulings.size()},
            {"lit_count", counts[size_t(Verdict::kLit)]},
            {"dark_count", counts[size_t(Verdict::kDark)]},
            {"ambiguous_count", counts[size_t(Verdict::kAmbiguous)]},
            {"witnessed_count", witnessed}};
}

Json scoreOf(const std::string& name, Tracer tracer, const Trial& trial,
             const std::vector<Ruling>& rulings, const Answers& answers) {
    uint64_t falseShadow = 0, falseLight = 0, ambiguousDark = 0;
    Json listed = Json::array();
    for (size_t i = 0; i < rulings.size(); ++i) {
        const bool isDark = answers[i] != 0;
        if (rulings[i].verdict == Verdict::kAmbiguous) {
            ambiguousDark += isDark;
            continue;
        }
        if (isDark == (rulings[i].verdict == Verdict::kDark))
            continue;
        ++(isDark ? falseShadow : falseLight);
        const JudgedPair& pair = trial.judged()[i];
        if (listed.size() < kListedPairCount)
            listed.push_back({{"x", pair.sample % trial.width()},
                              {"y", pair.sample / trial.width()},
                              {"light", pair.light},
                              {"is_dark", isDark}});
    }
    return {{"scene", name},
            {"tracer", kTracerNames[size_t(tracer)]},
            {"pair_count", rulings.size()},
            {"false_shadow_count", falseShadow},
            {"false_light_count", falseLight},
            {"wrong_count", falseShadow + falseLight},
            {"ambiguous_dark_count", ambiguousDark},
            {"wrong_pairs", listed}};
}

} // namespace

Json measureAdjudication(const AdjudicationTable& table, const AdjudicationRow& row,
                         const StudyRequest& request, const Console& console) {
    Trial trial(table, row, request, console);
    Json results = {
        {"verdicts", Json::array()}, {"cells", Json::array()}, {"skipped", Json::array()}};
    const std::string& hash = trial.workspace().scene().geometryHash;
    if (!row.geometryHash.empty() && hash != row.geometryHash) {
        results["skipped"].push_back({{"scene", row.name},
                                      {"reason", "another file of this name: its geometry is " +
                                                     hash + ", recorded " + row.geometryHash}});
        return results;
    }
    const std::vector<Ruling> rulings = trial.rule(trial.judged());
    Json verdicts = verdictsOf(row.name, trial, rulings);
    constexpr size_t kCount = std::size(kTracerNames);
    for (size_t t = 0; t < kCount; ++t) {
        results["cells"].push_back(
            scoreOf(row.name, Tracer(t), trial, rulings, trial.answer(Tracer(t))));
        if (request.progress)
            request.progress(double(t + 1) / double(kCount + 1));
    }
    verdicts["disputed"] = trial.disputes();
    results["verdicts"].push_back(std::move(verdicts));
    return results;
}

} // namespace shadowdag
