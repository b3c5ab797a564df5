// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_truth.h"

#include <algorithm>

namespace shadowdag {

namespace {

/// The coarsest grid's step.
constexpr uint32_t kCoarsest = 8;
/// Pairs per chunk, on average over the picture: some 10 ms of Embree's work on two cores.
constexpr double kPairsPerChunk = 200e3;

} // namespace

TruthRefinement::TruthRefinement(const GBufferView& gbuffer, const std::vector<Light>& lights,
                                 const PairList& pairs)
    : gbuffer_(gbuffer), lights_(&lights), pairs_(&pairs), visibility_(pairs.count(), kLit),
      isDone_(gbuffer.count(), 0) {
    const double pairsPerRow =
        double(pairs.count()) / double(std::max(gbuffer.height, 1u)) + 1.0; // of all samples
    for (uint32_t step = kCoarsest; step > 0; step /= 2) {
        const double rows = kPairsPerChunk * double(step) / pairsPerRow;
        const uint32_t most = std::max(gbuffer.height, 1u);
        const uint32_t height = step * uint32_t(std::clamp(rows, 1.0, double(most)));
        for (uint32_t y = 0; y < gbuffer.height; y += height)
            chunks_.push_back({step, y, std::min(y + height, gbuffer.height), step < kCoarsest});
    }
}

double TruthRefinement::doneShare() const {
    return isDone_.empty() ? 1.0 : double(doneCount_) / double(isDone_.size());
}

std::vector<uint32_t> TruthRefinement::step(const Truth& truth) {
    const Chunk chunk = chunks_[next_++];
    std::vector<uint32_t> samples;
    for (uint32_t y = chunk.y0; y < chunk.y1; y += chunk.step)
        for (uint32_t x = 0; x < gbuffer_.width; x += chunk.step)
            if (!chunk.hasCoarser || x % (2 * chunk.step) != 0 || y % (2 * chunk.step) != 0)
                samples.push_back(y * gbuffer_.width + x);
    // The pairs of these samples, in a list over all samples, which is the truth's input.
    PairList asked;
    asked.sampleStart.assign(gbuffer_.count() + 1, 0);
    for (const uint32_t s : samples) {
        const uint64_t begin = pairs_->sampleStart[s], end = pairs_->sampleStart[s + 1];
        asked.sampleStart[s + 1] = end - begin;
        asked.light.insert(asked.light.end(), pairs_->light.begin() + ptrdiff_t(begin),
                           pairs_->light.begin() + ptrdiff_t(end));
    }
    for (size_t s = 0; s < gbuffer_.count(); ++s)
        asked.sampleStart[s + 1] += asked.sampleStart[s];
    const std::vector<uint8_t> answers = truth.visibility(gbuffer_, *lights_, asked);
    uint64_t next = 0;
    for (const uint32_t s : samples) {
        for (uint64_t p = pairs_->sampleStart[s]; p < pairs_->sampleStart[s + 1]; ++p)
            visibility_[p] = answers[next++];
        isDone_[s] = 1;
    }
    doneCount_ += samples.size();
    return samples;
}

void TruthRefinement::finish(const Truth& truth) {
    if (next_ == 0) { // at once, in the coherent order of rays
        visibility_ = truth.visibility(gbuffer_, *lights_, *pairs_);
        std::fill(isDone_.begin(), isDone_.end(), uint8_t(1));
        doneCount_ = isDone_.size();
        next_ = chunks_.size();
    }
    while (!isDone())
        step(truth);
}

uint32_t TruthRefinement::stand(uint32_t sample) const {
    const uint32_t x = sample % gbuffer_.width, y = sample / gbuffer_.width;
    for (uint32_t step = 1; step <= kCoarsest; step *= 2) {
        const uint32_t coarse = (y - y % step) * gbuffer_.width + (x - x % step);
        if (isDone_[coarse])
            return coarse;
    }
    return sample;
}

} // namespace shadowdag
