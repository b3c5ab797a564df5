// SPDX-License-Identifier: Apache-2.0
#include "tools/report/html.h"

#include <cstdio>
#include <string_view>

namespace shadowdag::html {

namespace {

constexpr std::string_view kStyle = R"(
:root { --ink: #1b1f24; --soft: #5b6570; --line: #dde2e7; --wash: #f5f7f9; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 76rem; color: var(--ink); background: #fff;
       font: 16px/1.55 "Source Sans 3", "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.35rem; margin: 3rem 0 .8rem; padding-top: 1rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .5rem; }
p { max-width: 46rem; }
.lead { color: var(--soft); margin: 0 0 1.2rem; }
nav a { margin-right: 1.1rem; }
a { color: #0072b2; }
figure { margin: 0; }
figure img { width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: .92rem; margin-top: .4rem; max-width: 46rem; }
.main { max-width: 44rem; margin: 1.5rem 0; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(28rem, 1fr)); gap: 2.2rem 2.5rem; }
.pictures { display: grid; grid-template-columns: repeat(4, 1fr); gap: .6rem; }
.pictures figcaption { font-size: .82rem; margin-top: .2rem; }
@media (max-width: 64rem) { .pictures { grid-template-columns: repeat(2, 1fr); }
                            .charts { grid-template-columns: 1fr; } }
.note { color: #a04000; font-size: .9rem; margin: .2rem 0 .5rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .8rem; font-variant-numeric: tabular-nums; width: 100%; }
th, td { padding: .28rem .38rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th { color: var(--soft); font-weight: 600; background: var(--wash); white-space: normal; vertical-align: bottom; }
table.sortable th { cursor: pointer; }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0; background: #fff; }
th:first-child { background: var(--wash); }
td.wide { white-space: normal; text-align: left; overflow-wrap: anywhere; }
tr:hover td { background: var(--wash); }
.key { display: inline-block; width: .8em; height: .8em; border-radius: 2px; margin: 0 .25em 0 .6em; }
details summary { cursor: pointer; margin: 1rem 0; color: #0072b2; }
)";

} // namespace

std::string pageStart(const std::string& title) {
    return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>" +
           escaped(title) + "</title><style>" + std::string(kStyle) + "</style></head><body>\n";
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        switch (c) {
        case '&':
            out += "&amp;";
            break;
        case '<':
            out += "&lt;";
            break;
        case '>':
            out += "&gt;";
            break;
        case '"':
            out += "&quot;";
            break;
        default:
            out += c;
        }
    return out;
}

std::string text(const Json& value) {
    return escaped(value.is_string() ? value.get<std::string>()
                                     : value.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string number(double value, int decimals) {
    char buffer[48];
    std::snprintf(buffer, sizeof buffer, "%.*f", decimals, value);
    return buffer;
}

std::string grouped(double value) {
    std::string digits = number(value, 0);
    for (int at = int(digits.size()) - 3; at > (digits[0] == '-' ? 1 : 0); at -= 3)
        digits.insert(size_t(at), "&#8239;");
    return digits;
}

} // namespace shadowdag::html
