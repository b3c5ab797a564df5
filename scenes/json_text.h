// SPDX-License-Identifier: Apache-2.0
// Why a text is not JSON, where its kind says more than the place of the error.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace shadowdag {

/// Returns "is UTF-16; save it as UTF-8", or "" for a text that is not UTF-16, by its byte order
/// mark or the zero bytes of its first two characters, of which a binary file may begin with one:
/// editors show such a text like any other.
std::string whyNoUtf8(std::string_view text);

/// Returns whether at a place stands what other formats have for no number, and JSON does not: NaN,
/// Infinity, inf, with or without a sign. @param byte within the word
bool isNoNumber(std::string_view text, size_t byte);

} // namespace shadowdag
