// SPDX-License-Identifier: Apache-2.0
#include "gl/context.h"

#include "tests/gl/gl_device.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <gmock/gmock.h>

#include <thread>

namespace shadowdag {
namespace {

class GlContextTest : public test::NeedsGl {};

TEST_F(GlContextTest, IsOpenGl45WithWhatShadersNeed) {
    const GlContext context;
    const GlInfo& info = context.info();
    EXPECT_FALSE(info.renderer.empty());
    EXPECT_GE(info.maxStorageBytes, uint64_t(1) << 27); // OpenGL 4.5 promises that many
    EXPECT_GE(info.maxViewport, 8192);                  // kMaxFaceTexels
    EXPECT_GE(info.maxArrayLayers, 2048);
    EXPECT_EQ(glDeviceName(), info.renderer);
    EXPECT_EQ(glDriverVersion(), info.version);
    const GlContext::Current current(context);
    GLint major = 0, minor = 0;
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
    EXPECT_GE(10 * major + minor, 45);
}

TEST_F(GlContextTest, CurrentRestoresThePreviousContext) {
    const GlContext one, other;
    ASSERT_EQ(eglGetCurrentContext(), EGL_NO_CONTEXT);
    {
        const GlContext::Current a(one);
        const EGLContext ofOne = eglGetCurrentContext();
        ASSERT_NE(ofOne, EGL_NO_CONTEXT);
        {
            const GlContext::Current b(other);
            EXPECT_NE(eglGetCurrentContext(), ofOne);
            const GlContext::Current again(other);
        }
        EXPECT_EQ(eglGetCurrentContext(), ofOne);
    }
    EXPECT_EQ(eglGetCurrentContext(), EGL_NO_CONTEXT);
}

TEST_F(GlContextTest, MovesBetweenThreadsButBelongsToOneAtATime) {
    const GlContext context;
    std::string renderer;
    std::thread([&] {
        const GlContext::Current current(context);
        renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    }).join();
    EXPECT_EQ(renderer, context.info().renderer);
    const GlContext::Current current(context);
    std::string refusal;
    std::thread([&] {
        try {
            const GlContext::Current second(context);
        } catch (const Error& error) {
            refusal = error.what();
        }
    }).join();
    EXPECT_THAT(refusal, testing::HasSubstr("EGL_BAD_ACCESS"));
}

TEST_F(GlContextTest, ErrorsNameTheWork) {
    const GlContext context;
    const GlContext::Current current(context);
    glEnable(0x1234);
    try {
        context.finish("the test");
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDevice);
        EXPECT_THAT(error.what(), testing::HasSubstr("the test"));
    }
    EXPECT_NO_THROW(context.finish("nothing"));
}

// Limits that drivers may have: each is named, with what is needed.
TEST(GlLimits, TooLittleIsRefusedByName) {
    GlInfo enough;
    enough.renderer = "a device";
    enough.vertexStorageBlocks = kGlVertexBlocks;
    enough.fragmentStorageBlocks = kGlFragmentBlocks;
    enough.computeStorageBlocks = kGlComputeBlocks;
    enough.combinedStorageBlocks = kGlCombinedBlocks;
    enough.storageBindings = kGlBindings;
    enough.subpixelBits = kGlSubpixelBits;
    EXPECT_NO_THROW(refuseLess(enough));
    const auto refusal = [&](int GlInfo::*limit) -> std::string {
        GlInfo less = enough;
        --(less.*limit);
        try {
            refuseLess(less);
            return "";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kDevice);
            return error.what();
        }
    };
    EXPECT_THAT(refusal(&GlInfo::vertexStorageBlocks), testing::HasSubstr("per vertex shader"));
    EXPECT_THAT(refusal(&GlInfo::fragmentStorageBlocks), testing::HasSubstr("per fragment shader"));
    EXPECT_THAT(refusal(&GlInfo::computeStorageBlocks),
                testing::HasSubstr("a device has 15 storage blocks per compute shader, and the "
                                   "OpenGL backend needs 16"));
    EXPECT_THAT(refusal(&GlInfo::combinedStorageBlocks),
                testing::HasSubstr("15 storage blocks per program"));
    EXPECT_THAT(refusal(&GlInfo::storageBindings), testing::HasSubstr("bindings"));
    EXPECT_THAT(refusal(&GlInfo::subpixelBits), testing::HasSubstr("7 subpixel bits"));
}

TEST(GlLimits, ATooOldDriverGetsTheAdviceToUpdate) {
    const std::string old = glAbsence("; device 0: EGL_BAD_MATCH (no OpenGL 4.5 core)", true);
    EXPECT_THAT(old, testing::HasSubstr("has no OpenGL 4.5 core: update it"));
    EXPECT_THAT(old, testing::Not(testing::HasSubstr("install")));
    EXPECT_THAT(old, testing::HasSubstr("llvmpipe"));
    EXPECT_THAT(glAbsence("", false), testing::AllOf(testing::HasSubstr("install a driver"),
                                                     testing::HasSubstr("llvmpipe")));
}

TEST_F(GlContextTest, TheBackendIsChosenByItsNameAndNamesItsDevice) {
    EXPECT_EQ(chooseBackend("gl"), Backend::kGl);
    EXPECT_NE(chooseBackend("auto"), Backend::kGl);
    EXPECT_STREQ(backendName(Backend::kGl), "gl");
    EXPECT_EQ(passBackend(Backend::kGl), Backend::kCpu);
    EXPECT_EQ(deviceName(Backend::kGl), glDeviceName());
    EXPECT_EQ(driverVersion(Backend::kGl), glDriverVersion());
}

} // namespace
} // namespace shadowdag
