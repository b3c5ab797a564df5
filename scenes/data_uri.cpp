// SPDX-License-Identifier: Apache-2.0
#include "scenes/data_uri.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>

namespace shadowdag {

namespace {

constexpr std::string_view kScheme = "data:", kBase64 = ";base64";
constexpr uint8_t kNoDigit = 255;

char lowerCase(char c) {
    return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
}

bool equalsInAnyCase(std::string_view text, std::string_view lower) {
    return std::equal(text.begin(), text.end(), lower.begin(), lower.end(),
                      [](char a, char b) { return lowerCase(a) == b; });
}

/// Returns the value of each character as a digit of base64, or kNoDigit.
constexpr std::array<uint8_t, 256> digitValues() {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<uint8_t, 256> values{};
    values.fill(kNoDigit);
    for (size_t i = 0; i < kDigits.size(); ++i)
        values[uint8_t(kDigits[i])] = uint8_t(i);
    return values;
}

/// Decodes base64 into `result`.
void decodeBase64(std::string_view text, DataUri& result) {
    static constexpr std::array<uint8_t, 256> kValues = digitValues();
    result.bytes.reserve(text.size() / 4 * 3 + 3);
    uint32_t bits = 0;
    unsigned bitCount = 0;
    bool isPadded = false;
    for (const char c : text) {
        if (c == ' ' || c == '\t' || c == '\r' || c == '\n')
            continue;
        if (c == '=') {
            isPadded = true;
            continue;
        }
        const uint8_t value = kValues[uint8_t(c)];
        if (value == kNoDigit || isPadded) {
            result.problem = "its data URI has '" + std::string(1, c) + "' in its base64" +
                             (value == kNoDigit ? "" : " after the padding") +
                             "; export the file again";
            return;
        }
        bits = bits << 6 | value;
        bitCount += 6;
        if (bitCount >= 8) {
            bitCount -= 8;
            result.bytes.push_back(uint8_t(bits >> bitCount));
        }
    }
    if (bitCount == 6)
        result.problem = "its data URI ends within a byte; export the file again";
    else if (result.bytes.empty())
        result.problem = "its data URI is empty; export the file again";
}

} // namespace

bool isDataUri(std::string_view uri) {
    return equalsInAnyCase(uri.substr(0, kScheme.size()), kScheme);
}

DataUri decodeDataUri(std::string_view uri) {
    DataUri result;
    const size_t comma = uri.find(',');
    if (comma == std::string_view::npos) {
        result.problem = "its data URI has no comma before its data; export the file again";
        return result;
    }
    const std::string_view header = uri.substr(0, comma), data = uri.substr(comma + 1);
    if (header.size() < kBase64.size() ||
        !equalsInAnyCase(header.substr(header.size() - kBase64.size()), kBase64)) {
        result.problem = "its data URI is not base64, the only encoding that is read; write "
                         "\";base64,\" and the data in base64, or put them into a file beside";
        return result;
    }
    if (data.find('%') == std::string_view::npos)
        decodeBase64(data, result);
    else
        decodeBase64(decodeUri(data), result);
    if (!result.problem.empty())
        result.bytes.clear();
    return result;
}

std::string decodeUri(std::string_view uri) {
    std::string text;
    for (size_t i = 0; i < uri.size(); ++i) {
        unsigned value = 0;
        if (uri[i] == '%' && i + 2 < uri.size() &&
            std::from_chars(&uri[i + 1], &uri[i + 1] + 2, value, 16).ptr == &uri[i + 1] + 2) {
            text += char(value);
            i += 2;
        } else {
            text += uri[i];
        }
    }
    return text;
}

} // namespace shadowdag
