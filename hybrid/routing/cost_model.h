// SPDX-License-Identifier: Apache-2.0
// Decides which method serves each shadow map: the interface, the quantities of a map, and the
// table of models.
#pragma once

#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// The method that computes the visibility of a map's samples.
enum class Route : uint8_t { kRays = 0, kMap = 1 };

/// The method of a map in the frame before: none (it was not requested, or the renderer was reset),
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

/// The known quantities of a shadow map before routing. All counts are integers of this frame.
struct MapQuantities {
    uint32_t light = 0;
    uint32_t octave = 0; ///< of this map among the light's: floor(log2) of its clusters'
                         ///< requests, lower ones with the lowest; 0 with one map per light
    float texels = 0;    ///< requested face resolution R, after undersampling, before any rounding
    uint32_t faceTexels = 0; ///< allocated face resolution
    uint32_t pages = 0;      ///< pages that PageMarks asks for at faceTexels
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

/// Costs of every map of a frame, measured by `oracle` and replayed by `--costs`: the same file
/// gives the same routing.
struct FrameCosts {
    uint32_t frame = 0;
    std::vector<MapCost> maps; ///< ascending light, then octave
    /// The factors by which the maps' costs were multiplied, so that those of all maps by one
    /// method add up to the frame by that method; 1 if they are isolated.
    double raysScale = 1, mapsScale = 1;
    double degradeDivisor = 1; ///< of the frame with every map drawn: above 1 if the pool was full
    /// The threshold of the model `texels` by which all maps are routed if the whole frame by it
    /// was measured to be faster than the frame by the cheaper method of each map, since a frame of
    /// both methods pays for both: infinity for rays alone, 0 for maps alone, or one between.
    std::optional<float> wholeFrameTexels = {};
};

struct CostCalibration;
class CostModel;

/// Returns the model texels:THRESHOLD, of at least 0; infinity traces all.
std::unique_ptr<CostModel> makeTexelModel(float threshold);

/// Returns the ratio of a map's cost to its rays' cost; infinity for rays that cost nothing and a
/// map that does, 1 if both cost nothing.
double costRatio(double raysMs, double mapMs);

/// Returns the method of a map whose drawing costs `ratio` times its tracing: rays above `least`,
/// else the map. NaN selects the map, as a tie does: its cost does not grow with the samples.
inline Route routeOfRatio(double ratio, double least = 1) {
    return ratio > least ? Route::kRays : Route::kMap;
}

/// Decides per shadow map. Pure: the same quantities give the same routes.
class CostModel {
public:
    virtual ~CostModel() = default;
    /// Returns for every map, in order, the ratio of the cost of drawing it to that of tracing it,
    /// as far as the model knows: above 1 if rays are cheaper, infinity if they certainly are, 0 if
    /// the map certainly is.
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
    /// Sets the costs of the frame that is routed next; ignored by models that need none.
    virtual void setCosts(const FrameCosts&) {}
    /// Returns whether weigh() needs a calibration that was not set yet (setCalibration).
    virtual bool needsCalibration() const { return false; }
    /// Sets the costs of maps on this machine; ignored by models that need none. Throws Error
    /// kUsage for a calibration without terms or with coefficients that are not costs.
    virtual void setCalibration(const CostCalibration&) {}
};

/// Returns the model that `text` names: `texels:N` (N texels or `inf`; maps below N are traced:
/// texels:0 draws every map, texels:inf traces every light), `expr:EXPRESSION` (a muParser
/// expression over the names of MapQuantities; rays when it is > 0), `cost` (the cheaper by
/// predicted cost; needs a calibration), `oracle` (the cheaper by measured cost). Throws Error
/// kUsage naming the text, the position and the known models.
std::unique_ptr<CostModel> makeCostModel(const std::string& text);

} // namespace shadowdag
