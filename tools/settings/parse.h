// SPDX-License-Identifier: Apache-2.0
// Parses option texts. Every function throws Error kUsage naming the option, the offending text and
// the valid form.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// Pictures may have this many pixels at most: beyond it, indices of pairs would leave 32 bits a
/// light.
constexpr uint64_t kMaxPixelCount = 1ull << 26;
constexpr uint32_t kMaxImageSide = 16384;

/// Returns the whole number in [min, max] of `text`.
int64_t parseInteger(const std::string& option, const std::string& text, int64_t min, int64_t max);
/// Returns the finite number in [min, max] of `text`.
double parseNumber(const std::string& option, const std::string& text, double min, double max);
/// Returns (width, height) of "WxH".
std::pair<uint32_t, uint32_t> parseSize(const std::string& option, const std::string& text);
/// Returns a text without the blanks around it.
std::string withoutBlanks(const std::string& text);
/// Returns the parts of a comma-separated list, none of them empty or duplicate, without
/// surrounding blanks. Commas in parentheses do not separate.
std::vector<std::string> parseList(const std::string& option, const std::string& text);
/// Returns the frames of "A", "A:B" or "A:B:STEP" (both ends included), or a comma-separated list
/// of such; 1000001 frames in all at most.
std::vector<uint32_t> parseFrames(const std::string& option, const std::string& text);
/// Returns thresholds in texels, ascending; `inf` is infinity.
std::vector<float> parseThresholds(const std::string& option, const std::string& text);
/// Returns log2 of a power of two in [min, max], both powers of two.
uint32_t parsePowerOfTwo(const std::string& option, const std::string& text, uint32_t min,
                         uint32_t max);
/// Returns (K, N) of "K/N", 1 <= K <= N <= maxCount.
std::pair<uint32_t, uint32_t> parseShare(const std::string& option, const std::string& text,
                                         uint32_t maxCount);
/// Returns bytes of "256M", "1.5G", "65536K" or "1000000" (binary multiples).
uint64_t parseBytes(const std::string& option, const std::string& text);

/// Returns the bytes of --memory-limit: as parseBytes, 16 MiB at least.
uint64_t parseMemoryLimit(const std::string& text);

/// Returns the shortest usual text of a number, "inf" for infinity: the spelling in models and
/// labels.
std::string numberText(double value);
/// Returns bytes as text: "11.7 MiB".
std::string bytesText(double bytes);

} // namespace shadowdag
