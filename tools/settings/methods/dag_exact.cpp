// SPDX-License-Identifier: Apache-2.0
// Every light by rays through voxels, each hit confirmed against the triangles there.
#include "tools/settings/method.h"

namespace shadowdag {

const Method& dagExactMethod();

namespace {

class DagExactMethod : public Method {
public:
    DagExactMethod()
        : Method("dag-exact", "the same, every hit confirmed against triangles",
                 {.voxels = true, .triangles = true}) {}

    std::string modelText(const std::string&) const override { return "texels:inf"; }
    void configure(FrameOptions& options) const override { options.rays.kind = RayKind::kExact; }
    bool isRunAlone() const override { return true; }
    int complexity() const override { return 2; }
};

} // namespace

const Method& dagExactMethod() {
    static const DagExactMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
