// SPDX-License-Identifier: Apache-2.0
// An OpenGL 4.5 core context without a display, by EGL. No window, no default framebuffer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace shadowdag {

/// What an OpenGL is and can do.
struct GlInfo {
    std::string vendor, renderer, version;
    uint64_t maxStorageBytes = 0; ///< of a buffer that shaders read or write
    int maxViewport = 0;          ///< pixels a side
    int maxArrayLayers = 0;
    bool hasSparseTextures = false; ///< ARB_sparse_texture
    uint32_t sparsePageTexels = 0;  ///< side of their pages (GlSparseArray), 0: not square
    bool drawsSparseLayers = false; ///< GlSparseArray::canBeDrawnInto
    std::string layerExtension;     ///< by which a vertex shader chooses the layer, or empty
    /// What arithmetic does, asked of the device itself: GLSL promises neither. Without them the
    /// texts compute in double and round.
    bool hasFusedMultiplyAdd = false; ///< fma() rounds once
    bool hasExactDivision = false;    ///< float quotients round to nearest
};

/// Owns a context. It is current on no thread until a Current makes it so; one thread at a time.
/// Objects made with it are destroyed with it current.
class GlContext {
public:
    /// Creates it on a device that is not software, where there is one (EGL's device platform),
    /// else on Mesa's surfaceless platform, else on any device. Throws Error kDevice with EGL's
    /// message and what to do.
    GlContext();
    ~GlContext();
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    /// Makes a context current on this thread, and what was current before when it ends. May be
    /// nested. What was current has to be EGL's, or nothing: GLX and EGL exclude each other on a
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

/// Throws Error kDevice when OpenGL has an error to report; the context is current. Free of
/// waiting.
/// @param what the work that is blamed
void checkGl(const char* what);

/// Returns what the OpenGL is that GlContext() gives; asked once a process. Throws Error kDevice.
const GlInfo& glDeviceInfo();

/// Returns the name and the version of the OpenGL that GlContext() gives. Throws Error kDevice.
std::string glDeviceName();
std::string glDriverVersion();

} // namespace shadowdag
