// SPDX-License-Identifier: Apache-2.0
// Includes of GLSL texts.
#include "gl/glsl.h"

#include "cuda/error.h"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace shadowdag {

namespace {

const char* textOf(const GlslTexts& texts, const std::string& path) {
    for (const GlslText& text : texts)
        if (path == text.path)
            return text.text;
    throw Error(ErrorKind::kUsage, "no GLSL text '" + path +
                                       "' in this program; add it to its folder's CMakeLists.txt");
}

void expand(const GlslTexts& texts, const std::string& path, GlslUnit& unit) {
    const size_t number = unit.paths.size();
    unit.paths.push_back(path);
    std::istringstream lines(textOf(texts, path));
    unit.text += "#line 1 " + std::to_string(number) + "\n";
    std::string line;
    // For a header that C++ shares (gl/leaf.h): its branch for C++, and other lines for C++ only.
    bool isForCpp = false, isGuarded = false;
    for (size_t at = 1; std::getline(lines, line); ++at) {
        const bool isElse = line == "#else", isEnd = line == "#endif";
        if (line == "#ifdef __cplusplus")
            isForCpp = isGuarded = true;
        const bool isDropped =
            isForCpp || line == "#pragma once" || (isGuarded && (isElse || isEnd));
        if (isGuarded && (isElse || isEnd)) {
            isForCpp = false;
            isGuarded = !isEnd;
        }
        if (isDropped) {
            unit.text += "\n";
            continue;
        }
        constexpr char kInclude[] = "#include \"";
        if (line.rfind(kInclude, 0) != 0) {
            unit.text += line + "\n";
            continue;
        }
        const size_t begin = sizeof(kInclude) - 1;
        const std::string other = line.substr(begin, line.rfind('"') - begin);
        if (std::find(unit.paths.begin(), unit.paths.end(), other) == unit.paths.end())
            expand(texts, other, unit);
        unit.text += "#line " + std::to_string(at + 1) + " " + std::to_string(number) + "\n";
    }
}

} // namespace

GlslUnit expandGlsl(const GlslTexts& texts, const std::string& path) {
    GlslUnit unit;
    expand(texts, path, unit);
    return unit;
}

std::string nameGlslFiles(const std::string& log, const std::vector<std::string>& paths) {
    std::istringstream lines(log);
    std::string line, named;
    while (std::getline(lines, line)) {
        size_t digits = 0;
        while (digits < line.size() && std::isdigit(static_cast<unsigned char>(line[digits])))
            ++digits;
        const bool isPlace = digits > 0 && digits < 6 && digits < line.size() &&
                             (line[digits] == ':' || line[digits] == '(');
        const size_t number = isPlace ? std::stoul(line.substr(0, digits)) : paths.size();
        named += (number < paths.size() ? paths[number] + line.substr(digits) : line) + "\n";
    }
    return named;
}

} // namespace shadowdag
