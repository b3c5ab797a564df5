// SPDX-License-Identifier: Apache-2.0
// Tells a thread that the system does not give from other failures, across libraries.
#pragma once

#include <exception>
#include <string_view>
#include <system_error>

namespace shadowdag {

/// Returns whether an exception of any library says that the system refuses a thread, or memory
/// for one. It is then no fault of an input that is being read.
inline bool saysNoThread(const std::exception& exception) {
    const auto* const failed = dynamic_cast<const std::system_error*>(&exception);
    return (failed && (failed->code() == std::errc::resource_unavailable_try_again ||
                       failed->code() == std::errc::not_enough_memory)) ||
           std::string_view(exception.what()).starts_with("pthread_create"); // of oneTBB
}

} // namespace shadowdag
