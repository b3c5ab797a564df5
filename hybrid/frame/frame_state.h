// SPDX-License-Identifier: Apache-2.0
// The state of a FrameRenderer: the parts of a frame, in the order in which frames use them.
// Internal to this folder.
#pragma once

#include "hybrid/frame/frame_shading.h"
#include "hybrid/frame/map_routing.h"

#include <memory>
#include <vector>

namespace shadowdag {

struct FrameState {
    explicit FrameState(std::shared_ptr<FrameScene> scene);
    FrameState(Backend backend, const World& world, const Dag& dag,
               const BatchOptions& batchOptions = {});

    std::shared_ptr<FrameScene> sharedScene; ///< with the renderers of the same world and DAG
    std::unique_ptr<FrameDevice> device;
    FrameContext context; ///< of those two
    VisibleSurface surface;
    FrameClusters clusters;
    MapRouting routing;
    DrawnMaps maps;
    FrameShading shading;

    /// Returns the options as frames apply them. Throws Error kUsage naming the option that is out
    /// of range, contradicts another, or is not supported by the device.
    FrameOptions accept(const FrameOptions& asked) const;
    /// Draws the surface and gathers its clusters with their requests; adds the stages' times.
    void gather(const ViewRays& view, const FrameOptions& options, StageTimes& stages);
    /// Returns the shading of the current frame; counters are cleared, nothing is recorded.
    ShadeSamples prepareShading(const FrameOptions& options) {
        return shading.prepare(surface, clusters, maps, options);
    }
    /// Fills in the counts of a shaded frame.
    /// @param records of every (cluster, light) pair, ClusterLightsView::record on the host
    void count(const std::vector<uint32_t>& records, FrameResult& result);

    /// Implements FrameRenderer::guessLengths.
    void guessLengths(bool isOn, size_t spare = LengthGuess::kSpare);
    /// Implements FrameRenderer::reset.
    void forget();
};

/// Throws Error kUsage naming the option that is out of range or contradicts another.
void checkOptions(const FrameOptions& options);

/// Returns the result of FrameRenderer::measureCosts, before any scaling.
FrameCosts measureFrameCosts(FrameState& state, const ViewRays& view, const FrameOptions& options,
                             int repeats, const std::function<void()>& beforeStage);

/// Multiplies the costs of a frame's maps so that those by one method add up to the frame's time by
/// it; leaves costs unchanged that add up to 0.
void scaleCosts(FrameCosts& costs, double raysMs, double mapsMs);

/// The time of a whole frame by the model `texels` with a threshold.
struct ThresholdTime {
    float texels;
    double timeMs;
};

/// Sets FrameCosts::wholeFrameTexels from the times of whole frames by thresholds, the first of the
/// fastest, and by the cheaper method of each map.
void takeWholeFrame(FrameCosts& costs, const std::vector<ThresholdTime>& thresholds,
                    double cheaperMs);

/// Returns thresholds that route differently, at most six, between the quantiles of these requests
/// in texels; none if all are equal.
std::vector<float> thresholdsBetween(std::vector<float> requests);

/// Scales the costs of a frame's maps to whole frames by one method, and measures whether one
/// method, or a threshold between, serves the whole frame faster than the cheaper method of each
/// map does.
void scaleToFrame(FrameRenderer& renderer, const Camera& camera, const FrameOptions& options,
                  int repeats, FrameCosts& costs, const std::function<void()>& beforeStage);

} // namespace shadowdag
