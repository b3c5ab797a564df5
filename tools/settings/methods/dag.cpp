// SPDX-License-Identifier: Apache-2.0
// Every light by rays through voxels, each hit believed.
#include "tools/settings/method.h"

#include <cmath>

namespace shadowdag {

const Method& dagMethod();

namespace {

class DagMethod : public Method {
public:
    DagMethod() : Method("dag", "all lights by rays through voxels", {.voxels = true}) {}

    std::string modelText(const std::string&) const override { return "texels:inf"; }
    bool isRunAtThreshold(float texels) const override { return std::isinf(texels); }
    int complexity() const override { return 0; }
};

} // namespace

const Method& dagMethod() {
    static const DagMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
