// SPDX-License-Identifier: Apache-2.0
#include "scenes/json_text.h"

#include <cctype>

namespace shadowdag {

std::string whyNoUtf8(std::string_view text) {
    const auto isZero = [&](size_t i) { return text[i] == 0; };
    const bool isUtf16 = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") ||
                         (text.size() > 1 && isZero(0) != isZero(1) &&
                          (text.size() < 4 || (isZero(2) == isZero(0) && isZero(3) == isZero(1))));
    return isUtf16 ? "is UTF-16; save it as UTF-8" : "";
}

bool isNoNumber(std::string_view text, size_t byte) {
    constexpr size_t kMostLetters = 8; // of "infinity"
    const auto isLetter = [&](size_t i) {
        return i < text.size() && std::isalpha(static_cast<unsigned char>(text[i]));
    };
    if (byte < text.size() && (text[byte] == '-' || text[byte] == '+'))
        ++byte;
    for (size_t i = 0; i < kMostLetters && byte > 0 && isLetter(byte - 1); ++i)
        --byte;
    std::string word;
    for (; isLetter(byte) && word.size() <= kMostLetters; ++byte)
        word += char(std::tolower(static_cast<unsigned char>(text[byte])));
    return word == "nan" || word == "inf" || word == "infinity";
}

} // namespace shadowdag
