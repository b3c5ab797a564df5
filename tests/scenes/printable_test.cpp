// SPDX-License-Identifier: Apache-2.0
#include "scenes/printable.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

TEST(Printable, ControlCharactersAreEscapedAndOtherTextIsKept) {
    using namespace std::string_view_literals;
    EXPECT_EQ(printable("a\x1b[31m\0b\x7f\r"sv), R"(a\x1b[31m\x00b\x7f\x0d)");
    EXPECT_EQ(printable("\xc2\x9b"), R"(\xc2\x9b)"); // a terminal's other way to begin a sequence
    EXPECT_EQ(printable("\x9b \xe2\x80 \x80"), "\\x9b \xe2\\x80 \\x80"); // the same in 8 bits
    EXPECT_EQ(printable("\xe0\x82\x9b \xf0\x80\x82\x9b"), // the same in too many bytes
              "\xe0\\x82\\x9b \xf0\\x80\\x82\\x9b");
    for (const std::string_view text :
         {"tabs\tand lines\n"sv, "n\xc3\xb6 \xe2\x80\x9c \xf0\x9f\x98\x80"sv,
          "not UTF-8 \xff\xc2"sv, "\xc2\xa0"sv, ""sv})
        EXPECT_EQ(printable(text), text);
    EXPECT_EQ(printableLine("a\nb\tc\x1b"), "a\\x0ab\tc\\x1b");
}

} // namespace
} // namespace shadowdag
