// SPDX-License-Identifier: Apache-2.0
// Starts Embree.
#pragma once

#include "hybrid/rays/embree_version.h"

namespace shadowdag {

/// Returns a new device, which the caller releases. Throws Error kResource with Embree's reason if
/// there is none. @param config as rtcNewDevice takes it
RTCDevice newEmbreeDevice(const char* config = nullptr);

} // namespace shadowdag
