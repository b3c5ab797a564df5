// SPDX-License-Identifier: Apache-2.0
// The two processors, and how one is chosen at run time.
#pragma once

#include "cuda/error.h"

#include <string>

namespace shadowdag {

/// Where passes run and buffers live. kGl is the paper's own hardware path: frames that rasterize
/// and shade by OpenGL, over passes and buffers of the CPU (passBackend).
enum class Backend { kCpu, kCuda, kGl };

/// Returns "cpu", "cuda" or "gl".
const char* backendName(Backend backend);

/// Returns where the passes of a frame on `backend` run and its buffers live: itself, or the CPU
/// for OpenGL.
constexpr Backend passBackend(Backend backend) {
    return backend == Backend::kGl ? Backend::kCpu : backend;
}

/// Returns the backend that `name` ("auto", "cpu", "cuda" or "gl") selects on this machine. "auto"
/// is CUDA if the program was built with it and finds a device, else the CPU, never OpenGL. Throws
/// Error kUsage for another name, kDevice for "cuda" without a device or a CUDA build and for "gl"
/// without OpenGL 4.5, with the driver's own message.
Backend chooseBackend(const std::string& name);

/// The functions that an optional backend, which another folder implements, registers.
struct BackendEntry {
    bool (*isPresent)(std::string& why) = nullptr;
    std::string (*deviceName)() = nullptr;
    std::string (*driverVersion)() = nullptr;
};

/// Registers a backend of another folder, before main; returns true.
bool registerBackend(Backend backend, const BackendEntry& room);

/// Returns whether this program contains the CUDA passes (not whether a device is present).
bool builtWithCuda();

/// Returns the name of the device that a backend uses and the version of its driver: for CUDA as in
/// "13.0", for OpenGL the driver's own text; empty for the CPU. Throws Error kDevice.
std::string deviceName(Backend backend);
std::string driverVersion(Backend backend);

/// Limits the CPU backend to `count` threads for the rest of the process; 0 means all cores.
/// Results never depend on it.
void setThreadCount(int count);

/// Returns the number of threads that the CPU backend uses.
int threadCount();

/// Throws Error kDevice: a pass was requested on CUDA in a program built without it.
[[noreturn]] void throwBuiltWithoutCuda();

/// Names the backend in template arguments, so that host and device instantiations never share a
/// symbol (the linker would keep one of them, silently).
struct CpuTag {};
struct CudaTag {};

} // namespace shadowdag
