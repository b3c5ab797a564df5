// SPDX-License-Identifier: Apache-2.0
#include "voxel/shaft_receivers.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// Samples join the first facet whose first normal is within 18 degrees of theirs.
constexpr float kFacetCosine = 0.95f;

/// Fewer rays than this cost less than the shaft that would save them.
constexpr uint32_t kFewestForShaft = 32;
/// A proof of darkness takes longer; rays that are blocked, less.
constexpr uint32_t kFewestForDark = 512;
/// Fewer than this are not parted further.
constexpr uint32_t kFewestToPart = 256;

/// Returns the number of an 8 x 8 block of the tile, so that quarters are four in a row.
uint32_t partOf(uint32_t pixel) {
    const uint32_t x = (pixel & 0xff) >> 3, y = pixel >> 11;
    return (x & 1) | (y & 1) << 1 | (x >> 1 & 1) << 2 | (y >> 1 & 1) << 3;
}

} // namespace

void ShaftReceivers::reset(const VoxelGrid& grid, float offset) {
    starts_.reset(grid, offset);
    normals_.clear();
    pixel_.clear();
}

void ShaftReceivers::add(const glm::vec3& positionWorld, const glm::vec3& normalWorld, uint32_t x,
                         uint32_t y) {
    SDAG_ASSERT(x < kTileSide && y < kTileSide);
    starts_.add(positionWorld, normalWorld);
    normals_.push_back(normalWorld);
    pixel_.push_back(uint16_t(x | y << 8));
}

