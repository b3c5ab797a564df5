// SPDX-License-Identifier: Apache-2.0
// Runs a test on both backends: the CUDA half skips with the reason if there is no device.
#pragma once

#include "cuda/backend.h"

#include <gtest/gtest.h>

#include <ostream>

namespace shadowdag {

/// Prints the parameter in the names of tests.
inline void PrintTo(Backend backend, std::ostream* out) {
    *out << backendName(backend);
}

/// A test suite over both backends. Use with TEST_P and INSTANTIATE_TEST_SUITE_P over
/// kBothBackends.
class OnBackend : public testing::TestWithParam<Backend> {
protected:
    void SetUp() override {
        if (GetParam() != Backend::kCuda)
            return;
        try {
            chooseBackend("cuda");
        } catch (const Error& error) {
            GTEST_SKIP() << error.what();
        }
    }
};

/// Returns whether the host plays the device (tests/cuda/host): then it is as fast as a CPU.
inline bool isPlayedByHost(Backend backend) {
    return backend == Backend::kCuda && deviceName(backend) == "CUDA played by the host";
}

inline const auto kBothBackends = testing::Values(Backend::kCpu, Backend::kCuda);

/// Returns "cpu" or "cuda" as the last part of the test's name.
inline std::string backendSuffix(const testing::TestParamInfo<Backend>& info) {
    return backendName(info.param);
}

} // namespace shadowdag
