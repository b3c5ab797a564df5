// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/lod_option.h"

#include "cuda/error.h"
#include "tools/settings/parse.h"

#include <vector>

namespace shadowdag {

void LodChoice::apply(RayOptions& rays) const {
    rays.lod = rule;
    rays.level = level;
    rays.footprintScale = footprintScale;
    rays.coverage = coverage;
}

std::string LodChoice::text() const {
    if (rule == LodRule::kFixed)
        return std::to_string(level);
    const std::string scale = footprintScale == 1.0f ? "" : ":" + numberText(footprintScale);
    return rule == LodRule::kFootprint ? "footprint" + scale
                                       : "coverage:" + numberText(coverage) + scale;
}

LodChoice parseLod(const std::string& option, const std::string& text) {
    std::vector<std::string> parts(1);
    for (const char c : text)
        if (c == ':')
            parts.emplace_back();
        else
            parts.back() += c;
    LodChoice choice;
    const bool isFootprint = parts[0] == "footprint", isCoverage = parts[0] == "coverage";
    if (!isFootprint && !isCoverage) {
        const bool isNumber = text.find_first_not_of("0123456789") == std::string::npos;
        if (text.empty() || !isNumber)
            throw Error(ErrorKind::kUsage,
                        option + " '" + text +
                            "': must be a level from 0 to 17, footprint[:SCALE] or "
                            "coverage[:SHARE[:SCALE]], as in coverage:0.5");
        choice.level = uint32_t(parseInteger(option, text, 0, 17));
        return choice;
    }
    choice.rule = isFootprint ? LodRule::kFootprint : LodRule::kCoverage;
    const size_t most = isFootprint ? 2 : 3;
    if (parts.size() > most)
        throw Error(ErrorKind::kUsage, option + " '" + text + "': " + parts[0] + " takes " +
                                           (isFootprint ? "a scale" : "a share and a scale") +
                                           ", nothing more");
    const auto number = [&](const std::string& part, double min, double max, const char* what) {
        return float(parseNumber(option + " '" + text + "', " + what, part, min, max));
    };
    if (isCoverage && parts.size() > 1)
        choice.coverage = number(parts[1], 1.0 / 255, 1, "the share");
    if (parts.size() == most)
        choice.footprintScale = number(parts[most - 1], 1.0 / 1024, 1024, "the scale");
    return choice;
}

} // namespace shadowdag
