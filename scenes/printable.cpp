// SPDX-License-Identifier: Apache-2.0
#include "scenes/printable.h"

#include <algorithm>

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

bool isControl(unsigned char byte) {
    return byte < 0x20 || (byte >= 0x7f && byte < 0xa0);
}

constexpr const char* kDigits = "0123456789abcdef";

/// Returns the text with its control characters escaped, except those of `kept`.
std::string escaped(std::string_view text, std::string_view kept) {
    std::string shown;
    while (!text.empty()) {
        const std::string_view sequence = text.substr(0, sequenceLength(text));
        text.remove_prefix(sequence.size());
        const auto first = static_cast<unsigned char>(sequence[0]);
        const bool isShown =
            sequence.size() == 1
                ? !isControl(first) || kept.find(sequence[0]) != std::string_view::npos
                : first != 0xc2 || !isControl(static_cast<unsigned char>(sequence[1]));
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
