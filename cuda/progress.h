// SPDX-License-Identifier: Apache-2.0
// How long-running host work tells its caller how far it is.
#pragma once

#include <functional>

namespace shadowdag {

/// Called from one thread at a time with the finished fraction in [0, 1], never decreasing. An
/// empty function is allowed everywhere and means that nobody listens.
using Progress = std::function<void(double fraction)>;

} // namespace shadowdag
