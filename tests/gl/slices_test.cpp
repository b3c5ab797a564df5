// SPDX-License-Identifier: Apache-2.0
#include "gl/slices.h"

#include "tests/gl/gl_device.h"

#include <thread>
#include <vector>

namespace shadowdag {
namespace {

class GlSlicesTest : public test::NeedsGl {
protected:
    ~GlSlicesTest() override { setGlPoll({}); }
};

TEST_F(GlSlicesTest, PiecesCoverAllAndAdaptToTheirTimes) {
    const GlContext context;
    const GlContext::Current current(context);
    int pollCount = 0;
    setGlPoll([&] { ++pollCount; });
    for (const uint64_t count : {0ull, 1ull, 63ull, 64ull, 1000000ull}) {
        uint64_t end = 0;
        int pieceCount = 0;
        pollCount = 0;
        GlSlices slices(context, count, "nothing");
        while (slices.next()) {
            EXPECT_EQ(slices.begin(), end);
            EXPECT_GT(slices.end(), slices.begin());
            end = slices.end();
            ++pieceCount;
        }
        EXPECT_EQ(end, count);
        EXPECT_EQ(pollCount, pieceCount) << "before every piece";
        EXPECT_LE(pieceCount, 64);
        EXPECT_FALSE(slices.next());
    }
    // A slow one: 20 ms an item, so no piece is longer than about ten.
    GlSlices slow(context, 640, "something slow");
    uint64_t longest = 0, pieces = 0;
    while (slow.next() && ++pieces < 4) {
        longest = std::max(longest, slow.end() - slow.begin());
        std::this_thread::sleep_for(std::chrono::milliseconds(20 * (slow.end() - slow.begin())));
    }
    EXPECT_LE(longest, 10u);
}

TEST_F(GlSlicesTest, AnExceptionOfThePollEndsTheWork) {
    struct Stop {};
    const GlContext context;
    const GlContext::Current current(context);
    int asked = 0;
    setGlPoll([&] {
        if (++asked == 2)
            throw Stop();
    });
    GlSlices slices(context, 100, "nothing");
    EXPECT_TRUE(slices.next());
    EXPECT_THROW(slices.next(), Stop);
    setGlPoll({});
    EXPECT_NO_THROW(context.finish("what follows"));
}

} // namespace
} // namespace shadowdag
