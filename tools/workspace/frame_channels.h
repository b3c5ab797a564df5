// SPDX-License-Identifier: Apache-2.0
// A frame as the channels of an EXR.
#pragma once

#include "hybrid/frame.h"
#include "tools/workspace/image_io.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The data of one frame.
struct ChannelInputs {
    std::string prefix;                  ///< before every name, as in "right."; mostly ""
    const std::vector<glm::vec3>& color; ///< linear radiance
    ExrChannel::Type colorType = ExrChannel::Type::kHalf;
    GBufferView gbuffer; ///< on the host
    const PairList& pairs;
    const std::vector<uint8_t>& visibility; ///< per pair
    const std::vector<Route>& routes;       ///< per pair, or empty: the truth alone
    const std::vector<uint8_t>& truth;      ///< per pair, or empty: unknown
};

/// Returns R, G, B, visibility.mean, with routes method.rayShare, depth.Z, and with routes and the
/// truth error.pairCount, error.falseShadowCount, error.falseLightCount, error.truthVisibility.
std::vector<ExrChannel> frameChannels(const ChannelInputs& inputs);

} // namespace shadowdag
