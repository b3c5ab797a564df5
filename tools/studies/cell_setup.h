// SPDX-License-Identifier: Apache-2.0
// The setup of a cell of a study: a method and settings as texts, "bias=8 taps=1".
//
// cellSettings() lists the keys. Most are options of render and compare under the same name. Three
// have no option, because no user needs to switch them off: receiver_plane, movers and redraw. They
// are removed by computing the pairs of the frame again without them; nothing else of the frame
// changes.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/routing/cost_model.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// The methods of a table; those of `dag` believe all voxels or none.
enum class MatrixMethod : uint8_t { kMaps, kDagAll, kDagNone, kHybrid };
constexpr int kMatrixMethodCount = 4;
inline constexpr const char* kMatrixMethodNames[kMatrixMethodCount] = {
    "maps", "dag believe all", "dag believe none", "hybrid"};

/// Returns a method's name as a part of file names.
std::string fileNameOf(MatrixMethod method);

/// One setting that rows of studies may name.
struct CellSetting {
    std::string key, help;
    std::vector<MatrixMethod> readBy;
};
const std::vector<CellSetting>& cellSettings();

/// The setup of a cell.
struct CellSetup {
    FrameOptions frame;
    uint32_t resolutionLog2 = 9;
    std::optional<float> believe;               ///< of `dag believe all` and the hybrid
    float hybridBelieve = RayOptions{}.believe; ///< unless `believe` is given
    float hybridTexels = 96;                    ///< the hybrid's threshold
    bool keepsFrames = true; ///< false: hysteresis and kept maps are released before each frame
    bool hasPlane = true, hasMovers = true, redraws = true;
};

/// Returns the setup of the texts, later ones overriding earlier ones. Throws Error kUsage for an
/// unknown key or an invalid value.
CellSetup cellSetup(const std::vector<std::string>& settings);

/// Returns the cost model of a method, and sets which voxels its rays believe.
std::unique_ptr<CostModel> modelOf(MatrixMethod method, CellSetup& setup);

/// Returns whether the method reads any key of the settings.
bool readsAny(MatrixMethod method, const std::string& settings);

} // namespace shadowdag
