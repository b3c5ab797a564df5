// SPDX-License-Identifier: Apache-2.0
// Every light by rays: through voxels as far as --believe says, and else against triangles.
#include "tools/settings/method.h"

#include <cmath>

namespace shadowdag {

const Method& dagMethod();

namespace {

class DagMethod : public Method {
public:
    DagMethod()
        : Method("dag", "all lights by rays, through the voxels that --believe names",
                 {.rays = true}) {}

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
