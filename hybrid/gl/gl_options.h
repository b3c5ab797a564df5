// SPDX-License-Identifier: Apache-2.0
// What frames of Backend::kGl do not follow.
#pragma once

#include "hybrid/frame.h"

#include <string>

namespace shadowdag {

/// Returns what of the options frames of Backend::kGl do not follow, as what follows "OpenGL" in a
/// sentence, with the options that ask for it; empty where they follow all.
std::string unfollowedByGl(const FrameOptions& options);

} // namespace shadowdag
