// SPDX-License-Identifier: Apache-2.0
// Every light by virtual cube shadow maps.
#include "tools/settings/method.h"

namespace shadowdag {

const Method& mapsMethod();

namespace {

class MapsMethod : public Method {
public:
    MapsMethod() : Method("maps", "all by virtual cube shadow maps", {.maps = true}) {}

    std::string modelText(const std::string&) const override { return "texels:0"; }
    bool isRunAtThreshold(float texels) const override { return texels == 0; }
    int complexity() const override { return 1; }
};

} // namespace

const Method& mapsMethod() {
    static const MapsMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
