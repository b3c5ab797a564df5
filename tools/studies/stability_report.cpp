// SPDX-License-Identifier: Apache-2.0
// What the groups and bands are, as the page of stability wants it.
#include "tools/studies/stability.h"

namespace shadowdag {

Json stabilityStudy() {
    Json rows = Json::array(), bands = Json::array(), known = Json::array();
    for (const StabilityGroup& group : stabilityGroups())
        rows.push_back({{"name", group.name}, {"scene", group.scene}, {"what", group.what}});
    for (const StabilityBand& band : stabilityBands())
        bands.push_back({{"id", band.id},
                         {"measure", band.measure},
                         {"formula", band.formula},
                         {"reason", band.reason}});
    for (const KnownBreak& one : knownBreaks())
        known.push_back({{"group", one.group},
                         {"kind", one.kind},
                         {"method", one.method},
                         {"measure", one.measure},
                         {"low", one.low},
                         {"high", one.high},
                         {"reason", one.reason}});
    return {{"rows", rows}, {"bands", bands}, {"known", known}};
}

} // namespace shadowdag
