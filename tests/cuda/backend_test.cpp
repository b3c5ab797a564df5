// SPDX-License-Identifier: Apache-2.0
#include "cuda/backend.h"

#include "cuda/buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using testing::HasSubstr;

// Returns the Error that chooseBackend throws for `name`; fails the test if it throws none.
Error errorOf(const std::string& name) {
    try {
        chooseBackend(name);
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "no error for '" << name << "'";
    return Error(ErrorKind::kUsage, "");
}

TEST(Backend, CpuIsAlwaysAvailable) {
    EXPECT_EQ(chooseBackend("cpu"), Backend::kCpu);
    EXPECT_STREQ(backendName(Backend::kCpu), "cpu");
    EXPECT_STREQ(backendName(Backend::kCuda), "cuda");
}

TEST(Backend, AutoNeverFails) {
    EXPECT_NO_THROW(chooseBackend("auto"));
}

TEST(Backend, UnknownNameIsAUsageErrorThatListsTheChoices) {
    for (const char* name : {"", "CPU", "gpu", "cuda "}) {
        const Error error = errorOf(name);
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), HasSubstr("'" + std::string(name) + "'"));
        EXPECT_THAT(error.what(), HasSubstr("auto, cpu, cuda or gl"));
    }
}

// OpenGL's room says what there is (tests/gl); a program without that room says so.
TEST(Backend, OpenGlWithoutItsLibraryIsADeviceError) {
    const Error error = errorOf("gl");
    EXPECT_EQ(error.kind(), ErrorKind::kDevice);
    EXPECT_THAT(error.what(), HasSubstr("built without OpenGL"));
    EXPECT_STREQ(backendName(Backend::kGl), "gl");
    EXPECT_EQ(deviceName(Backend::kGl), "");
}

TEST(Backend, CudaWithoutADeviceIsADeviceErrorWithReasonAndRemedy) {
    if (chooseBackend("auto") == Backend::kCuda)
        GTEST_SKIP() << "a CUDA device is present";
    const Error error = errorOf("cuda");
    EXPECT_EQ(error.kind(), ErrorKind::kDevice);
    EXPECT_THAT(error.what(), HasSubstr("--backend cpu"));
    EXPECT_THAT(error.what(), HasSubstr(builtWithCuda() ? "driver" : "built without CUDA"));
}

TEST(Backend, BufferOnAnAbsentDeviceIsADeviceErrorAndLeavesNoLedgerEntry) {
    if (builtWithCuda())
        GTEST_SKIP() << "this program was built with CUDA";
    try {
        Buffer<int> buffer(Backend::kCuda, "test/absent device", 8);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDevice);
        EXPECT_THAT(error.what(), HasSubstr("SDAG_CUDA=ON"));
    }
    for (const LedgerEntry& entry : bufferLedger())
        EXPECT_NE(entry.name, "test/absent device");
}

} // namespace
} // namespace shadowdag
