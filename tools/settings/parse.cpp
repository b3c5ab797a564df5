// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/parse.h"

#include "cuda/error.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>

namespace shadowdag {

namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text,
                         const std::string& right) {
    throw Error(ErrorKind::kUsage, option + " '" + text + "': " + right);
}

/// Returns whether the whole text is one number of type T, which `value` receives.
template <class T> bool readWhole(const std::string& text, T& value) {
    const char* end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && at == end && !text.empty();
}

} // namespace

std::string withoutBlanks(const std::string& text) {
    const size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

int64_t parseInteger(const std::string& option, const std::string& text, int64_t min, int64_t max) {
    int64_t value = 0;
    if (!readWhole(text, value) || value < min || value > max)
        refuse(option, text,
               "must be a whole number from " + std::to_string(min) + " to " + std::to_string(max));
    return value;
}

double parseNumber(const std::string& option, const std::string& text, double min, double max) {
    double value = 0;
    if (!readWhole(text, value) || !std::isfinite(value) || value < min || value > max)
        refuse(option, text, "must be a number from " + numberText(min) + " to " + numberText(max));
    return value;
}

std::pair<uint32_t, uint32_t> parseSize(const std::string& option, const std::string& text) {
    const std::string right = "must be WIDTHxHEIGHT, as in 640x360, with sides from 1 to " +
                              std::to_string(kMaxImageSide) + " and " +
                              std::to_string(kMaxPixelCount) + " pixels at most";
    const size_t x = text.find('x');
    uint64_t width = 0, height = 0;
    if (x == std::string::npos || !readWhole(text.substr(0, x), width) ||
        !readWhole(text.substr(x + 1), height))
        refuse(option, text, right);
    if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide ||
        width * height > kMaxPixelCount)
        refuse(option, text, right);
    return {uint32_t(width), uint32_t(height)};
}

std::vector<std::string> parseList(const std::string& option, const std::string& text) {
    std::vector<std::string> parts;
    std::set<std::string> seen;
    for (size_t begin = 0; begin <= text.size();) {
        size_t end = begin;
        for (int depth = 0; end < text.size() && (text[end] != ',' || depth > 0); ++end)
            depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
        const std::string part = withoutBlanks(text.substr(begin, end - begin));
        if (part.empty())
            refuse(option, text, "a part of the list is empty; separate values by single commas");
        if (!seen.insert(part).second)
            refuse(option, text, "'" + part + "' is listed twice; list each value once");
        parts.push_back(part);
        begin = end + 1;
    }
    return parts;
}

std::vector<uint32_t> parseFrames(const std::string& option, const std::string& text) {
    constexpr uint64_t kMaxFrame = 1000000;
    const std::string right = "must be A, A:B or A:B:STEP (both ends included; A <= B <= 1000000, "
                              "STEP up to that), or several of "
                              "them separated by commas, as in 0:90:30";
    std::vector<uint32_t> frames;
    for (const std::string& part : parseList(option, text)) {
        std::vector<uint64_t> numbers;
        for (size_t begin = 0; begin <= part.size();) {
            const size_t end = std::min(part.find(':', begin), part.size());
            uint64_t number = 0;
            if (!readWhole(part.substr(begin, end - begin), number))
                refuse(option, text, right);
            numbers.push_back(number);
            begin = end + 1;
        }
        const uint64_t last = numbers.size() > 1 ? numbers[1] : numbers[0];
        const uint64_t step = numbers.size() > 2 ? numbers[2] : 1;
        if (numbers.size() > 3 || last < numbers[0] || last > kMaxFrame || step == 0 ||
            step > kMaxFrame)
            refuse(option, text, right);
        if (frames.size() + (last - numbers[0]) / step > kMaxFrame)
            refuse(option, text, "lists more than " + std::to_string(kMaxFrame + 1) + " frames");
        for (uint64_t frame = numbers[0]; frame <= last; frame += step)
            frames.push_back(uint32_t(frame));
    }
    std::sort(frames.begin(), frames.end());
    frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
    return frames;
}

std::vector<float> parseThresholds(const std::string& option, const std::string& text) {
    std::vector<float> thresholds;
    for (const std::string& part : parseList(option, text)) {
        if (part == "inf") {
            thresholds.push_back(std::numeric_limits<float>::infinity());
            continue;
        }
        double value = 0;
        if (!readWhole(part, value) || !(value >= 0) || value > 1e6)
            refuse(option, text,
                   "'" + part + "' must be a number of texels from 0 to 1000000, or inf");
        thresholds.push_back(float(value));
    }
    std::sort(thresholds.begin(), thresholds.end());
    return thresholds;
}

uint32_t parsePowerOfTwo(const std::string& option, const std::string& text, uint32_t min,
                         uint32_t max) {
    uint64_t value = 0;
    if (!readWhole(text, value) || value < min || value > max || !std::has_single_bit(value)) {
        std::string right =
            "must be a power of two from " + std::to_string(min) + " to " + std::to_string(max);
        double number = 0; // 4096.5 has neighbours, too
        if (readWhole(text, number) && number > min && number < max &&
            !std::has_single_bit(uint64_t(number)))
            right += "; the nearest are " + std::to_string(std::bit_floor(uint64_t(number))) +
                     " and " + std::to_string(std::bit_ceil(uint64_t(number)));
        else if (readWhole(text, number) && number > min && number < max)
            right += "; the nearest is " + std::to_string(uint64_t(number));
        refuse(option, text, right);
    }
    return uint32_t(std::countr_zero(value));
}

std::pair<uint32_t, uint32_t> parseShare(const std::string& option, const std::string& text,
                                         uint32_t maxCount) {
    const size_t slash = text.find('/');
    uint32_t part = 0, count = 0;
    if (slash == std::string::npos || !readWhole(text.substr(0, slash), part) ||
        !readWhole(text.substr(slash + 1), count) || part < 1 || part > count || count > maxCount)
        refuse(option, text,
               "must be K/N with K from 1 to N and N at most " + std::to_string(maxCount) +
                   ", as in 2/8");
    return {part, count};
}

uint64_t parseBytes(const std::string& option, const std::string& text) {
    const std::string right =
        "must be a number of bytes, as in 268435456, or with K, M or G, as in 256M";
    if (text.empty())
        refuse(option, text, right);
    double scale = 1;
    std::string digits = text;
    switch (text.back()) {
    case 'K':
        scale = 1024.0;
        break;
    case 'M':
        scale = 1024.0 * 1024;
        break;
    case 'G':
        scale = 1024.0 * 1024 * 1024;
        break;
    default:
        break;
    }
    if (scale > 1)
        digits.pop_back();
    double value = 0;
    if (!readWhole(digits, value) || !(value >= 0) || value * scale > 1e15)
        refuse(option, text, right);
    return uint64_t(value * scale);
}

uint64_t parseMemoryLimit(const std::string& text) {
    const uint64_t bytes = parseBytes("--memory-limit", text);
    if (bytes < (16u << 20))
        refuse("--memory-limit", text, "must be 16M or more: the program alone takes that much");
    return bytes;
}

std::string numberText(double value) {
    if (std::isinf(value))
        return value > 0 ? "inf" : "-inf";
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.7g", value);
    return buffer;
}

std::string bytesText(double bytes) {
    const char* units[] = {"B", "KiB", "MiB", "GiB", "TiB"};
    int unit = 0;
    for (; bytes >= 1024 && unit < 4; ++unit)
        bytes /= 1024;
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, unit == 0 ? "%.0f %s" : "%.2f %s", bytes, units[unit]);
    return buffer;
}

} // namespace shadowdag
