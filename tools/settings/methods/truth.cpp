// SPDX-License-Identifier: Apache-2.0
// The truth that errors are measured against: Embree with every precaution (hybrid/judge/truth.h).
#include "tools/settings/method.h"

namespace shadowdag {

const Method& truthMethod();

namespace {

class TruthMethod : public Method {
public:
    TruthMethod() : Method("truth", "what errors are measured against", {}) {}

    bool isTruth() const override { return true; }
    // Only its pairs are used; the smallest number of maps is enough for them.
    std::string modelText(const std::string&) const override { return "texels:0"; }
};

} // namespace

const Method& truthMethod() {
    static const TruthMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
