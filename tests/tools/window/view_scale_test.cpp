// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_scale.h"

#include <gtest/gtest.h>

namespace shadowdag {

namespace {

/// Runs pictures that cost `fixedMs` and `fullMs` for all pixels; returns the scale it settles at.
float settled(double targetMs, double fixedMs, double fullMs) {
    RenderScale scale(targetMs);
    for (int i = 0; i < 40; ++i) {
        const float s = scale.next();
        scale.note(s, fixedMs + fullMs * double(s) * double(s));
    }
    return scale.next();
}

TEST(ViewScale, FastScenesGetAllPixels) {
    EXPECT_EQ(settled(20, 1, 10), 1.0f);
}

TEST(ViewScale, SlowScenesKeepTheTarget) {
    for (const double fullMs : {50.0, 100.0, 400.0, 1000.0}) {
        const float s = settled(20, 1, fullMs);
        EXPECT_LE(1 + fullMs * double(s) * double(s), 20.0) << fullMs;
        const double above = double(s) + 0.125;
        // A quarter is kept in reserve, and the part that no pixel costs is taken to grow as well.
        EXPECT_GT(1.35 * (1 + fullMs * above * above), 20.0) << "coarser than needed: " << fullMs;
    }
}

TEST(ViewScale, FixedCostsDoNotReduceTheSize) {
    EXPECT_EQ(settled(20, 60, 5), 1.0f) << "a picture of an eighth would take 60 ms as well";
    EXPECT_GT(settled(20, 60, 20), 0.5f) << "half as much again may go to pixels";
}

TEST(ViewScale, NeverFallsBelowTheLeast) {
    EXPECT_EQ(settled(20, 1, 50000), RenderScale::kLeast);
}

TEST(ViewScale, DoesNotAlternateBetweenTwoSizes) {
    RenderScale scale(20);
    float last = 0;
    int changes = 0;
    for (int i = 0; i < 60; ++i) {
        const float s = scale.next();
        changes += i > 20 && s != last;
        last = s;
        // A tenth of noise, as pictures have.
        scale.note(s, (2 + 150 * double(s) * double(s)) * (i % 2 ? 1.05 : 0.95));
    }
    EXPECT_EQ(changes, 0);
}

TEST(ViewScale, IgnoresInvalidTimes) {
    RenderScale scale(20);
    const float before = scale.next();
    scale.note(before, 0.0);
    EXPECT_EQ(scale.next(), before);
}

} // namespace

} // namespace shadowdag
