// SPDX-License-Identifier: Apache-2.0
// What readers say of files that they refuse.
#pragma once

#include "cuda/error.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace shadowdag::test {

/// Returns the message of the Error kInput that a call throws, or "nothing was refused".
inline std::string complaintOf(const std::function<void()>& read) {
    try {
        read();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    return "nothing was refused";
}

} // namespace shadowdag::test
