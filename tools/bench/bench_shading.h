// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench shading`: times what every frame does beside its rays: the G-buffer on all
// threads, and on one thread the marking of pairs, their colour, and lookups in shadow maps.
#pragma once

#include "scenes/world.h"
#include "tools/settings/console.h"
#include "tools/settings/json.h"

#include <ostream>

namespace shadowdag {

struct ShadingBenchOptions {
    uint32_t width = 320, height = 180; ///< of the view
    int repeats = 10;
};

/// Draws the maps of a view's lights, verifies every lookup in lanes against lookupVisibility, bit
/// for bit, and measures: the stages of frames whose maps are kept, on all threads, and the
/// processor time of one thread for marking and colour and for lookups with 1, 4 and 9 taps,
/// `repeats` times in turn after one round to warm up. Returns the measurements as JSON, without
/// provenance. Throws Error kInput when no light reaches the view or a lookup differs; nothing is
/// reported then.
Json runShadingBench(const World& world, const Camera& camera, const ShadingBenchOptions& options,
                     const Console& console);

/// Prints the result of runShadingBench as a table.
void printShadingBench(std::ostream& out, const Json& result);

} // namespace shadowdag
