// SPDX-License-Identifier: Apache-2.0
// EGL: displays, contexts, and the current context. Displays stay open until the process ends,
// because other code in it may use the same one.
#include "gl/context.h"

#include "cuda/backend.h"
#include "gl/device_choice.h"
#include "gl/numerics.h"
#include "gl/sparse_texture.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <mutex>
#include <vector>

namespace shadowdag {

namespace {

std::string eglMessage(EGLint error = eglGetError()) {
    switch (error) {
    case EGL_SUCCESS:
        return "no error given";
    case EGL_NOT_INITIALIZED:
        return "EGL_NOT_INITIALIZED";
    case EGL_BAD_ACCESS:
        return "EGL_BAD_ACCESS (a context of GLX, or one that another thread uses)";
    case EGL_BAD_ALLOC:
        return "EGL_BAD_ALLOC";
    case EGL_BAD_ATTRIBUTE:
        return "EGL_BAD_ATTRIBUTE";
    case EGL_BAD_CONFIG:
        return "EGL_BAD_CONFIG";
    case EGL_BAD_MATCH:
        return "EGL_BAD_MATCH (no OpenGL 4.5 core)";
    case EGL_CONTEXT_LOST:
        return "EGL_CONTEXT_LOST";
    default:
        return "an EGL error";
    }
}

bool hasClientExtension(const char* name) {
    return epoxy_has_egl_extension(EGL_NO_DISPLAY, name);
}

EGLContext createContext(EGLDisplay display) {
    if (!eglBindAPI(EGL_OPENGL_API))
        return EGL_NO_CONTEXT;
    EGLConfig config = EGL_NO_CONFIG_KHR;
    if (!epoxy_has_egl_extension(display, "EGL_KHR_no_config_context")) {
        const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                 EGL_PBUFFER_BIT, EGL_NONE};
        EGLint count = 0;
        if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1)
            return EGL_NO_CONTEXT;
    }
    std::vector<EGLint> attributes{
        EGL_CONTEXT_MAJOR_VERSION,       4,
        EGL_CONTEXT_MINOR_VERSION,       5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
    attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_DEBUG, EGL_TRUE});
#endif
    attributes.push_back(EGL_NONE);
    return eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
}

struct Opened {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
};

// Tries a display and appends the reason of a failure to `why`.
bool open(EGLDisplay display, const std::string& name, Opened& opened, bool& isTooOld,
          std::string& why) {
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) {
        why += "; " + name + ": " + eglMessage();
        return false;
    }
    const EGLContext context = createContext(display);
    if (context == EGL_NO_CONTEXT) {
        const EGLint error = eglGetError();
        isTooOld |= error == EGL_BAD_MATCH || error == EGL_BAD_CONFIG;
        why += "; " + name + ": " + eglMessage(error);
        return false;
    }
    opened = {display, context};
    return true;
}

// EGL keeps one list of displays per process; two threads must not open one at once.
std::mutex& openMutex() {
    static std::mutex* mutex = new std::mutex;
    return *mutex;
}

// Of this process. Guarded by openMutex.
GlDeviceChoice& deviceChoice() {
    static GlDeviceChoice* choice = new GlDeviceChoice;
    return *choice;
}

