// SPDX-License-Identifier: Apache-2.0
#include "tools/journal.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"

#include <gtest/gtest.h>

namespace shadowdag {

TEST(Journal, ResumeTakesUpWhatWasFinished) {
    const TemporaryDirectory directory;
    const std::string path = directory / "j.json";
    {
        Journal journal(path, "key", false);
        journal.set("a", {{"x", 1.5}});
    }
    const Journal resumed(path, "key", true);
    EXPECT_EQ(resumed.takenUpCount(), 1u);
    ASSERT_NE(resumed.find("a"), nullptr);
    EXPECT_EQ((*resumed.find("a"))["x"], 1.5);
    EXPECT_EQ(resumed.find("b"), nullptr);
    EXPECT_EQ(Journal(path, "key", false).find("a"), nullptr);
}

TEST(Journal, AnotherComparesJournalIsRefused) {
    const TemporaryDirectory directory;
    const std::string path = directory / "j.json";
    Journal(path, "key", false).set("a", 1);
    try {
        Journal(path, "other", true);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    }
    for (const char* text : {"", "[]", "{\"key\": \"key\"}", "{\"key\": \"key\", \"parts\": 3}"}) {
        writeText(path, text);
        try {
            Journal(path, "key", true);
            ADD_FAILURE() << "accepted: " << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
        }
    }
}

} // namespace shadowdag
