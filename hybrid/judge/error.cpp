// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/error.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/judge/explain.h"

#include <algorithm>
#include <array>
#include <string>

namespace shadowdag {
namespace {

/// A pair with its sample.
struct Case {
    uint64_t pair;
    uint32_t sample;
};

bool isDark(uint8_t visibility) {
    return visibility < kHalfLit;
}

/// Returns `count` seeded right pairs that `isWanted`, with replacement, uniform over these; fewer
/// if there are almost none. @param mostTries of each counted pair
template <class IsWanted>
std::vector<Case> sampleRightPairs(const ErrorInputs& inputs,
                                   const std::vector<uint8_t>& truthVisibility, uint64_t seed,
                                   uint32_t count, uint32_t mostTries, const IsWanted& isWanted) {
    const PairList& pairs = inputs.pairs;
    std::vector<Case> right;
    uint64_t state = seed ^ 0x6e756c6c72617465ull;
    for (uint64_t tries = 0;
         pairs.count() != 0 && right.size() < count && tries < uint64_t(mostTries) * count;
         ++tries) {
        state = state * 6364136223846793005ull +
                1442695040888963407ull; // Knuth's MMIX generator; high bits are used
        const uint64_t pair = uint64_t((unsigned __int128)(state)*pairs.count() >> 64);
        if (isDark(inputs.visibility[pair]) != isDark(truthVisibility[pair]))
            continue;
        const Case found = {pair, sampleOfPair(pairs, pair)};
        if (isWanted(found))
            right.push_back(found);
    }
    return right;
}

/// Returns how the test answers the reverse of right pairs.
std::vector<PairJudge::Flips> flipsOf(const PairJudge& judge, const ErrorInputs& inputs,
                                      const std::vector<Case>& right) {
    std::vector<PairJudge::Flips> flips(right.size());
    cpuParallelRanges(right.size(), 64, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            flips[i] = judge.flips(right[i].sample, right[i].pair,
                                   isDark(inputs.visibility[right[i].pair]));
    });
    return flips;
}

double shareOf(uint64_t count, uint64_t of) {
    return of > 0 ? double(count) / double(of) : 0.0;
}

/// Counts by ServedBy.
using ServerCounts = std::array<uint64_t, 3>;

size_t serverOf(const ErrorInputs& inputs, const Case& c) {
    return size_t(inputs.pairServer[c.pair].by());
}

/// Sets outlineNullRate and outlineNullSampleCount. Of a hybrid, pairs by exact rays have hardly an
/// error and hardly one that could be explained: the rate is that of the servers of wrong pairs, in
/// the wrong pairs' proportions.
void takeOutlineNullRate(const ErrorInputs& inputs, const std::vector<uint8_t>& truthVisibility,
                         const ErrorOptions& options, const PairJudge& judge,
                         const std::vector<Case>& wrong, ErrorReport& report) {
    ServerCounts weight{}, sampleCount{}, flipCount{};
    for (const Case& c : wrong)
        ++weight[serverOf(inputs, c)];
    if (wrong.empty())
        weight.fill(1);
    constexpr uint32_t kTriesNearOutlines = 64; // they are a few in a hundred
    const std::vector<Case> near = sampleRightPairs(
        inputs, truthVisibility, options.seed + 1, options.nullSampleCount / 4, kTriesNearOutlines,
        [&](const Case& c) {
            return weight[serverOf(inputs, c)] > 0 &&
                   isNearOutline(inputs.gbuffer, inputs.pairs, truthVisibility, c.sample, c.pair);
        });
    const std::vector<PairJudge::Flips> flips = flipsOf(judge, inputs, near);
    for (size_t i = 0; i < near.size(); ++i) {
        const size_t server = wrong.empty() ? 0 : serverOf(inputs, near[i]);
        sampleCount[server] += !flips[i].isMagnified;
        flipCount[server] += flips[i].byShifts;
    }
    double rate = 0, whole = 0;
    for (size_t server = 0; server < weight.size(); ++server)
        if (sampleCount[server] > 0) {
            rate += double(weight[server]) * shareOf(flipCount[server], sampleCount[server]);
            whole += double(weight[server]);
            report.outlineNullSampleCount += sampleCount[server];
        }
    report.outlineNullRate = whole > 0 ? rate / whole : 0.0;
}

void checkSizes(const ErrorInputs& inputs, const std::vector<uint8_t>& truthVisibility) {
    const size_t count = inputs.pairs.count();
    for (const size_t size : {inputs.visibility.size(), inputs.pairRoute.size(),
                              inputs.pairServer.size(), truthVisibility.size()})
        if (size != count)
            throw Error(ErrorKind::kUsage, "the error of " + std::to_string(count) +
                                               " pairs needs one visibility per pair, got " +
                                               std::to_string(size) + "; render with recordPairs");
}

} // namespace