Opened openChosen() {
    Opened opened;
    EGLDeviceEXT devices[16];
    EGLint deviceCount = 0;
    const bool hasDevices = hasClientExtension("EGL_EXT_platform_device") &&
                            (hasClientExtension("EGL_EXT_device_enumeration") ||
                             hasClientExtension("EGL_EXT_device_base")) &&
                            eglQueryDevicesEXT(16, devices, &deviceCount);
    std::vector<GlDeviceChoice::Candidate> candidates;
    bool isTooOld = false; // a display answers, without such a context
    const auto add = [&](const std::string& name, EGLenum platform, void* native) {
        candidates.push_back({name, [&opened, &isTooOld, name, platform, native](std::string& why) {
                                  return open(eglGetPlatformDisplayEXT(platform, native, nullptr),
                                              name, opened, isTooOld, why);
                              }});
    };
    const auto addDevices = [&](bool isSoftware) {
        for (EGLint i = 0; hasDevices && i < deviceCount; ++i) {
            const char* extensions = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
            const bool isSoft =
                extensions &&
                std::string(extensions).find("EGL_MESA_device_software") != std::string::npos;
            if (isSoft == isSoftware)
                add("device " + std::to_string(i), EGL_PLATFORM_DEVICE_EXT, devices[i]);
        }
    };
    addDevices(false);
    if (hasClientExtension("EGL_MESA_platform_surfaceless"))
        add("surfaceless platform", EGL_PLATFORM_SURFACELESS_MESA,
            reinterpret_cast<void*>(EGL_DEFAULT_DISPLAY));
    addDevices(true);
    std::string why;
    if (!deviceChoice().open(candidates, why))
        throw Error(ErrorKind::kDevice, glAbsence(why, isTooOld));
    return opened;
}

std::string text(GLenum name) {
    const GLubyte* value = glGetString(name);
    return value ? reinterpret_cast<const char*>(value) : "";
}

#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
thread_local std::string lastMessage;

void onMessage(GLenum, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* message,
               const void*) {
    if (type == GL_DEBUG_TYPE_ERROR)
        lastMessage.assign(message, size_t(length));
}
#endif

} // namespace

struct GlContext::State {
    EGLDisplay display;
    EGLContext context;
};

GlContext::GlContext() {
    const std::lock_guard lock(openMutex());
    const bool isFirst = deviceChoice().chosen().empty();
    const Opened opened = openChosen();
    state_ = std::make_unique<State>(State{opened.display, opened.context});
    try {
        look();
    } catch (...) {
        eglDestroyContext(state_->display, state_->context);
        if (isFirst)
            deviceChoice() = {}; // nothing ran on it
        throw;
    }
}

GlContext::~GlContext() {
    eglDestroyContext(state_->display, state_->context);
}

void GlContext::look() {
    const Current current(*this);
#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(onMessage, nullptr);
#endif
    info_.vendor = text(GL_VENDOR);
    info_.renderer = text(GL_RENDERER);
    info_.version = text(GL_VERSION);
    GLint64 storage = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &storage);
    info_.maxStorageBytes = uint64_t(storage);
    GLint viewport[2] = {0, 0};
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
    GLint width = 0, height = 0, side = 0;
    glGetIntegerv(GL_MAX_FRAMEBUFFER_WIDTH, &width);
    glGetIntegerv(GL_MAX_FRAMEBUFFER_HEIGHT, &height);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    info_.maxViewport = std::min({viewport[0], viewport[1], width, height, side});
    glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &info_.vertexStorageBlocks);
    glGetIntegerv(GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS, &info_.fragmentStorageBlocks);
    glGetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &info_.computeStorageBlocks);
    glGetIntegerv(GL_MAX_COMBINED_SHADER_STORAGE_BLOCKS, &info_.combinedStorageBlocks);
    glGetIntegerv(GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS, &info_.storageBindings);
    glGetIntegerv(GL_SUBPIXEL_BITS, &info_.subpixelBits);
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &info_.maxArrayLayers);
    refuseLess(info_);
    info_.hasSparseTextures = epoxy_has_gl_extension("GL_ARB_sparse_texture");
    info_.sparsePageTexels = GlSparseArray::pageTexels();
    for (const char* name : {"GL_ARB_shader_viewport_layer_array", "GL_AMD_vertex_shader_layer"})
        if (info_.layerExtension.empty() && epoxy_has_gl_extension(name))
            info_.layerExtension = name;
    info_.drawsSparseLayers = GlSparseArray::canBeDrawnInto(info_.layerExtension);
    const GlNumerics numerics = probeGlNumerics();
    info_.hasFusedMultiplyAdd = numerics.hasFusedMultiplyAdd;
    info_.hasExactDivision = numerics.hasExactDivision;
}

