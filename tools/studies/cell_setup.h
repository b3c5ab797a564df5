// SPDX-License-Identifier: Apache-2.0
// What a cell of a study is rendered with: a method and settings as texts, "bias=8 taps=1".
//
// cellSettings() lists the keys. Most are options of render and compare under the same name. Three
// have no option, since nobody wants to be without them: receiver_plane, movers and redraw. They
// are taken out by asking the pairs of the frame once more without them; nothing else of the frame
// changes.
#pragma once

#include "hybrid/frame.h"
#include "hybrid/routing/cost_model.h"

#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

enum class MatrixMethod : uint8_t { kMaps, kDag, kDagExact, kHybrid };
constexpr int kMatrixMethodCount = 4;
inline constexpr const char* kMatrixMethodNames[kMatrixMethodCount] = {"maps", "dag", "dag-exact",
                                                                       "hybrid"};

/// One setting that rows of studies may name.
struct CellSetting {
    std::string key, help;
    std::vector<MatrixMethod> readBy;
};
const std::vector<CellSetting>& cellSettings();

/// What a cell is rendered with.
struct CellSetup {
    FrameOptions frame;
    uint32_t resolutionLog2 = 9;
    float hybridTexels = 96; ///< the hybrid's threshold
    bool keepsFrames = true; ///< false: hysteresis and kept maps are forgotten before each frame
    bool hasPlane = true, hasMovers = true, redraws = true;
};

/// Returns the settings of the texts, each on top of those before it. Throws Error kUsage for an
/// unknown key and for a value that is none.
CellSetup cellSetup(const std::vector<std::string>& settings);

/// Returns the cost model that serves lights by a method, and, of dag-exact, lets the setup's rays
/// be exact.
std::unique_ptr<CostModel> modelOf(MatrixMethod method, CellSetup& setup);

/// Returns whether the method reads any key of the settings.
bool readsAny(MatrixMethod method, const std::string& settings);

} // namespace shadowdag
