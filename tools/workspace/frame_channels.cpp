// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/frame_channels.h"

#include "tools/workspace/error_image.h"

#include <utility>

namespace shadowdag {

std::vector<ExrChannel> frameChannels(const ChannelInputs& in) {
    using Type = ExrChannel::Type;
    std::vector<ExrChannel> channels;
    const auto add = [&](const char* name, Type type, std::vector<float> values) {
        channels.push_back({in.prefix + name, type, std::move(values)});
    };
    addColorChannels(channels, in.prefix, in.colorType, in.color);
    add("visibility.mean", Type::kHalf, meanVisibility(in.pairs, in.visibility));
    const bool hasMethod = !in.routes.empty();
    if (hasMethod)
        add("method.rayShare", Type::kHalf, rayShare(in.pairs, in.routes));
    add("depth.Z", Type::kFloat, {in.gbuffer.depthView.begin(), in.gbuffer.depthView.end()});
    if (hasMethod && !in.truth.empty()) {
        PixelErrors errors = countPixelErrors(in.pairs, in.visibility, in.truth);
        add("error.pairCount", Type::kFloat, std::move(errors.pairCount));
        add("error.falseShadowCount", Type::kFloat, std::move(errors.falseShadow));
        add("error.falseLightCount", Type::kFloat, std::move(errors.falseLight));
        add("error.truthVisibility", Type::kHalf, meanVisibility(in.pairs, in.truth));
    }
    return channels;
}

} // namespace shadowdag