void refuseLess(const GlInfo& info) {
    const auto check = [&](int has, int needs, const char* what) {
        if (has < needs)
            throw Error(ErrorKind::kDevice,
                        info.renderer + " has " + std::to_string(has) + " " + what +
                            ", and the OpenGL backend needs " + std::to_string(needs) +
                            "; use --backend cpu, or another driver (Mesa's llvmpipe needs no "
                            "device)");
    };
    check(info.vertexStorageBlocks, kGlVertexBlocks, "storage blocks per vertex shader");
    check(info.fragmentStorageBlocks, kGlFragmentBlocks, "storage blocks per fragment shader");
    check(info.computeStorageBlocks, kGlComputeBlocks, "storage blocks per compute shader");
    check(info.combinedStorageBlocks, kGlCombinedBlocks, "storage blocks per program");
    check(info.storageBindings, kGlBindings, "bindings of storage blocks");
    check(info.subpixelBits, kGlSubpixelBits, "subpixel bits of the rasterizer");
}

std::string glAbsence(const std::string& why, bool isTooOld) {
    return "EGL provides no OpenGL 4.5 without a display" +
           (why.empty() ? std::string("; it has no platform for that") : why) +
           (isTooOld
                ? "; a driver was found, but has no OpenGL 4.5 core: update it, or use another one"
                : "; install a driver with EGL") +
           " (Mesa's llvmpipe needs no device), or use --backend cpu";
}

void GlContext::finish(const char* what) const {
    glFinish();
    checkGl(what);
}

void checkGl(const char* what) {
    const GLenum error = glGetError();
    std::string message;
#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
    std::swap(message, lastMessage);
#endif
    if (error == GL_NO_ERROR && message.empty())
        return;
    if (message.empty())
        message = error == GL_OUT_OF_MEMORY ? "out of memory" : "error " + std::to_string(error);
    throw Error(error == GL_OUT_OF_MEMORY ? ErrorKind::kResource : ErrorKind::kDevice,
                std::string("OpenGL failed in ") + what + ": " + message + "; use --backend cpu");
}

/// The context that was current before.
struct GlContext::Current::Before {
    EGLDisplay display;
    EGLContext context;
    EGLSurface draw, read;
    EGLenum api;
    EGLDisplay ours;
    bool wasOurs;
};

GlContext::Current::Current(const GlContext& context)
    : before_(std::make_unique<Before>(
          Before{eglGetCurrentDisplay(), eglGetCurrentContext(), eglGetCurrentSurface(EGL_DRAW),
                 eglGetCurrentSurface(EGL_READ), eglQueryAPI(), context.state_->display, false})) {
    before_->wasOurs = before_->context == context.state_->context;
    if (before_->wasOurs)
        return;
    eglBindAPI(EGL_OPENGL_API);
    if (!eglMakeCurrent(context.state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE,
                        context.state_->context))
        throw Error(ErrorKind::kDevice,
                    "OpenGL's context could not be made current on this thread: " + eglMessage());
}

GlContext::Current::~Current() {
    if (before_->wasOurs)
        return;
    if (before_->context == EGL_NO_CONTEXT)
        eglMakeCurrent(before_->ours, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    else
        eglMakeCurrent(before_->display, before_->draw, before_->read, before_->context);
    eglBindAPI(before_->api);
}

namespace {

// The properties of GlContext() do not change while the process runs; queried once.
const GlInfo& deviceInfo() {
    static const GlInfo info = GlContext().info();
    return info;
}

bool isPresent(std::string& why) {
    try {
        deviceInfo();
        return true;
    } catch (const Error& error) {
        why = error.what();
        return false;
    }
}

// The linker keeps this file in every program that renders, because all of them use GlContext.
const bool isRegistered = registerBackend(Backend::kGl, {isPresent, glDeviceName, glDriverVersion});

} // namespace

const GlInfo& glDeviceInfo() {
    return deviceInfo();
}

std::string glDeviceName() {
    return deviceInfo().renderer;
}

std::string glDriverVersion() {
    return deviceInfo().version;
}

} // namespace shadowdag
