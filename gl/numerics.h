// SPDX-License-Identifier: Apache-2.0
// Properties of a device's arithmetic, determined by computing on it.
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
