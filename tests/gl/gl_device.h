// SPDX-License-Identifier: Apache-2.0
// Tests that need OpenGL 4.5: they skip, with EGL's reason, if it is missing.
#pragma once

#include "cuda/backend.h"
#include "gl/context.h"

#include <gtest/gtest.h>

namespace shadowdag::test {

/// A suite whose tests skip without OpenGL.
class NeedsGl : public testing::Test {
protected:
    void SetUp() override {
        try {
            GlContext();
        } catch (const Error& error) {
            GTEST_SKIP() << error.what();
        }
    }
};

} // namespace shadowdag::test
