// SPDX-License-Identifier: Apache-2.0
// Tests the comparison of parity with differences planted in copies of a snapshot.
#include "tests/cuda/parity.h"

#include "tests/cuda/backends.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace shadowdag {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// What the arrays below hold.
struct Contents {
    std::vector<uint32_t> ids = {7, 8, 9};
    std::vector<uint64_t> codes = {1, uint64_t(1) << 40};
    std::vector<uint8_t> answers = {0, 255, 127};
    std::vector<glm::vec3> colors = {{0.0f, 1.0f, 100.0f}, {kNan, kInfinity, -1.0f}};
    uint64_t count = 5;

    Snapshot snapshot() const {
        Snapshot s;
        s.under("frame 1: ");
        s.add("ids", ids);
        s.add("codes", codes);
        s.add("answers", answers);
        s.addNear("colors", colors, 1e-4);
        s.add("count", count);
        return s;
    }
};

/// Returns what is found after `plant` changed a copy.
template <class Plant> std::string foundAfter(const Plant& plant) {
    const Contents expected;
    Contents actual;
    plant(actual);
    return firstDifference(expected.snapshot(), actual.snapshot());
}

TEST(Parity, OfEqualSnapshotsFindsNothing) {
    EXPECT_EQ(foundAfter([](Contents&) {}), "");
    EXPECT_EQ(firstDifference({}, {}), "");
}

TEST(Parity, FindsOneBitOfAnyWord) {
    EXPECT_EQ(foundAfter([](Contents& c) { c.ids[1] ^= 1u; }),
              "'frame 1: ids' differs in 1 of 3 elements, first in 1 (word 0): 00000009 instead of "
              "00000008");
    EXPECT_THAT(foundAfter([](Contents& c) { c.codes[1] ^= uint64_t(1) << 63; }),
                AllOf(HasSubstr("'frame 1: codes'"), HasSubstr("first in 1 (word 1): 80000100")));
    EXPECT_THAT(foundAfter([](Contents& c) { c.answers[2] = 128; }),
                HasSubstr("'frame 1: answers' differs in 1 of 3"));
    EXPECT_THAT(foundAfter([](Contents& c) { c.count = uint64_t(1) << 32 | 5; }),
                HasSubstr("'frame 1: count'"));
}

TEST(Parity, NamesTheFirstArrayAndCountsTheRest) {
    const std::string found = foundAfter([](Contents& c) {
        c.codes = {3, 4};
        c.answers.clear();
        c.count = 0;
    });
    EXPECT_THAT(found, AllOf(HasSubstr("'frame 1: codes' differs in 2 of 2"),
                             HasSubstr("2 later arrays differ as well")));
}

TEST(Parity, FindsMissingArraysAndOtherLengths) {
    EXPECT_EQ(foundAfter([](Contents& c) { c.ids.push_back(0); }),
              "'frame 1: ids' has 4 elements instead of 3");
    EXPECT_EQ(foundAfter([](Contents& c) { c.colors.pop_back(); }),
              "'frame 1: colors' has 1 elements instead of 2");
    Snapshot one, two;
    one.add("a", 1);
    EXPECT_EQ(firstDifference(one, two), "0 arrays instead of 1");
    two.add("b", 1);
    EXPECT_EQ(firstDifference(one, two), "array 'b' instead of 'a'");
}

// 1e-4 of the larger of 1 and the value: 1e-4 beside 0 and 1, 1e-2 beside 100.
TEST(Parity, AllowsFloatsTheirToleranceOnly) {
    const auto at = [](size_t element, int axis, float value) {
        return foundAfter([&](Contents& c) { c.colors[element][axis] = value; });
    };
    EXPECT_EQ(at(0, 0, 0.99e-4f), "");
    EXPECT_THAT(at(0, 0, -1.01e-4f), HasSubstr("differs in 1 of 2 elements, first in 0 (word 0)"));
    EXPECT_EQ(at(0, 1, 1.00009f), "");
    EXPECT_THAT(at(0, 1, 1.00011f), HasSubstr("(word 1)"));
    EXPECT_EQ(at(0, 2, 100.009f), "");
    EXPECT_THAT(at(0, 2, 100.011f), HasSubstr("(word 2)"));
    EXPECT_EQ(at(1, 0, -kNan), "") << "any NaN is as good";
    EXPECT_THAT(at(1, 0, 0.0f), HasSubstr("first in 1"));
    EXPECT_THAT(at(0, 0, kNan), HasSubstr("first in 0"));
    EXPECT_THAT(at(1, 1, -kInfinity), HasSubstr("first in 1 (word 1)"));
    EXPECT_THAT(at(1, 1, std::numeric_limits<float>::max()), HasSubstr("first in 1 (word 1)"));
}

class SnapshotOn : public OnBackend {};

TEST_P(SnapshotOn, OfABufferHoldsWhatWasUploaded) {
    const std::vector<uint32_t> words = {3, 1, 4};
    Buffer<uint32_t> buffer(GetParam(), "test/snapshot");
    buffer.upload(words);
    Snapshot expected, actual;
    expected.add("words", words);
    actual.add("words", buffer);
    EXPECT_EQ(firstDifference(expected, actual), "");
}

INSTANTIATE_TEST_SUITE_P(Both, SnapshotOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
