// SPDX-License-Identifier: Apache-2.0
// The truth of a picture bit by bit, coarse before fine: what a window shows while it rests.
#pragma once

#include "hybrid/judge/truth.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Answers the pairs of one picture in chunks: first every eighth sample in both directions, then
/// the fourth, the second, all; rows by rows. Each pair is asked once.
class TruthRefinement {
public:
    /// Nothing to refine.
    TruthRefinement() = default;
    /// @param gbuffer,lights,pairs of the picture; they outlive this
    TruthRefinement(const GBufferView& gbuffer, const std::vector<Light>& lights,
                    const PairList& pairs);

    bool isDone() const { return next_ == chunks_.size(); }
    /// Returns the share of the samples that are answered, 1 of none.
    double doneShare() const;
    /// Asks the next chunk. @return the samples that it answered
    std::vector<uint32_t> step(const Truth& truth);
    /// Asks all chunks that are left.
    void finish(const Truth& truth);

    /// Returns the answers per pair; 255 where they are not known yet.
    const std::vector<uint8_t>& visibility() const { return visibility_; }
    /// Returns whether a sample's pairs are answered.
    bool isAnswered(uint32_t sample) const { return isAnswered_[sample] != 0; }
    /// Returns the sample whose answers stand for another's until its own are known: the nearest
    /// coarser one of the grid that is answered, or the sample itself.
    uint32_t stand(uint32_t sample) const;

private:
    struct Chunk {
        uint32_t step, y0, y1;
        bool hasCoarser; ///< samples of the grid of twice the step are left out
    };
    GBufferView gbuffer_;
    const std::vector<Light>* lights_ = nullptr;
    const PairList* pairs_ = nullptr;
    std::vector<Chunk> chunks_;
    size_t next_ = 0;
    size_t answeredCount_ = 0;
    std::vector<uint8_t> visibility_;
    std::vector<uint8_t> isAnswered_; ///< by sample
};

} // namespace shadowdag
