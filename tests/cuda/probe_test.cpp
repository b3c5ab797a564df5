// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/probe_pass.h"

#include "cuda/buffer.h"
#include "tests/cuda/backends.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace shadowdag {
namespace {

class ProbeOn : public OnBackend {};

// Hashes of float results were seen to differ where the compiler may fuse a * b + c.
TEST_P(ProbeOn, GivesTheBitsOfUnfusedArithmetic) {
    const unsigned seed = 20'260;
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-4.0f, 4.0f);
    constexpr size_t kCount = 1 << 20; // too large to be staged
    std::vector<float> a(kCount), b(kCount);
    for (size_t i = 0; i < kCount; ++i) {
        a[i] = uniform(random);
        b[i] = uniform(random);
    }
    Buffer<float> deviceA(GetParam(), "test/a"), deviceB(GetParam(), "test/b"),
        deviceOut(GetParam(), "test/out", kCount);
    deviceA.upload(a);
    deviceB.upload(b);
    probe(GetParam(), deviceA.view(), deviceB.view(), deviceOut.view());
    const std::vector<float> out = deviceOut.download();

    // Each step through a volatile: rounded on its own, whatever the flags.
    size_t differing = 0;
    for (size_t i = 0; i < kCount; ++i) {
        volatile float ab = a[i] * b[i];
        volatile float product = ab + a[i];
        volatile float square = product * product;
        volatile float bb = b[i] * b[i];
        volatile float sum = square + bb;
        volatile float root = std::sqrt(sum);
        volatile float scaled = b[i] * product;
        volatile float denominator = 1.0f + scaled;
        const float expected = root / denominator;
        differing += std::bit_cast<uint32_t>(expected) != std::bit_cast<uint32_t>(out[i]);
    }
    EXPECT_EQ(differing, 0u);
}

INSTANTIATE_TEST_SUITE_P(Both, ProbeOn, kBothBackends, backendSuffix);

TEST(Probe, CudaInAProgramWithoutItIsADeviceError) {
    if (builtWithCuda())
        GTEST_SKIP() << "this program was built with CUDA";
    try {
        probe(Backend::kCuda, {}, {}, {});
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDevice);
    }
}

} // namespace
} // namespace shadowdag