void ShaftReceivers::makeFrame(Facet& f) const {
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
    // Skewed as the tile is on the facet, unless it would be a needle.
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

void ShaftReceivers::build() {
    const uint32_t count = uint32_t(starts_.count());
    facetCount_ = 0;
    facetOf_.resize(count);
    glm::vec3 first[kFacets];
    uint32_t last = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::vec3& n = normals_[i];
        uint32_t f = last;
        if (facetCount_ == 0 || !(glm::dot(first[f], n) >= kFacetCosine)) {
            for (f = 0; f < facetCount_ && !(glm::dot(first[f], n) >= kFacetCosine);)
                ++f;
            if (f == facetCount_) {
                if (f < kFacets) {
                    first[f] = n;
                    facets_[f] = Facet{};
                    ++facetCount_;
                } else {
                    f = kFacets - 1;
                }
            }
        }
        last = f;
        facetOf_[i] = uint8_t(f);
        Facet& facet = facets_[f];
        facet.normalSum += glm::dvec3(n);
        const double x = pixel_[i] & 0xff, y = pixel_[i] >> 8;
        const glm::dvec3 p = starts_.liftedStart(i);
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
    for (uint32_t f = 0; f < facetCount_; ++f)
        makeFrame(facets_[f]);

    const uint32_t binCount = facetCount_ * kParts;
    std::fill(partStart_, partStart_ + binCount + 1, 0);
    std::fill(bounds_, bounds_ + binCount, Bounds{});
    for (uint32_t i = 0; i < count; ++i) {
        Facet& facet = facets_[facetOf_[i]];
        const uint32_t bin = facetOf_[i] * kParts + partOf(pixel_[i]);
        ++partStart_[bin + 1];
        const glm::dvec3 p = starts_.liftedStart(i);
        const glm::dvec3 at(glm::dot(facet.side[0], p), glm::dot(facet.side[1], p),
                            glm::dot(facet.side[2], p));
        bounds_[bin].low = glm::min(bounds_[bin].low, at);
        bounds_[bin].high = glm::max(bounds_[bin].high, at);
        const glm::dvec3 away = glm::dvec3(normals_[i]) - facet.axis[2];
        facet.spread = std::max(facet.spread, glm::dot(away, away));
    }
    for (uint32_t f = 0; f < facetCount_; ++f)
        facets_[f].spread = std::sqrt(facets_[f].spread) + 1e-12;
    for (uint32_t b = 0; b < binCount; ++b)
        partStart_[b + 1] += partStart_[b];
    sorted_.resize(count);
    uint32_t next[kFacets * kParts];
    std::copy(partStart_, partStart_ + binCount, next);
    for (uint32_t i = 0; i < count; ++i)
        sorted_[next[facetOf_[i] * kParts + partOf(pixel_[i])]++] = i;
}

ShaftBase ShaftReceivers::baseOf(uint32_t facet, uint32_t firstPart, uint32_t partCount) const {
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

void ShaftReceivers::trace(const DagView& dag, View<const uint32_t> which, View<uint8_t> answers,
                           const std::vector<WideCell>* from) {
    segments_.resize(which.count);
    starts_.segments(lightWorld_, which, segments_.data());
    const View<const DagSegment> segments{segments_.data(), which.count};
    if (from)
        traceStream(dag, viewOf(*from), segments, answers);
    else
        traceStream(dag, segments, answers);
}

void ShaftReceivers::tracePending(const DagView& dag) {
    const size_t count = pending_.size();
    if (count == answers_.size()) { // all, in order
        trace(dag, viewOf(asked_), viewOf(answers_), nullptr);
        return;
    }
    which_.resize(count);
    blocked_.resize(count);
    for (size_t i = 0; i < count; ++i)
        which_[i] = asked_[pending_[i]];
    trace(dag, viewOf(which_), viewOf(blocked_), nullptr);
    for (size_t i = 0; i < count; ++i)
        answers_[pending_[i]] = blocked_[i];
}

ShaftAnswer ShaftReceivers::probe(const DagView& dag, uint32_t begin, uint32_t end) {
    const uint32_t which[] = {asked_[(begin + end) / 2], asked_[begin], asked_[end - 1]};
    DagSegment segments[3];
    starts_.segments(lightWorld_, {which, 3}, segments);
    const bool isDark = occluded(dag, segments[0]);
    if (isDark && end - begin < kFewestForDark)
        return ShaftAnswer::kMixed;
    for (int i = 1; i < 3; ++i)
        if (occluded(dag, segments[i]) != isDark)
            return ShaftAnswer::kMixed;
    if (!isDark)
        return ShaftAnswer::kLit;
    DagHit hit;
    occluded(dag, segments[0], 0, &hit);
    stopper_ = hit.cell;
    return ShaftAnswer::kDark;
}

void ShaftReceivers::putOff(uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i)
        pending_.push_back(i);
}

void ShaftReceivers::ask(const DagView& dag, uint32_t facet, uint32_t firstPart,
                         uint32_t partCount) {
    const uint32_t begin = askedStart_[facet * kParts + firstPart],
                   end = askedStart_[facet * kParts + firstPart + partCount];
    if (begin == end)
        return;
    if (end - begin < kFewestForShaft) {
        putOff(begin, end);
        return;
    }
    // A few rays say which proof may be had, at a tenth of its cost.
    const ShaftAnswer guess = probe(dag, begin, end);
    if (guess != ShaftAnswer::kMixed) {
        ++counts_->shaftCount;
        if (shaft_.make(starts_, baseOf(facet, firstPart, partCount),
                        {asked_.data() + begin, end - begin}, lightWorld_)) {
            const bool isLit = guess == ShaftAnswer::kLit;
            if (isLit ? shaft_.isEmpty(dag.wide, root_, cut_)
                      : shaft_.isParted(dag.wide, root_, stopper_)) {
                std::fill(answers_.begin() + begin, answers_.begin() + end, uint8_t(!isLit));
                (isLit ? counts_->litPairCount : counts_->darkPairCount) += end - begin;
                return;
            }
            if (isLit && !cut_.empty()) {
                if (mode_ == kOnlyProofs) {
                    putOff(begin, end);
                    return;
                }
                ++counts_->cutCount;
                counts_->cutCellCount += cut_.size();
                trace(dag, {asked_.data() + begin, end - begin},
                      {answers_.data() + begin, end - begin}, &cut_);
                return;
            }
        }
    }
    if (partCount > 1 && end - begin >= kFewestToPart) {
        for (uint32_t quarter = 0; quarter < 4; ++quarter)
            ask(dag, facet, firstPart + quarter * partCount / 4, partCount / 4);
        return;
    }
    putOff(begin, end);
}

bool ShaftReceivers::provesLit(const DagView& dag, uint32_t facet, uint32_t firstPart,
                               uint32_t partCount) {
    const uint32_t begin = askedStart_[facet * kParts + firstPart],
                   end = askedStart_[facet * kParts + firstPart + partCount];
    if (begin == end)
        return true;
    if (end - begin < kFewestForShaft) {
        blocked_.resize(end - begin);
        trace(dag, {asked_.data() + begin, end - begin}, viewOf(blocked_), nullptr);
        return std::find_if(blocked_.begin(), blocked_.end(), [](uint8_t b) { return b != 0; }) ==
               blocked_.end();
    }
    if (probe(dag, begin, end) != ShaftAnswer::kLit)
        return false;
    if (shaft_.make(starts_, baseOf(facet, firstPart, partCount),
                    {asked_.data() + begin, end - begin}, lightWorld_) &&
        shaft_.isEmpty(dag.wide, root_, cut_))
        return true;
    if (partCount == 1 || end - begin < kFewestToPart)
        return false;
    for (uint32_t quarter = 0; quarter < 4; ++quarter)
        if (!provesLit(dag, facet, firstPart + quarter * partCount / 4, partCount / 4))
            return false;
    return true;
}

bool ShaftReceivers::provesLit(const DagView& dag, const glm::vec3& lightWorld,
                               View<const uint8_t> isAsked) {
    SDAG_ASSERT(isAsked.count == count());
    listAsked(lightWorld, isAsked);
    root_.assign(1, WideCell{dag.wide.rootAddress, dag.wide.rootLevel, {0, 0, 0}});
    for (uint32_t f = 0; f < facetCount_; ++f)
        if (!provesLit(dag, f, 0, kParts))
            return false;
    return true;
}

void ShaftReceivers::listAsked(const glm::vec3& lightWorld, View<const uint8_t> isAsked) {
    lightWorld_ = lightWorld;
    asked_.clear();
    const uint32_t binCount = facetCount_ * kParts;
    for (uint32_t b = 0; b < binCount; ++b) {
        askedStart_[b] = uint32_t(asked_.size());
        for (uint32_t i = partStart_[b]; i < partStart_[b + 1]; ++i)
            if (isAsked[sorted_[i]])
                asked_.push_back(sorted_[i]);
    }
    askedStart_[binCount] = uint32_t(asked_.size());
}

void ShaftReceivers::answer(const DagView& dag, const glm::vec3& lightWorld,
                            View<const uint8_t> isAsked, View<uint8_t> blocked, ShaftCounts& counts,
                            Mode mode) {
    mode_ = mode;
    SDAG_ASSERT(isAsked.count == count() && blocked.count == count());
    listAsked(lightWorld, isAsked);
    const uint32_t total = uint32_t(asked_.size());
    if (total == 0)
        return;
    answers_.resize(total);
    ShaftCounts here;
    counts_ = &here;
    here.askedCount = 1;
    here.pairCount = total;
    pending_.clear();
    if (mode == kRays || dag.wide.words.empty()) {
        putOff(0, total);
    } else {
        root_.assign(1, WideCell{dag.wide.rootAddress, dag.wide.rootLevel, {0, 0, 0}});
        for (uint32_t f = 0; f < facetCount_; ++f)
            ask(dag, f, 0, kParts);
    }
    if (mode == kOnlyProofs)
        for (const uint32_t i : pending_)
            answers_[i] = kUnproven;
    else
        tracePending(dag);
    here.litCount = here.litPairCount == total;
    here.darkCount = here.darkPairCount == total;
    counts.add(here);
    for (uint32_t i = 0; i < total; ++i)
        blocked[asked_[i]] = answers_[i];
}

} // namespace shadowdag
