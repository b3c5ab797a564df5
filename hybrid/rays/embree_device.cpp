// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/embree_device.h"

#include "cuda/error.h"

#include <string>

namespace shadowdag {

RTCDevice newEmbreeDevice(const char* config) {
    if (const RTCDevice device = rtcNewDevice(config))
        return device;
    const RTCError reason = rtcGetDeviceError(nullptr);
    throw Error(ErrorKind::kResource,
                reason == RTC_ERROR_OUT_OF_MEMORY
                    ? "not enough memory to start Embree; give the process more"
                    : "Embree cannot start (code " + std::to_string(reason) +
                          "); it needs libembree 3.13 or 4 and a processor with AVX2");
}

} // namespace shadowdag
