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

// "a<U+202E>gpj.exe" would be shown as "aexe.jpg".
TEST(Printable, FormatCharactersOfUnicodeAreEscapedAndOthersAreKept) {
    EXPECT_EQ(printable("a\u202egpj.exe"), "a\\xe2\\x80\\xaegpj.exe");
    for (const char* text :
         {"\u00ad", "\u061c",     "\u200b",     "\u200d",     "\u200f",     "\u2028",    "\u2029",
          "\u202a", "\u202e",     "\u2060",     "\u2066",     "\u2069",     "\u206f",    "\ufeff",
          "\ufff9", "\U00013430", "\U0001343f", "\U0001d173", "\U000e0001", "\U000e007f"})
        EXPECT_EQ(printable(text).substr(0, 2), "\\x") << printable(text);
    // Number signs, which have a shape, and those that are invisible for another reason: variation
    // selectors, U+034F and fillers of Hangul.
    for (const char* text : {"\u00ac", "\u00ae", "\u061b", "\u0600", "\u200a", "\u2010", "\u2027",
                             "\u202f", "\u2070", "\ufffd", "\U00013440", "\U0001f600", "\U000e0100",
                             "\ufe0f", "\u034f", "\u115f", "\u3164"})
        EXPECT_EQ(printable(text), text);
}

} // namespace
} // namespace shadowdag
