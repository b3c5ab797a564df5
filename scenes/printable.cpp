// SPDX-License-Identifier: Apache-2.0
#include "scenes/printable.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace shadowdag {

namespace {

/// Returns the number of bytes of the UTF-8 sequence at the beginning of a text, 1 to 4; 1 if there
/// is none.
size_t sequenceLength(std::string_view text) {
    const auto first = static_cast<unsigned char>(text[0]);
    const size_t length = first < 0xc2 ? 1 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
    if (first > 0xf4 || length > text.size() ||
        !std::all_of(text.begin() + 1, text.begin() + std::ptrdiff_t(length),
                     [](char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }))
        return 1;
    // Overlong forms, surrogates and what is beyond Unicode are not UTF-8.
    const auto second = length > 1 ? static_cast<unsigned char>(text[1]) : 0;
    const bool isValid = first == 0xe0   ? second >= 0xa0
                         : first == 0xed ? second < 0xa0
                         : first == 0xf0 ? second >= 0x90
                         : first == 0xf4 ? second < 0x90
                                         : true;
    return isValid ? length : 1;
}

/// Returns the character of a UTF-8 sequence; a byte of its own for any other.
char32_t characterOf(std::string_view sequence) {
    const auto first = static_cast<unsigned char>(sequence[0]);
    char32_t character = sequence.size() == 1 ? first : first & (0x7fu >> sequence.size());
    for (const char byte : sequence.substr(1))
        character = character << 6 | (static_cast<unsigned char>(byte) & 0x3fu);
    return character;
}

/// Returns whether a terminal obeys a character instead of showing it: a control or a format
/// character. Source: Unicode 15.1, general categories Cc, Cf, Zl and Zp, without the number signs
/// and other marks of Cf that have a shape (property Prepended_Concatenation_Mark).
bool isControl(char32_t character) {
    constexpr std::pair<char32_t, char32_t> kRanges[] = {
        {0x0, 0x1f},        {0x7f, 0x9f},       {0xad, 0xad},       {0x61c, 0x61c},
        {0x180e, 0x180e},   {0x200b, 0x200f},   {0x2028, 0x202e},   {0x2060, 0x206f},
        {0xfeff, 0xfeff},   {0xfff9, 0xfffb},   {0x13430, 0x1343f}, {0x1bca0, 0x1bca3},
        {0x1d173, 0x1d17a}, {0xe0000, 0xe007f},
    };
    return std::any_of(std::begin(kRanges), std::end(kRanges), [&](const auto& range) {
        return character >= range.first && character <= range.second;
    });
}

constexpr const char* kDigits = "0123456789abcdef";

/// Returns the text with its control characters escaped, except those of `kept`.
std::string escaped(std::string_view text, std::string_view kept) {
    std::string shown;
    while (!text.empty()) {
        const std::string_view sequence = text.substr(0, sequenceLength(text));
        text.remove_prefix(sequence.size());
        // A byte that is no UTF-8 is a character of 8 bits; only below 0xa0 are they controls.
        const char32_t character = characterOf(sequence);
        const bool isShown = !isControl(character) || (sequence.size() == 1 && character >= 0xa0) ||
                             kept.find(sequence) != std::string_view::npos;
        for (const char byte : sequence)
            if (isShown)
                shown += byte;
            else
                shown +=
                    {'\\', 'x', kDigits[static_cast<unsigned char>(byte) >> 4], kDigits[byte & 15]};
    }
    return shown;
}

} // namespace

std::string printable(std::string_view text) {
    return escaped(text, "\t\n");
}

std::string printableLine(std::string_view text) {
    return escaped(text, "\t");
}

std::string utf8Of(std::string_view text) {
    std::string shown;
    while (!text.empty()) {
        const std::string_view sequence = text.substr(0, sequenceLength(text));
        text.remove_prefix(sequence.size());
        const auto first = static_cast<unsigned char>(sequence[0]);
        if (sequence.size() == 1 && first >= 0x80)
            shown += {'\\', 'x', kDigits[first >> 4], kDigits[first & 15]};
        else
            shown += sequence;
    }
    return shown;
}

} // namespace shadowdag
