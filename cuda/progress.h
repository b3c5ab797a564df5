// SPDX-License-Identifier: Apache-2.0
// How long-running host work reports its progress.
#pragma once

#include <functional>

namespace shadowdag {

/// Called from one thread at a time with the finished fraction in [0, 1], never decreasing. An
/// empty function is allowed everywhere and means that nothing is reported.
using Progress = std::function<void(double fraction)>;

} // namespace shadowdag
