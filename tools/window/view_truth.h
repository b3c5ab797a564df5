// SPDX-License-Identifier: Apache-2.0
// Computes the truth of a picture in steps, coarse before fine, while the window rests.
#pragma once

#include "hybrid/judge/truth.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Computes the pairs of one picture in chunks: first every eighth sample in both directions, then
/// the fourth, the second, all; row by row. Each pair is computed once.
class TruthRefinement {
public:
    /// Nothing to refine.
    TruthRefinement() = default;
    /// @param gbuffer,lights,pairs of the picture; they outlive this
    TruthRefinement(const GBufferView& gbuffer, const std::vector<Light>& lights,
                    const PairList& pairs);

    bool isDone() const { return next_ == chunks_.size(); }
    /// Returns the share of the samples that are done, 1 if there are none.
    double doneShare() const;
    /// Computes the next chunk. @return its samples
    std::vector<uint32_t> step(const Truth& truth);
    /// Computes all remaining chunks.
    void finish(const Truth& truth);

    /// Returns the results per pair; 255 where they are not known yet.
    const std::vector<uint8_t>& visibility() const { return visibility_; }
    /// Returns whether a sample's pairs are done.
    bool isAnswered(uint32_t sample) const { return isDone_[sample] != 0; }
    /// Returns the sample that represents another until its own results are known: the nearest
    /// coarser one of the grid that is done, or the sample itself.
    uint32_t stand(uint32_t sample) const;

private:
    struct Chunk {
        uint32_t step, y0, y1;
        bool hasCoarser; ///< samples of the grid of twice the step are skipped
    };
    GBufferView gbuffer_;
    const std::vector<Light>* lights_ = nullptr;
    const PairList* pairs_ = nullptr;
    std::vector<Chunk> chunks_;
    size_t next_ = 0;
    size_t doneCount_ = 0;
    std::vector<uint8_t> visibility_;
    std::vector<uint8_t> isDone_; ///< by sample
};

} // namespace shadowdag
