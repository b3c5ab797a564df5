// SPDX-License-Identifier: Apache-2.0
// Which method serves which shadow map: the interface, what a map is known by, and the table of
// models.
#pragma once

#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// How the samples of a shadow map get their answers.
enum class Route : uint8_t { kRays = 0, kMap = 1 };

/// Who served a map in the frame before: nobody (it was not asked for, or the renderer was reset),
/// rays, or a map.
enum class PreviousRoute : uint8_t { kNone = 0, kRays = 1, kMap = 2 };

/// The quantities of a map that take time to count, as bits.
enum Counts : uint32_t {
    kCountsNothing = 0,
    kCountsPages = 1,     ///< MapQuantities::pages
    kCountsTriangles = 2, ///< triangles, batches
    kCountsPairs = 4,     ///< pairs
    kCountsMovers = 8,    ///< movers, moverCrossings
    kCountsAll = 15
};
/// Their names, by bit.
constexpr const char* kCountNames[] = {"pages", "triangles", "pairs", "movers"};
constexpr size_t kCountNameCount = std::size(kCountNames);
static_assert(kCountsAll == (1u << kCountNameCount) - 1);

/// What is known about a shadow map before it is served. All counts are integers of this frame.
struct MapQuantities {
    uint32_t light = 0;
    uint32_t octave = 0; ///< of this map among the light's: floor(log2) of what its clusters ask
                         ///< for, lower ones with the lowest; 0 with one map a light
    float texels = 0;    ///< requested face resolution R, after undersampling, before any rounding
    uint32_t faceTexels = 0; ///< allocated face resolution
    uint32_t pages = 0;      ///< pages its receivers touch at faceTexels
    uint64_t samples = 0;    ///< samples of its clusters (an upper bound of its pairs)
    uint32_t clusters = 0;   ///< (cluster, light) pairs
    uint64_t triangles = 0;  ///< triangles of batches in the light's sphere
    uint32_t batches = 0;    ///< batches in the light's sphere
    uint32_t lights = 0;     ///< lights of the frame with at least one cluster
    float range = 0;         ///< metres
    uint64_t pairs = 0;      ///< its exact pairs, estimated from one sample in kPairStride
    uint32_t movers = 0;     ///< moving batches in the light's sphere
    float moverCrossings =
        0; ///< of these, how many boxes a line through the sphere crosses on average
    PreviousRoute previous = PreviousRoute::kNone; ///< of the same light and octave
};

/// Cost of serving one map by either method, measured or predicted.
struct MapCost {
    uint32_t light = 0;
    uint32_t octave = 0; ///< as MapQuantities
    double raysMs = 0;
    double mapMs = 0;
};

/// Costs of every map of a frame, as `oracle` measures them and `--costs` replays them: the same
/// file gives the same routing.
struct FrameCosts {
    uint32_t frame = 0;
    std::vector<MapCost> maps; ///< ascending light, then octave
    /// By what the maps' costs were multiplied, so that those of all maps by one method add up to
    /// the frame by that method; 1 where they are isolated.
    double raysScale = 1, mapsScale = 1;
    double degradeDivisor =
        1; ///< of the frame with every map drawn: over 1 where the pool was full
};

struct CostCalibration;

/// Returns by what factor a map costs more than its rays; infinity for rays that cost nothing
/// beside a map that does, 1 where both cost nothing.
double costRatio(double raysMs, double mapMs);

/// Returns who serves a map whose drawing costs `ratio` times its tracing: rays over `least`, else
/// the map. Not a number goes to the map, as a tie does: its cost does not grow with the samples.
inline Route routeOfRatio(double ratio, double least = 1) {
    return ratio > least ? Route::kRays : Route::kMap;
}

/// Decides per shadow map. Pure: the same quantities give the same routes.
class CostModel {
public:
    virtual ~CostModel() = default;
    /// Returns of every map, in order, by what factor drawing it costs more than tracing it, as far
    /// as the model knows: over 1 where rays are cheaper, infinity where they are beyond doubt, 0
    /// where the map is.
    virtual std::vector<double> weigh(const std::vector<MapQuantities>& maps) const = 0;
    /// Returns the route of every map, in order: rays where they are cheaper, the map at a tie. A
    /// map that had a route in the last frame keeps it until the other method is cheaper by more
    /// than the factor 1 + margin, so that smaller changes of the costs do not switch methods,
    /// which would be visible as popping.
    /// @param margin >= 0; 0 ignores earlier routes
    std::vector<Route> route(const std::vector<MapQuantities>& maps, double margin = 0) const;
    /// Returns whether route() needs costs measured or replayed for this frame first (see
    /// setCosts).
    virtual bool needsCosts() const { return false; }
    /// Returns which of the counted quantities route() reads, a set of Counts. The others are
    /// counted for reports only, outside of the frame's time.
    virtual uint32_t counts() const { return kCountsAll; }
    /// Gives the costs of the frame that is routed next; ignored by models that need none.
    virtual void setCosts(const FrameCosts&) {}
    /// Returns whether weigh() needs a calibration that was not given yet (setCalibration).
    virtual bool needsCalibration() const { return false; }
    /// Gives what maps cost on this machine; ignored by models that need none. Throws Error kUsage
    /// for a calibration without terms or with coefficients that are no costs.
    virtual void setCalibration(const CostCalibration&) {}
};

/// Returns the model that `text` names: `texels:N` (N texels or `inf`; maps below N are traced:
/// texels:0 draws every map, texels:inf traces every light), `expr:EXPRESSION` (a muParser
/// expression over the names of MapQuantities; rays when it is > 0), `cost` (the cheaper by
/// predicted cost; needs a calibration), `oracle` (the cheaper by measured cost). Throws Error
/// kUsage naming the text, the position and the known models.
std::unique_ptr<CostModel> makeCostModel(const std::string& text);

} // namespace shadowdag
