// SPDX-License-Identifier: Apache-2.0
// The options of frames that Backend::kGl does not support.
#pragma once

#include "hybrid/frame.h"

#include <string>

namespace shadowdag {

/// Returns a text about the options that Backend::kGl does not support, to follow "OpenGL" in a
/// sentence, with the names of the options; empty if all are supported.
std::string unfollowedByGl(const FrameOptions& options);

} // namespace shadowdag
