// SPDX-License-Identifier: Apache-2.0
// GLSL sources. Each belongs to the folder of its method and is embedded into the program at build
// time (cmake/ShadowDagGlsl.cmake), so that no file is needed at run time.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace shadowdag {

/// One file. @param path from the root of the sources, as #include names it
struct GlslText {
    const char* path;
    const char* text;
};
using GlslTexts = std::vector<GlslText>;

/// A text with its includes in place.
struct GlslUnit {
    std::string text;
    /// By the number in #line, which a compiler's messages contain.
    std::vector<std::string> paths;
};

/// Returns the text of `path` with every line `#include "other/path"` replaced by that file, each
/// file once, where it is first named. Lines that only C++ reads, of headers that both languages
/// share (gl/leaf.h), become empty: `#pragma once`, and `#ifdef __cplusplus` to its #else or
/// #endif, which must hold no other condition. Throws Error kUsage for a file that `texts` does not
/// hold.
GlslUnit expandGlsl(const GlslTexts& texts, const std::string& path);

/// Returns a compiler's log with the file numbers at the start of lines, "2:17" or "2(17)",
/// replaced by paths.
std::string nameGlslFiles(const std::string& log, const std::vector<std::string>& paths);

} // namespace shadowdag
