// SPDX-License-Identifier: Apache-2.0
// Embree's shadow-ray rates over a list of segments, by each of its interfaces: the baseline of our
// tracers. Not the truth: no filter, no offsets, and by default not robust, because that is
// Embree's fastest mode.
#pragma once

#include "cuda/quantile_interval.h"
#include "hybrid/rays/embree_scene.h"

#include <memory>
#include <span>
#include <vector>

namespace shadowdag {

/// A segment in world space; ends are used as they are.
struct WorldSegment {
    glm::vec3 from;
    glm::vec3 to;
};

/// Embree's interfaces for occlusion.
enum class EmbreeCall {
    kOccluded1,  ///< rtcOccluded1
    kOccluded8,  ///< rtcOccluded8
    kOccluded16, ///< rtcOccluded16
    kStream,     ///< rtcOccluded1M, kEmbreeStreamLength rays a call
};
/// Returns those that this Embree has; Embree 4 has no streams.
std::span<const EmbreeCall> embreeCalls();
constexpr size_t kEmbreeStreamLength = 4096;

/// Returns the name of the interface as Embree spells it.
const char* embreeCallName(EmbreeCall call);

struct EmbreeBaselineOptions {
    bool isRobust = false;  ///< as the next but one, EmbreeSceneOptions
    bool isCoherent = true; ///< neighbours in the list are similar
    bool useHighQuality = true;
};

/// The result of one interface.
struct EmbreeRate {
    EmbreeCall call;
    /// Of processor time, one thread: the median over repeats with its interval; 0 of no segments.
    QuantileInterval megaraysPerSecond;
    uint64_t occludedCount = 0;
    uint64_t disagreementCount =
        0; ///< segments with another result than rtcOccluded1 (edges, unless robust)
};

/// Embree over a set of triangles, with the best instruction set of the machine. Triangles are
/// copied.
class EmbreeBaseline {
public:
    /// Throws Error kInput when a coordinate is beyond 1e18, kResource when Embree cannot build.
    explicit EmbreeBaseline(const TriangleView& triangles,
                            const EmbreeBaselineOptions& options = {});
    ~EmbreeBaseline();

    /// Returns 1 (blocked) or 0 per segment, on the calling thread.
    /// @param call one of embreeCalls()
    /// @param seconds receives the processor time of the tracing, without packing segments into
    /// rays and reading results; may be null
    std::vector<uint8_t> occluded(EmbreeCall call, const std::vector<WorldSegment>& segments,
                                  double* seconds = nullptr) const;

    /// Returns the rate of every interface on the calling thread: one warm-up, then `repeats`
    /// interleaved runs, timed as by occluded(). Of fewer than six the interval of a rate holds
    /// less than 95 %, as its confidence says.
    std::vector<EmbreeRate> measure(const std::vector<WorldSegment>& segments,
                                    int repeats = 10) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
