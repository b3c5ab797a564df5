// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/image_metrics.h"

#include "cuda/error.h"

#include <cmath>
#include <string>

namespace shadowdag {

double computeRmse(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    if (a.size() != b.size())
        throw Error(ErrorKind::kUsage, "images of " + std::to_string(a.size()) + " and " +
                                           std::to_string(b.size()) +
                                           " pixels cannot be compared; render both at one size");
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const glm::dvec3 d = glm::dvec3(a[i]) - glm::dvec3(b[i]);
        sum += glm::dot(d, d);
    }
    return a.empty() ? 0.0 : std::sqrt(sum / (3.0 * double(a.size())));
}

} // namespace shadowdag
