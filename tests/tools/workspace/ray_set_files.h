// SPDX-License-Identifier: Apache-2.0
// A small ray set with a known answer, for tests of its files and of its score.
#pragma once

#include "tools/workspace/ray_answers.h"

namespace shadowdag {

/// A floor of half side 8 at y = 0, a plate of half side 1 at y = 1, a light above it and one from
/// the side: pair 0 is dark, pair 1 lit, pair 2, of the directional light, lit, pair 3 lit through
/// the hole that a mask cuts.
inline RaySet makeSmallRaySet() {
    RaySet set;
    const auto square = [&](float y, float half, float x) {
        const auto first = uint32_t(set.vertex.size());
        set.vertex.insert(set.vertex.end(), {{x - half, y, -half},
                                             {x - half, y, half},
                                             {x + half, y, half},
                                             {x + half, y, -half}});
        set.triangle.emplace_back(first, first + 1, first + 2);
        set.triangle.emplace_back(first, first + 2, first + 3);
    };
    square(0.0f, 8.0f, 0.0f);
    square(1.0f, 1.0f, 0.0f);
    square(1.0f, 1.0f, 5.0f); // cut out as a whole
    const AlphaMask mask = makeAlphaMask(2, 2);
    const uint32_t index = set.masks.add(mask);
    set.masks.triangleCut = {kNotCut, kNotCut, kNotCut, kNotCut, 0, 0};
    set.masks.cuts = {{index, {{0, 0}, {0, 1}, {1, 1}}}};
    set.positionWorld = {{0.1f, 0, 0.2f}, {3, 0, 3.5f}, {5, 0, -0.5f}};
    set.normalWorld = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
    set.receiver = {0, 0, 1};
    set.pixel = {4, 5, 9};
    set.lightPoint = {{0.0f, 2.0f, 0.0f, 1.0f}, {8.0f, 16.0f, 0.0f, 0.0f}, {5, 3, 0, 1}};
    set.pairSample = {0, 1, 1, 2};
    set.pairLight = {0, 0, 1, 2};
    set.about = {{"scene", "small"}, {"frame", 0}, {"experiment", {{"size", "4x4"}}}};
    return set;
}

inline RayAnswers makeRightAnswers(const RaySet& set) {
    return {"right", set.id(), {0, 1, 1, 1}, {2.0, 1.0, 3.0}, 0.5};
}

} // namespace shadowdag
