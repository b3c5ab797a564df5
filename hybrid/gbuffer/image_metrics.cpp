// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/image_metrics.h"

#include "cuda/error.h"

#include <cmath>
#include <string>

namespace shadowdag {

namespace {

void requireEqualSizes(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    if (a.size() != b.size())
        throw Error(ErrorKind::kUsage, "images of " + std::to_string(a.size()) + " and " +
                                           std::to_string(b.size()) +
                                           " pixels cannot be compared; render both at one size");
}

} // namespace

double computeFrameDifferenceError(const std::vector<glm::vec3>& before,
                                   const std::vector<glm::vec3>& after,
                                   const std::vector<glm::vec3>& trueBefore,
                                   const std::vector<glm::vec3>& trueAfter) {
    for (const std::vector<glm::vec3>* other : {&after, &trueBefore, &trueAfter})
        requireEqualSizes(before, *other);
    double sum = 0;
    for (size_t i = 0; i < before.size(); ++i) {
        const glm::dvec3 change = glm::dvec3(after[i]) - glm::dvec3(before[i]),
                         trueChange = glm::dvec3(trueAfter[i]) - glm::dvec3(trueBefore[i]);
        const glm::dvec3 d = glm::abs(change - trueChange);
        sum += d.x + d.y + d.z;
    }
    return before.empty() ? 0.0 : sum / (3.0 * double(before.size()));
}

double computeRmse(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    requireEqualSizes(a, b);
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const glm::dvec3 d = glm::dvec3(a[i]) - glm::dvec3(b[i]);
        sum += glm::dot(d, d);
    }
    return a.empty() ? 0.0 : std::sqrt(sum / (3.0 * double(a.size())));
}

} // namespace shadowdag
