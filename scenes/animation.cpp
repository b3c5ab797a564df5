// SPDX-License-Identifier: Apache-2.0
#include "scenes/animation.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

glm::dvec4 normalized(const glm::dvec4& q) {
    const double lengthSquared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    return lengthSquared > 0.0 ? q / std::sqrt(lengthSquared) : glm::dvec4(0, 0, 0, 1);
}

// Hermite spline of appendix C.5; tangents are per second, hence the factor `span`.
glm::dvec4 cubicSpline(const glm::dvec4& value0, const glm::dvec4& outTangent0,
                       const glm::dvec4& inTangent1, const glm::dvec4& value1, double t,
                       double span) {
    const double t2 = t * t, t3 = t2 * t;
    return (2.0 * t3 - 3.0 * t2 + 1.0) * value0 + span * (t3 - 2.0 * t2 + t) * outTangent0 +
           (3.0 * t2 - 2.0 * t3) * value1 + span * (t3 - t2) * inTangent1;
}

} // namespace

glm::dvec4 slerp(const glm::dvec4& a, const glm::dvec4& b, double t) {
    glm::dvec4 low = a;
    glm::dvec4 high = glm::dot(a, b) < 0.0 ? -b : b;
    for (int i = 0; i < 20; ++i) {
        const glm::dvec4 middle = normalized(low + high);
        t *= 2.0;
        if (t < 1.0) {
            high = middle;
        } else {
            low = middle;
            t -= 1.0;
        }
    }
    return normalized(low + (high - low) * t);
}

glm::vec4 sampleChannel(const AnimationChannel& channel, float timeSeconds) {
    using Interpolation = AnimationChannel::Interpolation;
    const bool isCubic = channel.interpolation == Interpolation::kCubicSpline;
    const bool isRotation = channel.path == AnimationChannel::Path::kRotation;
    const auto value = [&](size_t key) {
        return glm::dvec4(channel.values[isCubic ? 3 * key + 1 : key]);
    };
    const auto finish = [&](const glm::dvec4& v) {
        return glm::vec4(isRotation ? normalized(v) : v);
    };

    const std::vector<float>& times = channel.times;
    if (!(timeSeconds > times.front()))
        return finish(value(0));
    if (timeSeconds >= times.back())
        return finish(value(times.size() - 1));
    // The last key that is not after the time: with equal times, the later key.
    const size_t next =
        size_t(std::upper_bound(times.begin(), times.end(), timeSeconds) - times.begin());
    const size_t key = next - 1;
    if (channel.interpolation == Interpolation::kStep)
        return finish(value(key));
    const double span = double(times[next]) - double(times[key]);
    const double t = (double(timeSeconds) - double(times[key])) / span;
    if (isCubic) {
        return finish(cubicSpline(value(key), glm::dvec4(channel.values[3 * key + 2]),
                                  glm::dvec4(channel.values[3 * next]), value(next), t, span));
    }
    if (isRotation)
        return glm::vec4(slerp(normalized(value(key)), normalized(value(next)), t));
    return glm::vec4(value(key) + (value(next) - value(key)) * t);
}

} // namespace shadowdag
