// SPDX-License-Identifier: Apache-2.0
// Values as text within a page of HTML, and how our pages look.
#pragma once

#include "tools/settings/json.h"

#include <string>

namespace shadowdag::html {

/// Returns a page up to the start of its body, with the style of our reports.
std::string pageStart(const std::string& title);
/// Returns the text with what HTML would take for markup spelled out.
std::string escaped(const std::string& text);
/// Returns a JSON value as escaped text: texts without quotes, all else as JSON writes it.
std::string text(const Json& value);
/// Returns a number with so many decimals.
std::string number(double value, int decimals);
/// Returns a count with thin spaces between thousands.
std::string grouped(double value);

} // namespace shadowdag::html
