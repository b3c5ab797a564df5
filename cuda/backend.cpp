// SPDX-License-Identifier: Apache-2.0
// Chooses the backend at run time.
#include "cuda/backend.h"

#include "cuda/device.h"
#include "cuda/timer.h"

namespace shadowdag {

const char* backendName(Backend backend) {
    return backend == Backend::kCuda ? "cuda" : "cpu";
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
    if (name != "auto" && name != "cuda")
        throw Error(ErrorKind::kUsage, "unknown backend '" + name + "'; use auto, cpu or cuda");
    std::string why;
    if (device::isPresent(why))
        return Backend::kCuda;
    if (name == "auto")
        return Backend::kCpu;
    throw Error(ErrorKind::kDevice, "backend 'cuda' was asked for, but " + why);
}

std::string deviceName(Backend backend) {
    return backend == Backend::kCuda ? device::name() : "";
}

std::string driverVersion(Backend backend) {
    return backend == Backend::kCuda ? device::driverVersion() : "";
}

void throwBuiltWithoutCuda() {
    throw Error(ErrorKind::kDevice,
                "a pass was asked to run on CUDA, but this program was built without it; configure "
                "with -DSDAG_CUDA=ON on a machine with the CUDA toolkit, or use --backend cpu");
}

void synchronize(Backend backend) {
    if (backend == Backend::kCuda)
        device::synchronize();
}

} // namespace shadowdag
