// SPDX-License-Identifier: Apache-2.0
// Properties of a device's arithmetic, determined by computing on it.
#pragma once

namespace shadowdag {

/// See GlInfo.
struct GlNumerics {
    bool hasFusedMultiplyAdd = false;
    bool hasExactDivision = false;
};

/// Tests the device of the current context with products and quotients whose last bit shows the
/// rounding.
GlNumerics probeGlNumerics();

} // namespace shadowdag