void ErrorCounts::add(const ErrorCounts& other) {
    pairCount += other.pairCount;
    occludedCount += other.occludedCount;
    falseShadowCount += other.falseShadowCount;
    falseLightCount += other.falseLightCount;
    unexplainedFalseShadowCount += other.unexplainedFalseShadowCount;
    unexplainedFalseLightCount += other.unexplainedFalseLightCount;
    settledFalseShadowCount += other.settledFalseShadowCount;
    settledFalseLightCount += other.settledFalseLightCount;
    tapSettledCount += other.tapSettledCount;
    acneCount += other.acneCount;
    contactCount += other.contactCount;
    magnifiedCount += other.magnifiedCount;
    absVisibilityErrorSum += other.absVisibilityErrorSum;
}

std::vector<float> askedTexels(const std::vector<MapRecord>& maps, uint32_t maxFaceTexels) {
    std::vector<float> asked;
    for (const MapRecord& map : maps)
        if (map.route == Route::kMap)
            asked.push_back(map.window.isDirectional()
                                ? 0.0f
                                : std::min(map.quantities.texels, float(maxFaceTexels)));
    return asked;
}

bool isNearOutline(const GBufferView& gbuffer, const PairList& pairs,
                   const std::vector<uint8_t>& truthVisibility, uint32_t sample, uint64_t pair) {
    const int x = int(sample % gbuffer.width), y = int(sample / gbuffer.width);
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
            if (x + dx < 0 || x + dx >= int(gbuffer.width) || y + dy < 0 ||
                y + dy >= int(gbuffer.height))
                continue;
            const uint32_t beside = uint32_t(y + dy) * gbuffer.width + uint32_t(x + dx);
            const uint64_t other = pairOf(pairs, beside, pairs.light[pair]);
            if (other != pairs.count() &&
                isDark(truthVisibility[other]) != isDark(truthVisibility[pair]))
                return true;
        }
    return false;
}

uint64_t ErrorReport::explainedCount() const {
    return total.falseShadowCount + total.falseLightCount - total.unexplainedFalseShadowCount -
           total.unexplainedFalseLightCount - total.acneCount - total.contactCount -
           total.magnifiedCount;
}

bool ErrorReport::explainingHasPower() const {
    const uint64_t wrong = total.falseShadowCount + total.falseLightCount;
    return wrong == 0 || outlineNullSampleCount == 0 ||
           (outlineNullRate <= 0.5 && double(explainedCount()) > outlineNullRate * double(wrong));
}

