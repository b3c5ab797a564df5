// SPDX-License-Identifier: Apache-2.0
// Text that a message may contain, whatever names are in it.
#pragma once

#include <string>
#include <string_view>

namespace shadowdag {

/// Returns a text with each control byte escaped, for example ESC as `\x1b`: a terminal would obey
/// it, and a zero byte would end the message. Tabs and ends of lines stay, as do bytes that are not
/// UTF-8.
std::string printable(std::string_view text);

} // namespace shadowdag
