// SPDX-License-Identifier: Apache-2.0
// The level of detail of rays in options and experiments.
#pragma once

#include "hybrid/rays/shadow_rays.h"

#include <string>

namespace shadowdag {

/// How rays choose their level: the part of RayOptions that `--lod` and the experiment's "lod" set.
struct LodChoice {
    LodRule rule = LodRule::kFixed;
    uint32_t level = 0;                                 ///< kFixed
    float footprintScale = RayOptions{}.footprintScale; ///< the others
    float coverage = RayOptions{}.coverage;             ///< kCoverage

    LodChoice(uint32_t fixedLevel = 0) : level(fixedLevel) {}
    explicit LodChoice(const RayOptions& rays)
        : rule(rays.lod), level(rays.level), footprintScale(rays.footprintScale),
          coverage(rays.coverage) {}
    bool operator==(const LodChoice&) const = default;

    /// Sets the options to this choice.
    void apply(RayOptions& rays) const;
    /// Returns the shortest text that parseLod accepts for it: "0", "footprint", "coverage:0.25",
    /// "footprint:2", "coverage:0.5:2".
    std::string text() const;
};

/// Returns the choice of a text: a level from 0 to 17; `footprint[:SCALE]`; or
/// `coverage[:SHARE[:SCALE]]` with a scale from 1/1024 to 1024 and a share of at most 1 above 0.
/// Throws Error kUsage naming the option, the text and the valid forms.
LodChoice parseLod(const std::string& option, const std::string& text);

} // namespace shadowdag
