// SPDX-License-Identifier: Apache-2.0
// Chooses the backend at run time.
#include "cuda/backend.h"

#include "cuda/device.h"
#include "cuda/macros.h"
#include "cuda/timer.h"

namespace shadowdag {

namespace {

// Of OpenGL; zero-initialized before any registerBackend runs.
BackendEntry glBackendEntry;

} // namespace

const char* backendName(Backend backend) {
    return backend == Backend::kCuda ? "cuda" : backend == Backend::kGl ? "gl" : "cpu";
}

bool registerBackend(Backend backend, const BackendEntry& room) {
    SDAG_ASSERT(backend == Backend::kGl);
    glBackendEntry = room;
    return backend == Backend::kGl;
}

bool builtWithCuda() {
#if defined(SDAG_WITH_CUDA)
    return true;
#else
    return false;
#endif
}

Backend chooseBackend(const std::string& name) {
    if (name == "cpu")
        return Backend::kCpu;
    if (name != "auto" && name != "cuda" && name != "gl")
        throw Error(ErrorKind::kUsage, "unknown backend '" + name + "'; use auto, cpu, cuda or gl");
    std::string why;
    if (name == "gl") {
        if (glBackendEntry.isPresent && glBackendEntry.isPresent(why))
            return Backend::kGl;
        throw Error(ErrorKind::kDevice,
                    "backend 'gl' is not available: " +
                        (glBackendEntry.isPresent ? why : "this program was built without OpenGL"));
    }
    if (device::isPresent(why))
        return Backend::kCuda;
    if (name == "auto")
        return Backend::kCpu;
    throw Error(ErrorKind::kDevice, "backend 'cuda' is not available: " + why);
}

std::string deviceName(Backend backend) {
    if (backend == Backend::kGl && glBackendEntry.deviceName)
        return glBackendEntry.deviceName();
    return backend == Backend::kCuda ? device::name() : "";
}

std::string driverVersion(Backend backend) {
    if (backend == Backend::kGl && glBackendEntry.driverVersion)
        return glBackendEntry.driverVersion();
    return backend == Backend::kCuda ? device::driverVersion() : "";
}

void throwBuiltWithoutCuda() {
    throw Error(ErrorKind::kDevice,
                "a pass cannot run on CUDA, because this program was built without it; configure "
                "with -DSDAG_CUDA=ON on a machine with the CUDA toolkit, or use --backend cpu");
}

void synchronize(Backend backend) {
    if (backend == Backend::kCuda)
        device::synchronize();
}

} // namespace shadowdag
