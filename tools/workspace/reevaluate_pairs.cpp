// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/reevaluate_pairs.h"

#include "cuda/parallel_for.h"
#include "hybrid/frame/pair_result.h"

namespace shadowdag {

void leaveOut(bool hasMovers, bool hasPlane, PairResults& answers) {
    if (!hasMovers)
        answers.method.rays.movers = {};
    answers.hasPlane = hasPlane;
}

void askAgain(const World& world, PairResults& answers) {
    const PairList& pairs = answers.frame.pairs;
    const size_t sampleCount = pairs.sampleStart.size() - 1;
    std::vector<uint32_t> missing(sampleCount);
    parallelFor<CpuTag>(
        sampleCount,
        [&](size_t sample) {
            VisibilityCounts counts;
            for (uint64_t p = pairs.sampleStart[sample]; p < pairs.sampleStart[sample + 1]; ++p)
                answers.frame.visibility[p] = computePairResultOnHost(
                    answers.method, answers.frame.pairServer[p], pairs.light[p],
                    world.lights()[pairs.light[p]], answers.gbuffer.positionWorld[sample],
                    answers.hasPlane ? answers.gbuffer.normalWorld[sample] : glm::vec3(0.0f),
                    answers.gbuffer.triangle[sample], counts);
            missing[sample] = counts.missingTapCount;
        },
        64);
    answers.missingTapCount = 0;
    for (const uint32_t count : missing)
        answers.missingTapCount += count;
}

} // namespace shadowdag
