// SPDX-License-Identifier: Apache-2.0
// An OpenGL 4.5 core context without a display, by EGL. No window, no default framebuffer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace shadowdag {

/// Properties and limits of an OpenGL implementation.
struct GlInfo {
    std::string vendor, renderer, version;
    uint64_t maxStorageBytes = 0; ///< of a buffer that shaders read or write
    int maxViewport = 0;          ///< pixels a side of what is drawn into
    /// Storage blocks available to a stage, to all stages of a program together, and those that may
    /// be bound at a time.
    int vertexStorageBlocks = 0, fragmentStorageBlocks = 0, computeStorageBlocks = 0,
        combinedStorageBlocks = 0, storageBindings = 0;
    int subpixelBits = 0; ///< corners of triangles snap to 2^-bits of a pixel
    int maxArrayLayers = 0;
    bool hasSparseTextures = false; ///< ARB_sparse_texture
    uint32_t sparsePageTexels = 0;  ///< side of their pages (GlSparseArray), 0: not square
    bool drawsSparseLayers = false; ///< GlSparseArray::canBeDrawnInto
    std::string layerExtension;     ///< by which a vertex shader chooses the layer, or empty
    /// Results of tests of the device's arithmetic: GLSL guarantees neither property. Without them
    /// shaders compute in double and round.
    bool hasFusedMultiplyAdd = false; ///< fma() rounds once
    bool hasExactDivision = false;    ///< float quotients round to nearest
};

/// Limits that programs of this project need and OpenGL 4.5 does not guarantee: the blocks that
/// rasterize.vert, rasterize.frag and shade.comp use, those of a program (a block of two stages
/// counts twice), the bindings that they get, and the grid of corners with which the tests' bounds
/// were measured.
constexpr int kGlVertexBlocks = 5, kGlFragmentBlocks = 10, kGlComputeBlocks = 16,
              kGlCombinedBlocks = kGlVertexBlocks + kGlFragmentBlocks > kGlComputeBlocks
                                      ? kGlVertexBlocks + kGlFragmentBlocks
                                      : kGlComputeBlocks,
              kGlBindings = 16, kGlSubpixelBits = 8;

/// Throws Error kDevice naming the first of these that a device does not reach.
void refuseLess(const GlInfo& info);

/// Returns the message for a missing OpenGL: what each device reported, and what to do. @param why
/// "; NAME: REASON" for each @param isTooOld whether a driver of any of them has another OpenGL
std::string glAbsence(const std::string& why, bool isTooOld);

/// Owns a context. No thread has it current until a Current makes it so; one thread at a time.
/// Objects made with it are destroyed with it current.
class GlContext {
public:
    /// Creates it on a hardware device if there is one (EGL's device platform), else on Mesa's
    /// surfaceless platform, else on any device; all further ones of this process on that same
    /// device. Throws Error kDevice with EGL's message and what to do, also if the device does not
    /// reach the limits of refuseLess or is not usable again (GlDeviceChoice).
    GlContext();
    ~GlContext();
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    /// Makes a context current on this thread, and restores the previous one at the end. May be
    /// nested. The previous context must be EGL's, or none: GLX and EGL exclude each other on a
    /// thread.
    class Current {
    public:
        explicit Current(const GlContext& context);
        ~Current();
        Current(const Current&) = delete;
        Current& operator=(const Current&) = delete;

    private:
        struct Before;
        std::unique_ptr<Before> before_;
    };

    const GlInfo& info() const { return info_; }
    /// Returns when all queued work is done. Throws Error kDevice naming `what` when OpenGL reports
    /// an error since the last call. The context is current.
    void finish(const char* what) const;

private:
    struct State;
    void look();
    std::unique_ptr<State> state_;
    GlInfo info_;
};

/// Throws Error kDevice if OpenGL reports an error; the context is current. Does not wait. @param
/// what the work that is named in the message
void checkGl(const char* what);

/// Returns the properties of the OpenGL of GlContext(); queried once per process. Throws Error
/// kDevice.
const GlInfo& glDeviceInfo();

/// Returns the name and the version of the OpenGL of GlContext(). Throws Error kDevice.
std::string glDeviceName();
std::string glDriverVersion();

} // namespace shadowdag