ErrorReport computeError(const ErrorInputs& inputs, const Truth& truth,
                         const std::vector<uint8_t>& truthVisibility, const ErrorOptions& options) {
    checkSizes(inputs, truthVisibility);
    const PairList& pairs = inputs.pairs;
    ErrorReport report;
    report.perLight.resize(inputs.lights.count);
    report.verdicts.assign(pairs.count(), PairVerdict::kRight);

    std::vector<Case> wrong;
    std::vector<uint64_t> absError(inputs.lights.count); // in 255ths: exact, whatever the order
    for (size_t s = 0; s + 1 < pairs.sampleStart.size(); ++s)
        for (uint64_t p = pairs.sampleStart[s]; p < pairs.sampleStart[s + 1]; ++p) {
            ErrorCounts& counts = report.perLight[pairs.light[p]];
            const uint8_t method = inputs.visibility[p], right = truthVisibility[p];
            ++counts.pairCount;
            ++report.visibilityHistogram[method];
            counts.occludedCount += isDark(right);
            absError[pairs.light[p]] += method > right ? method - right : right - method;
            if (isDark(method) == isDark(right))
                continue;
            ++(isDark(method) ? counts.falseShadowCount : counts.falseLightCount);
            wrong.push_back({p, uint32_t(s)});
        }

    const PairJudge judge(inputs, truth, options.seed);
    std::vector<PairJudge::Promises> promises(wrong.size());
    cpuParallelRanges(wrong.size(), 64, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            report.verdicts[wrong[i].pair] =
                judge.judge(wrong[i].sample, wrong[i].pair,
                            isDark(inputs.visibility[wrong[i].pair]), &promises[i]);
    });
    for (size_t i = 0; i < wrong.size(); ++i) {
        const Case& c = wrong[i];
        ErrorCounts& counts = report.perLight[pairs.light[c.pair]];
        const PairVerdict verdict = report.verdicts[c.pair];
        report.beyondBeliefCount += promises[i].isBeyondBelief;
        report.coarserCellCount += promises[i].isCoarserCell;
        if (promises[i].isExact || (inputs.pairServer[c.pair].by() == ServedBy::kProof &&
                                    verdict != PairVerdict::kContact))
            report.exactWrongPairs.push_back(c.pair);
        counts.acneCount += verdict == PairVerdict::kAcne;
        counts.contactCount += verdict == PairVerdict::kContact;
        counts.magnifiedCount += verdict == PairVerdict::kMagnified;
        counts.tapSettledCount += verdict == PairVerdict::kTapSettled;
        const bool isSettled =
            verdict == PairVerdict::kSettled || verdict == PairVerdict::kTapSettled;
        if (isSettled)
            ++(isDark(inputs.visibility[c.pair]) ? counts.settledFalseShadowCount
                                                 : counts.settledFalseLightCount);
        if (isSettled || verdict == PairVerdict::kUnexplained)
            ++(isDark(inputs.visibility[c.pair]) ? counts.unexplainedFalseShadowCount
                                                 : counts.unexplainedFalseLightCount);
    }
    for (size_t l = 0; l < report.perLight.size(); ++l) {
        report.perLight[l].absVisibilityErrorSum = double(absError[l]) / double(kLit);
        report.total.add(report.perLight[l]);
    }

    const std::vector<Case> right =
        sampleRightPairs(inputs, truthVisibility, options.seed, options.nullSampleCount, 4,
                         [](const Case&) { return true; });
    uint64_t shiftCount = 0, tapCount = 0, tapOnlyCount = 0;
    for (const PairJudge::Flips& of : flipsOf(judge, inputs, right)) {
        report.nullSampleCount += !of.isMagnified;
        shiftCount += of.byShifts;
        report.tapNullSampleCount += of.hasTaps;
        tapCount += of.byTaps;
        tapOnlyCount += of.byTaps && !of.byShifts;
    }
    report.nullRate = shareOf(shiftCount, report.nullSampleCount);
    report.tapNullRate = shareOf(tapCount, report.tapNullSampleCount);
    report.tapOnlyNullRate = shareOf(tapOnlyCount, report.tapNullSampleCount);

    takeOutlineNullRate(inputs, truthVisibility, options, judge, wrong, report);
    return report;
}

ErrorReport computeError(const FrameRenderer& renderer, const FrameResult& frame,
                         const World& world, const Truth& truth,
                         const std::vector<uint8_t>& truthVisibility, const ErrorOptions& options) {
    const RayInputs rays = renderer.rayInputs(options.rays);
    const ErrorInputs inputs{renderer.gbuffer(),
                             world.triangles(),
                             viewOf(world.lights()),
                             frame.pairs,
                             frame.visibility,
                             frame.pairRoute,
                             frame.pairServer,
                             {rays, renderer.shadowMaps(), options.bias},
                             askedTexels(frame.maps, options.maxFaceTexels)};
    return computeError(inputs, truth, truthVisibility, options);
}

} // namespace shadowdag
