// SPDX-License-Identifier: Apache-2.0
#include "scenes/data_uri.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

namespace shadowdag {
namespace {

using testing::HasSubstr;

std::string textOf(const std::string& uri) {
    const DataUri data = decodeDataUri(uri);
    EXPECT_EQ(data.problem, "") << uri;
    return {data.bytes.begin(), data.bytes.end()};
}

// The vectors of RFC 4648, sec. 10.
TEST(DataUri, Base64IsDecodedWithAndWithoutPadding) {
    for (const auto& [base64, text] :
         std::initializer_list<std::pair<std::string, std::string>>{{"Zg==", "f"},
                                                                    {"Zm8=", "fo"},
                                                                    {"Zm9v", "foo"},
                                                                    {"Zm9vYg==", "foob"},
                                                                    {"Zm9vYmE=", "fooba"},
                                                                    {"Zm9vYmFy", "foobar"}}) {
        EXPECT_EQ(textOf("data:;base64," + base64), text);
        EXPECT_EQ(textOf("data:;base64," + base64.substr(0, base64.find('='))), text);
        EXPECT_EQ(textOf("data:;base64, " + base64 + "\r\n"), text);
    }
    EXPECT_EQ(textOf("data:;base64,+/%2b%2F"), "\xfb\xff\xbf");
}

TEST(DataUri, SchemeAndEncodingAreReadInAnyCase) {
    EXPECT_TRUE(isDataUri("data:"));
    EXPECT_TRUE(isDataUri("DaTa:image/png;base64,"));
    EXPECT_FALSE(isDataUri("data"));
    EXPECT_FALSE(isDataUri("data.bin"));
    EXPECT_FALSE(isDataUri("a/data:"));
    EXPECT_EQ(textOf("DATA:Text/Plain;Charset=\"a\";BASE64,Zm9v"), "foo");
}

TEST(DataUri, WhatCannotBeReadHasItsProblem) {
    for (const auto& [uri, problem] : std::initializer_list<std::pair<const char*, const char*>>{
             {"data:", "has no comma"},
             {"data:text/plain;base64", "has no comma"},
             {"data:,", "is not base64"},
             {"data:text/plain,foo", "is not base64"},
             {"data:xbase64,Zm9v", "is not base64"},
             {"data:;base64,", "is empty"},
             {"data:;base64,====", "is empty"},
             {"data:;base64,Zm9vY", "ends within a byte"},
             {"data:;base64,Zm9v-_", "has '-' in its base64"},
             {"data:;base64,Zg==Zg==", "has 'Z' in its base64 after the padding"}}) {
        const DataUri data = decodeDataUri(uri);
        EXPECT_THAT(data.problem, HasSubstr("its data URI " + std::string(problem))) << uri;
        EXPECT_TRUE(data.bytes.empty()) << uri;
    }
}

TEST(DataUri, PercentEncodingIsDecoded) {
    EXPECT_EQ(decodeUri("a%20b%2Fc"), "a b/c");
    EXPECT_EQ(decodeUri("%"), "%");
    EXPECT_EQ(decodeUri("%4"), "%4");
    EXPECT_EQ(decodeUri("%zz%41"), "%zzA");
}

} // namespace
} // namespace shadowdag
