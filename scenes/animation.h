// SPDX-License-Identifier: Apache-2.0
// The value of an animation channel at a time. Source: Khronos, glTF 2.0 specification, sec. 3.11
// and appendix C. Only add, multiply, divide and square root, so that every machine gets the same
// bits.
#pragma once

#include "scenes/scene.h"

namespace shadowdag {

/// Returns the channel's value at a time: xyz of a translation or scale, or a unit quaternion xyzw.
/// Before the first and after the last key the nearest key holds. The channel has at least one key.
glm::vec4 sampleChannel(const AnimationChannel& channel, float timeSeconds);

/// Returns the unit quaternion (xyzw) at fraction t in [0, 1] of the shorter arc from a to b, both
/// unit. The arc is halved 20 times towards t and the rest is linear, which leaves an error under
/// 1e-12 rad; the closed form needs sines from libm, which differ between machines. For opposite
/// quaternions, between which no arc is shorter, one of the arcs is taken.
glm::dvec4 slerp(const glm::dvec4& a, const glm::dvec4& b, double t);

} // namespace shadowdag
