// SPDX-License-Identifier: Apache-2.0
#include "voxel/receiver_groups.h"

#include <algorithm>

namespace shadowdag {

namespace {

/// Samples join the first facet whose first normal is within 18 degrees of theirs.
constexpr float kFacetCosine = 0.95f;

} // namespace

void ReceiverGroups::reset(const VoxelGrid& grid, float offset) {
    starts_.reset(grid, offset);
    hasStarts_ = true;
    normals_.clear();
    pixel_.clear();
}

void ReceiverGroups::reset() {
    hasStarts_ = false;
    normals_.clear();
    pixel_.clear();
}

void ReceiverGroups::add(const glm::vec3& positionWorld, const glm::vec3& normalWorld, uint32_t x,
                         uint32_t y) {
    SDAG_ASSERT(x < kTileSide && y < kTileSide);
    if (hasStarts_)
        starts_.add(positionWorld, normalWorld);
    normals_.push_back(normalWorld);
    pixel_.push_back(uint16_t(x | y << 8));
}

uint32_t ReceiverGroups::binOf(size_t sample) const {
    // The 8 x 8 block of the tile, numbered so that quarters are four in a row.
    const uint32_t x = pixelX(sample) >> 3, y = pixelY(sample) >> 3;
    return facetOf_[sample] * kParts + ((x & 1) | (y & 1) << 1 | (x >> 1 & 1) << 2 | (y >> 1) << 3);
}

void ReceiverGroups::build() {
    const uint32_t count = uint32_t(normals_.size());
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
                    ++facetCount_;
                } else {
                    f = kFacets - 1;
                }
            }
        }
        last = f;
        facetOf_[i] = uint8_t(f);
    }

    std::fill(binStart_, binStart_ + binCount() + 1, 0);
    for (uint32_t i = 0; i < count; ++i)
        ++binStart_[binOf(i) + 1];
    for (uint32_t b = 0; b < binCount(); ++b)
        binStart_[b + 1] += binStart_[b];
    sorted_.resize(count);
    uint32_t next[kFacets * kParts];
    std::copy(binStart_, binStart_ + binCount(), next);
    for (uint32_t i = 0; i < count; ++i)
        sorted_[next[binOf(i)]++] = i;
}

void ReceiverGroups::listAsked(View<const uint8_t> isAsked, std::vector<uint32_t>& asked,
                               uint32_t* binStart) const {
    SDAG_ASSERT(isAsked.count == count());
    asked.clear();
    for (uint32_t b = 0; b < binCount(); ++b) {
        if (binStart)
            binStart[b] = uint32_t(asked.size());
        for (uint32_t i = binStart_[b]; i < binStart_[b + 1]; ++i)
            if (isAsked[sorted_[i]])
                asked.push_back(sorted_[i]);
    }
    if (binStart)
        binStart[binCount()] = uint32_t(asked.size());
}

} // namespace shadowdag
