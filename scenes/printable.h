// SPDX-License-Identifier: Apache-2.0
// Text that a message may contain, whatever names are in it.
#pragma once

#include <string>
#include <string_view>

namespace shadowdag {

/// Returns a text with each control byte escaped, for example ESC as `\x1b`: a terminal would obey
/// it, and a zero byte would end the message. So are U+0080 to U+009F and, outside UTF-8, the bytes
/// of these numbers, which other terminals obey, and Unicode's format characters: those that
/// change the direction of text, as U+202E, those that end lines, joiners and tags. Other invisible
/// characters stay: variation selectors, U+034F and the fillers of Hangul; and so do tabs and ends
/// of lines, and other bytes that are not UTF-8.
std::string printable(std::string_view text);

/// Returns the same with ends of lines as `\x0a`: a name cannot then begin a line that looks like
/// another message.
std::string printableLine(std::string_view text);

/// Returns a text as UTF-8: bytes that are not, as `\xe4`.
std::string utf8Of(std::string_view text);

} // namespace shadowdag
