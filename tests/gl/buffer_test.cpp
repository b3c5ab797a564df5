// SPDX-License-Identifier: Apache-2.0
#include "gl/buffer.h"

#include "cuda/buffer.h"
#include "tests/gl/gl_device.h"

#include <gmock/gmock.h>

namespace shadowdag {
namespace {

class GlBufferTest : public test::NeedsGl {
protected:
    void SetUp() override {
        test::NeedsGl::SetUp();
        if (IsSkipped())
            return;
        context = std::make_unique<GlContext>();
        current = std::make_unique<GlContext::Current>(*context);
    }
    std::unique_ptr<GlContext> context;
    std::unique_ptr<GlContext::Current> current;
};

uint64_t held(const std::string& name) {
    for (const LedgerEntry& entry : bufferLedger())
        if (entry.name == name && entry.backend == Backend::kGl)
            return entry.bytes;
    return 0;
}

TEST_F(GlBufferTest, ContainsTheUploadedData) {
    GlBuffer buffer("test words");
    const std::vector<uint32_t> words{3, 1, 4, 1, 5};
    buffer.upload(words);
    EXPECT_EQ(buffer.download<uint32_t>(), words);
    buffer.fill(7);
    EXPECT_THAT(buffer.download<uint32_t>(), testing::Each(7u));
    const uint32_t nine = 9;
    buffer.write(8, &nine, sizeof nine);
    EXPECT_THAT(buffer.download<uint32_t>(), testing::ElementsAre(7, 7, 9, 7, 7));
}

TEST_F(GlBufferTest, GrowsAndKeepsItsContentOnRequest) {
    GlBuffer buffer("test growing");
    buffer.upload(std::vector<uint32_t>{1, 2, 3});
    buffer.resize(1000 * sizeof(uint32_t), true);
    const std::vector<uint32_t> all = buffer.download<uint32_t>();
    EXPECT_EQ(all.size(), 1000u);
    EXPECT_EQ(std::vector<uint32_t>(all.begin(), all.begin() + 3),
              (std::vector<uint32_t>{1, 2, 3}));
}

TEST_F(GlBufferTest, IsInTheLedgerDuringItsLifetime) {
    {
        GlBuffer buffer("test ledger");
        buffer.resize(4096);
        EXPECT_GE(held("test ledger"), 4096u);
    }
    EXPECT_EQ(held("test ledger"), 0u);
}

TEST_F(GlBufferTest, MoreThanShadersReachIsRefusedByName) {
    GlBuffer buffer("test giant");
    try {
        buffer.resize(context->info().maxStorageBytes + 4);
        FAIL() << "allocated";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_THAT(error.what(), testing::HasSubstr("test giant"));
    }
}

} // namespace
} // namespace shadowdag
