// SPDX-License-Identifier: Apache-2.0
// The measurements of models for `fit`: their error, bytes and time on the frames of all scenes,
// measured as in compare (measure.h).
#pragma once

#include "tools/settings/console.h"
#include "tools/workspace/fit_space.h"
#include "tools/workspace/measure.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// The definition of a model's error in a frame.
enum class FitMetric : uint8_t {
    kFalse,      ///< share of the pairs that are false shadow or false light
    kVisibility, ///< mean absolute error of visibility over the pairs
    kFlip,       ///< mean FLIP of the picture
};

/// The measurements of a model in one frame of one scene.
struct FitCell {
    bool isMeasured = false;
    double error = 0;
    uint64_t pairCount = 0, falseShadowCount = 0, falseLightCount = 0;
    double meanAbsVisibilityError = 0, flip = 0;
    uint64_t dagBytes = 0, mapBytes = 0;
    uint64_t mappedLightCount = 0; ///< lights with a drawn map
    std::string poolNote;          ///< effect of a full pool (frame_json.h), "" if it was not full
    uint64_t bytes() const { return dagBytes + mapBytes; }
};

/// The time of a frame over repeated runs, or the mean of several frames' times.
struct FitTime {
    double medianMs = 0, minMs = 0;
    double standardErrorMs = 0; ///< of the median
};

/// Returns the time of a frame from its runs. The standard error is that of the median of normal
/// noise: sqrt(pi / 2) times the standard deviation over the root of the count. Source: Kendall,
/// Stuart, The Advanced Theory of Statistics, vol. 1, sec. 14.6. At least two runs.
FitTime fitTime(const std::vector<double>& runsMs);

/// Scenes, voxels and truth, and the measurements of the models on them so far.
class FitMeasurer {
public:
    /// Loads the scenes and obtains their voxels at all resolutions of the sweep. A scene without
    /// animations has one frame, the sweep's first, because the others are equal.
    /// @param costs for models that route by them; outlives the measurer
    FitMeasurer(const Experiment& sweep, FitMetric metric, FitObjective objective, Backend backend,
                const std::string& cacheDirectory, const CostSource& costs, const Console& console);
    ~FitMeasurer();

    /// Returns the bytes of the voxels by resolution, of the scene with the most.
    std::vector<uint64_t> dagBytes() const;
    /// The models that the calls below index; outlive the measurer.
    void setModels(const FitModels& models);

    /// Measures errors in the cells that were not measured yet; with FitObjective::kTime also the
    /// time in the first cell if it is unknown, by kScreenRepeats runs.
    void measure(const std::vector<FitRequest>& requests, const std::string& what);
    /// Times models in all cells, in turn, so that disturbances of the machine affect all equally.
    void time(const std::vector<size_t>& models, int repeats, int warmups, const std::string& what);

    FitObservation observation(size_t model) const;
    const std::vector<FitCell>& cells(size_t model) const { return cells_[model]; }
    /// Returns the model of rays alone that is equal to a hybrid that drew no map in any cell;
    /// SIZE_MAX for others, and if the space lacks it. For models measured in all cells.
    size_t raysAlone(size_t model) const;
    /// Returns the time in the first cell, as the search used it; nothing if it was not measured.
    std::optional<FitTime> screenTime(size_t model) const { return screenTimes_[model]; }
    /// Returns the mean of the frames' times that the last time() took of the model.
    std::optional<FitTime> finalTime(size_t model) const { return finalTimes_[model]; }
    /// Returns the largest share of the processor that other processes used while times were
    /// measured (CpuUse).
    std::optional<double> otherCpuShare() const { return otherCpuShare_; }
    size_t cellCount() const { return cellNames_.size(); }
    /// Returns {"scene", "frame"} by cell, and its "camera_numbers" once it was measured.
    const Json& cellNames() const { return cellNames_; }
    /// Returns {"scene", "scene_hash", "triangle_count", "light_count", "frames"} by scene.
    Json scenes() const;

    static constexpr int kScreenRepeats = 2;

private:
    struct FitScene;
    void run(size_t cell, const std::vector<size_t>& models, int repeats, int warmups,
             const std::string& what, std::vector<std::vector<double>>* runsMs);

    Experiment sweep_;
    FitMetric metric_;
    FitObjective objective_;
    const CostSource& costs_;
    const Console& console_;
    const FitModels* models_ = nullptr;
    std::vector<std::unique_ptr<FitScene>> scenes_;
    std::vector<std::pair<size_t, uint32_t>> cellFrames_; ///< scene and frame by cell
    Json cellNames_ = Json::array();
    std::vector<std::vector<FitCell>> cells_; ///< by model, then cell
    std::vector<std::optional<FitTime>> screenTimes_, finalTimes_;
    size_t batchCount_ = 0;
    std::optional<double> otherCpuShare_;
};

} // namespace shadowdag
