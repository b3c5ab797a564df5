// SPDX-License-Identifier: Apache-2.0
#include "voxel/lit_proof.h"

#include "cuda/mutant.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// Fewer rays than this cost less than the shaft that would replace them.
constexpr uint32_t kFewestForShaft = 32;
/// Groups smaller than this are not divided further.
constexpr uint32_t kFewestToPart = 256;

} // namespace

void LitProof::makeFrame(Facet& f) const {
    const double length = glm::length(f.normalSum);
    const glm::dvec3 n = length > 1e-6 ? f.normalSum / length : glm::dvec3(0, 0, 1);
    // Least squares: p = p0 + a x + b y over the pixels.
    const double count = f.sums[5], x = f.sums[0] / count, y = f.sums[1] / count;
    const double xx = f.sums[2] - f.sums[0] * x, xy = f.sums[3] - f.sums[0] * y,
                 yy = f.sums[4] - f.sums[1] * y;
    const glm::dvec3 px = f.pointSums[1] - f.pointSums[0] * x,
                     py = f.pointSums[2] - f.pointSums[0] * y;
    glm::dvec3 a = px * yy - py * xy, b = py * xx - px * xy;
    a -= n * glm::dot(a, n);
    b -= n * glm::dot(b, n);
    if (!(glm::dot(a, a) > 1e-12)) {
        const glm::dvec3 m = glm::abs(n);
        const glm::dvec3 least = m.x <= m.y && m.x <= m.z ? glm::dvec3(1, 0, 0)
                                 : m.y <= m.z             ? glm::dvec3(0, 1, 0)
                                                          : glm::dvec3(0, 0, 1);
        a = glm::cross(n, least);
    }
    a = glm::normalize(a);
    const glm::dvec3 across = glm::cross(n, a);
    // Skewed as the tile is on the facet, unless the result would be needle-shaped.
    const double bLength = glm::length(b);
    b = bLength > 1e-6 && std::fabs(glm::dot(b, across)) > 0.25 * bLength ? b / bLength : across;
    const double determinant = glm::dot(b, across);
    f.axis[0] = a;
    f.axis[1] = b;
    f.axis[2] = n;
    f.side[0] = glm::cross(b, n) / determinant;
    f.side[1] = across / determinant;
    f.side[2] = n;
    f.above.make(glm::vec3(n));
}

void LitProof::reset(const ReceiverGroups& receivers) {
    receivers_ = &receivers;
    const ShadowStarts& starts = receivers.starts();
    std::fill(facets_, facets_ + receivers.facetCount(), Facet{});
    for (size_t i = 0; i < receivers.count(); ++i) {
        Facet& facet = facets_[receivers.facetOf(i)];
        facet.normalSum += glm::dvec3(receivers.normalWorld(i));
        const double x = receivers.pixelX(i), y = receivers.pixelY(i);
        const glm::dvec3 p = starts.liftedStart(i);
        facet.sums[0] += x;
        facet.sums[1] += y;
        facet.sums[2] += x * x;
        facet.sums[3] += x * y;
        facet.sums[4] += y * y;
        facet.sums[5] += 1;
        facet.pointSums[0] += p;
        facet.pointSums[1] += p * x;
        facet.pointSums[2] += p * y;
    }
    for (uint32_t f = 0; f < receivers.facetCount(); ++f)
        makeFrame(facets_[f]);

    std::fill(bounds_, bounds_ + receivers.binCount(), Bounds{});
    for (size_t i = 0; i < receivers.count(); ++i) {
        Facet& facet = facets_[receivers.facetOf(i)];
        Bounds& bounds = bounds_[receivers.binOf(i)];
        const glm::dvec3 p = starts.liftedStart(i);
        const glm::dvec3 at(glm::dot(facet.side[0], p), glm::dot(facet.side[1], p),
                            glm::dot(facet.side[2], p));
        bounds.low = glm::min(bounds.low, at);
        bounds.high = glm::max(bounds.high, at);
        const glm::dvec3 away = glm::dvec3(receivers.normalWorld(i)) - facet.axis[2];
        facet.spread = std::max(facet.spread, glm::dot(away, away));
    }
    for (uint32_t f = 0; f < receivers.facetCount(); ++f)
        facets_[f].spread = std::sqrt(facets_[f].spread) + 1e-12;
}

ShaftBase LitProof::baseOf(uint32_t facet, uint32_t firstPart, uint32_t partCount) const {
    const Facet& f = facets_[facet];
    Bounds all;
    for (uint32_t p = firstPart; p < firstPart + partCount; ++p) {
        all.low = glm::min(all.low, bounds_[facet * kParts + p].low);
        all.high = glm::max(all.high, bounds_[facet * kParts + p].high);
    }
    ShaftBase base;
    for (int c = 0; c < 8; ++c)
        base.corner[c] = f.axis[0] * ((c & 1) ? all.high.x : all.low.x) +
                         f.axis[1] * ((c & 2) ? all.high.y : all.low.y) +
                         f.axis[2] * ((c & 4) ? all.high.z : all.low.z);
    for (int a = 0; a < 3; ++a)
        base.side[a] = f.side[a];
    base.normal = f.axis[2];
    base.normalSpread = f.spread;
    base.above = &f.above;
    return base;
}

bool LitProof::areLit(const DagView& dag, View<const uint32_t> samples) {
    segments_.resize(samples.count);
    blocked_.resize(samples.count);
    receivers_->starts().segments(lightWorld_, samples, segments_.data());
    traceStream(dag, viewOf(segments_), viewOf(blocked_));
    return isMutant(Mutant::kProofBlind) ||
           std::find_if(blocked_.begin(), blocked_.end(), [](uint8_t b) { return b != 0; }) ==
               blocked_.end();
}

bool LitProof::provesLit(const DagView& dag, uint32_t facet, uint32_t firstPart,
                         uint32_t partCount) {
    const uint32_t begin = askedStart_[facet * kParts + firstPart],
                   end = askedStart_[facet * kParts + firstPart + partCount];
    if (begin == end)
        return true;
    const View<const uint32_t> asked{asked_.data() + begin, end - begin};
    if (asked.count < kFewestForShaft)
        return areLit(dag, asked);
    // A few rays show whether a proof is likely, at a tenth of its cost.
    const uint32_t probes[] = {asked_[(begin + end) / 2], asked_[begin], asked_[end - 1]};
    if (!areLit(dag, {probes, 3}))
        return false;
    if (shaft_.make(receivers_->starts(), baseOf(facet, firstPart, partCount), asked,
                    lightWorld_) &&
        shaft_.isEmpty(dag.wide))
        return true;
    if (partCount == 1 || asked.count < kFewestToPart)
        return false;
    for (uint32_t quarter = 0; quarter < 4; ++quarter)
        if (!provesLit(dag, facet, firstPart + quarter * partCount / 4, partCount / 4))
            return false;
    return true;
}

bool LitProof::provesLit(const DagView& dag, const glm::vec3& lightWorld,
                         View<const uint8_t> isAsked) {
    if (dag.wide.words.empty())
        return false;
    lightWorld_ = lightWorld;
    receivers_->listAsked(isAsked, asked_, askedStart_);
    for (uint32_t f = 0; f < receivers_->facetCount(); ++f)
        if (!provesLit(dag, f, 0, kParts))
            return false;
    return true;
}

} // namespace shadowdag
