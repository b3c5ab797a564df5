// SPDX-License-Identifier: Apache-2.0
#include "cuda/readback.h"

#include "cuda/buffer.h"
#include "cuda/list_length.h"
#include "tests/cuda/backends.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace shadowdag {
namespace {

class ReadbackOn : public OnBackend {};

TEST_P(ReadbackOn, ContainsTheDataAtTheTimeOfTheRequest) {
    Buffer<uint32_t> words(GetParam(), "test/words");
    Readback readback(GetParam(), 3);
    for (uint32_t i = 0; i < 3; ++i) {
        words.upload(std::vector<uint32_t>(i + 1, 7 + i));
        const HostCopyCounts before = hostCopyCounts();
        readback.request(std::as_const(words).view());
        EXPECT_EQ(hostCopyCounts().readbackCount, before.readbackCount + 1);
        words.fill(0xff); // later work does not reach it
        const View<const uint32_t> found = readback.wait();
        EXPECT_EQ(std::vector<uint32_t>(found.begin(), found.end()),
                  std::vector<uint32_t>(i + 1, 7 + i));
    }
}

INSTANTIATE_TEST_SUITE_P(Both, ReadbackOn, kBothBackends, backendSuffix);

TEST(LengthGuess, IsEmptyAtFirstAndThenExceedsTheLastLengthSlightly) {
    LengthGuess guess;
    EXPECT_EQ(guess.get(), 0u);
    guess.note(800);
    static_assert(LengthGuess::kSpare == 1024);
    EXPECT_EQ(guess.get(), 1924u);
    guess.note(0); // shrinks by a sixteenth at most
    EXPECT_EQ(guess.get(), 1924 - 1924 / 16);
    for (int i = 0; i < 40; ++i)
        guess.note(0);
    EXPECT_EQ(guess.get(), LengthGuess::kSpare);
    guess.forget(1);
    EXPECT_EQ(guess.get(), 0u);
    guess.note(8);
    EXPECT_EQ(guess.get(), 10u);
}

} // namespace
} // namespace shadowdag
