// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/error_image.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

float grey(const glm::vec3& display) {
    return glm::dot(display, glm::vec3(0.2126f, 0.7152f, 0.0722f));
}

/// Calls visit(sample, pair) for every pair in order.
template <class F> void forEachPair(const PairList& pairs, const F& visit) {
    for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample)
        for (uint64_t pair = pairs.sampleStart[sample]; pair < pairs.sampleStart[sample + 1];
             ++pair)
            visit(sample, pair);
}

size_t sampleCount(const PairList& pairs) {
    return pairs.sampleStart.empty() ? 0 : pairs.sampleStart.size() - 1;
}

} // namespace

PixelErrors countPixelErrors(const PairList& pairs, const std::vector<uint8_t>& visibility,
                             const std::vector<uint8_t>& truth) {
    const size_t count = sampleCount(pairs);
    PixelErrors errors{std::vector<float>(count), std::vector<float>(count),
                       std::vector<float>(count)};
    forEachPair(pairs, [&](size_t sample, uint64_t pair) {
        const bool isDark = visibility[pair] < kHalfLit, isTrulyDark = truth[pair] < kHalfLit;
        errors.pairCount[sample] += 1;
        errors.falseShadow[sample] += isDark && !isTrulyDark ? 1.0f : 0.0f;
        errors.falseLight[sample] += !isDark && isTrulyDark ? 1.0f : 0.0f;
    });
    return errors;
}

std::vector<float> meanVisibility(const PairList& pairs, const std::vector<uint8_t>& visibility) {
    std::vector<float> means(sampleCount(pairs), 1.0f);
    for (size_t sample = 0; sample < means.size(); ++sample) {
        const uint64_t begin = pairs.sampleStart[sample], end = pairs.sampleStart[sample + 1];
        uint64_t sum = 0;
        for (uint64_t pair = begin; pair < end; ++pair)
            sum += visibility[pair];
        if (end > begin)
            means[sample] = float(double(sum) / (255.0 * double(end - begin)));
    }
    return means;
}

std::vector<float> rayShare(const PairList& pairs, const std::vector<Route>& routes) {
    std::vector<float> shares(sampleCount(pairs), 0.0f);
    forEachPair(pairs, [&](size_t sample, uint64_t pair) {
        if (routes[pair] == Route::kRays)
            shares[sample] +=
                1.0f / float(pairs.sampleStart[sample + 1] - pairs.sampleStart[sample]);
    });
    return shares;
}

std::vector<glm::vec3> errorPicture(const std::vector<glm::vec3>& truthDisplay,
                                    const PixelErrors& errors) {
    std::vector<glm::vec3> picture(truthDisplay.size());
    for (size_t i = 0; i < picture.size(); ++i) {
        glm::vec3 color(0.10f + 0.35f * grey(truthDisplay[i]));
        if (errors.pairCount[i] > 0) {
            const float shadow = std::sqrt(errors.falseShadow[i] / errors.pairCount[i]);
            const float light = std::sqrt(errors.falseLight[i] / errors.pairCount[i]);
            color = glm::mix(color, kVermilion, shadow);
            color = glm::mix(color, kBlue, light);
        }
        picture[i] = color;
    }
    return picture;
}

std::optional<glm::vec2> pixelOf(const glm::vec3& positionWorld, const Camera& camera,
                                 uint32_t width, uint32_t height) {
    const glm::vec3 toPoint = positionWorld - camera.positionWorld;
    const float depth = glm::dot(toPoint, camera.forward);
    if (!(depth > camera.znear))
        return std::nullopt;
    const float tangent = std::tan(camera.yfov * 0.5f);
    const float pixels = float(height) * 0.5f / (depth * tangent); // a metre at its depth
    return glm::vec2(float(width) * 0.5f + glm::dot(toPoint, camera.right()) * pixels,
                     float(height) * 0.5f - glm::dot(toPoint, camera.up) * pixels);
}

std::vector<glm::vec3> methodPicture(const std::vector<glm::vec3>& truthDisplay,
                                     const std::vector<float>& rayShares,
                                     const std::vector<MapRecord>& maps,
                                     const std::vector<Light>& lights, const Camera& camera,
                                     uint32_t width, uint32_t height, float scale) {
    std::vector<glm::vec3> picture(truthDisplay.size());
    for (size_t i = 0; i < picture.size(); ++i)
        picture[i] =
            glm::mix(kOrange, kSkyBlue, rayShares[i]) * (0.15f + 0.85f * grey(truthDisplay[i]));

    // At least a pixel, because smaller discs are invisible.
    const float radius = std::max(0.71f, std::max(2.5f * scale, float(height) / 120.0f));
    const float rim = std::min(scale, 1.0f);
    for (const MapRecord& map : maps) {
        const Light& light = lights[map.quantities.light];
        const std::optional<glm::vec2> pixel = pixelOf(light.positionWorld, camera, width, height);
        if (light.kind == Light::kSun || !pixel) // a sun is nowhere
            continue;
        const float x = pixel->x, y = pixel->y;
        if (!(x > -radius && y > -radius && x < float(width) + radius &&
              y < float(height) + radius))
            continue;
        const glm::vec3 color = map.route == Route::kRays ? kSkyBlue : kOrange;
        for (int py = int(y - radius - 1); py <= int(y + radius + 1); ++py)
            for (int px = int(x - radius - 1); px <= int(x + radius + 1); ++px) {
                if (px < 0 || py < 0 || px >= int(width) || py >= int(height))
                    continue;
                const float distance = std::hypot(float(px) + 0.5f - x, float(py) + 0.5f - y);
                if (distance <= radius + rim) // a white rim sets the disc off from its surroundings
                    picture[size_t(py) * width + size_t(px)] =
                        distance <= radius ? color : glm::vec3(1.0f);
            }
    }
    return picture;
}

} // namespace shadowdag
