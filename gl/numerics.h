// SPDX-License-Identifier: Apache-2.0
// How a device computes, found by computing.
#pragma once

namespace shadowdag {

/// See GlInfo.
struct GlNumerics {
    bool hasFusedMultiplyAdd = false;
    bool hasExactDivision = false;
};

/// Asks the device of the current context: products and quotients whose last bit tells.
GlNumerics probeGlNumerics();

} // namespace shadowdag
