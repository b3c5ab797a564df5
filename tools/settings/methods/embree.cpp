// SPDX-License-Identifier: Apache-2.0
// Every light by Embree's packets, as a renderer would use them: the peer of all methods here.
#include "tools/settings/method.h"

namespace shadowdag {

const Method& embreeMethod();

namespace {

class EmbreeMethod : public Method {
public:
    EmbreeMethod()
        : Method("embree", "all lights by rays of Embree, as a renderer would trace them",
                 {.embree = true}) {}

    std::string modelText(const std::string&) const override { return "texels:inf"; }
    void takeOver(RayOptions& rays) const override {
        rays = {};
        rays.believe = 0.0f;
        rays.triangleRays = TriangleRays::kEmbree;
    }
};

} // namespace

const Method& embreeMethod() {
    static const EmbreeMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
