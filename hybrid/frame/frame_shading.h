// SPDX-License-Identifier: Apache-2.0
// The last step of a frame: one pass that shades with rays and lookups, and the results that
// reports need of it.
#pragma once

#include "hybrid/clusters/pairs_pass.h"
#include "hybrid/frame/drawn_maps.h"
#include "hybrid/rays/beams.h"

#include <optional>

namespace shadowdag {

/// Returns what the pairs of a frame may need.
/// @param servesRays,servesMaps whether pairs are served by rays, and by maps
/// @param rays what the frame's rays are traced through; on any backend, as only lengths are read
/// @param taps of the maps' filter; 0: any
PairNeeds needsOf(bool servesRays, bool servesMaps, const std::vector<Light>& lights,
                  const RayInputs& rays, uint32_t taps = 0);

/// Shades the samples of a frame; lists and records its pairs.
class FrameShading {
public:
    explicit FrameShading(const FrameContext& context)
        : context_(context), color_(context.backend, "colour"),
          rayCount_(context.backend, "ray counts"), lookupCount_(context.backend, "lookup counts"),
          provenCount_(context.backend, "proven pair counts"),
          missingTapCount_(context.backend, "missing tap counts"),
          moverTestCount_(context.backend, "mover test counts"),
          exactCount_(context.backend, "exact ray counts"), pairs_(context.backend),
          nextPair_(context.backend, "pair cursor"),
          pairVisibility_(context.backend, "pair visibility"),
          pairServer_(context.backend, "pair servers") {}

    /// Returns the shading of the current frame; counters are cleared, nothing is recorded.
    ShadeSamples prepare(const VisibleSurface& surface, const FrameClusters& clusters,
                         const DrawnMaps& maps, const FrameOptions& options);

    /// Starts the beams of a frame, if its rays keep some; part of its shading. They are made while
    /// the view stands still: making one takes as long as some 40 rays. They are asked then, and
    /// while the view moves as long as they answer most rays.
    void beginBeams(const ViewRays& view, const FrameOptions& options, ShadeSamples& shading);

    /// Shades every sample by all its lights.
    void shade(const ShadeSamples& shading);

    /// Returns the exact pairs of the gathered clusters, and keeps them on the backend.
    PairList findPairs(const VisibleSurface& surface, const FrameClusters& clusters);

    /// Lists the exact pairs and computes them again with recording on; fills pairs, visibility,
    /// pairRoute and the records' pair counts.
    /// @param records of every (cluster, light) pair, ClusterLightsView::record on the host
    void recordPairs(const VisibleSurface& surface, const FrameClusters& clusters,
                     const ShadeSamples& shading, const std::vector<uint32_t>& records,
                     FrameResult& result);

    /// Forgets the beams of earlier frames.
    void forget();
    uint64_t beamBytes() const { return beams_.bytes(); }

    /// Fills in the counts of the shading pass.
    void count(FrameCounts& counts) const;

    /// The output of the last shading: width * height colours, and counts by cluster.
    const Buffer<glm::vec3>& color() const { return color_; }
    const Buffer<uint32_t>& rayCount() const { return rayCount_; }
    const Buffer<uint32_t>& lookupCount() const { return lookupCount_; }
    const Buffer<uint32_t>& provenCount() const { return provenCount_; }
    const Buffer<uint32_t>& missingTapCount() const { return missingTapCount_; }
    const Buffer<uint32_t>& moverTestCount() const { return moverTestCount_; }
    const Buffer<uint32_t>& exactCount() const { return exactCount_; }

private:
    /// Throws std::logic_error unless recording answered every pair once.
    void requireAllAnswered(const PairList& pairs) const;

    FrameContext context_;
    Buffer<glm::vec3> color_;
    Buffer<uint32_t> rayCount_, lookupCount_, provenCount_, missingTapCount_, moverTestCount_,
        exactCount_;
    PairSet pairs_;
    Buffer<uint32_t> nextPair_;
    Buffer<uint8_t> pairVisibility_;
    Buffer<PairServer> pairServer_;
    BeamCache beams_;        ///< of exact rays, from frame to frame
    bool haveBeams_ = false; ///< the frame asks them
    /// Of the last frame whose rays keep beams; none after forget.
    std::optional<ViewRays> lastView_;
};

} // namespace shadowdag
