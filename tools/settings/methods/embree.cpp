// SPDX-License-Identifier: Apache-2.0
// Embree's results: the truth that errors are measured against.
#include "tools/settings/method.h"

namespace shadowdag {

const Method& embreeMethod();

namespace {

class EmbreeMethod : public Method {
public:
    EmbreeMethod() : Method("embree", "the truth", {}) {}

    bool isTruth() const override { return true; }
    // Only its pairs are used; the smallest number of maps is enough for them.
    std::string modelText(const std::string&) const override { return "texels:0"; }
};

} // namespace

const Method& embreeMethod() {
    static const EmbreeMethod kMethod;
    return kMethod;
}

} // namespace shadowdag
