// SPDX-License-Identifier: Apache-2.0
// Each map by what a cost model chooses: rays, or the map.
#include "tools/settings/method.h"

#include <cmath>

namespace shadowdag {

const Method& hybridMethod();

namespace {

class HybridMethod : public Method {
public:
    HybridMethod()
        : Method("hybrid", "each by the method that --model chooses",
                 {.rays = true, .maps = true, .routing = true}) {}

    std::string modelText(const std::string& asked) const override {
        return asked.empty() ? "texels:96" : asked; // the paper's
    }
    bool isRunAtThreshold(float texels) const override { return texels > 0 && !std::isinf(texels); }
    int complexity() const override { return 2; }
};

} // namespace

const Method& hybridMethod() {
    static const HybridMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
