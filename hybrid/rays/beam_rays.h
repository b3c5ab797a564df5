// SPDX-License-Identifier: Apache-2.0
// The exact rays of a cluster by beams (beams.h), one light after the other.
#pragma once

#include "hybrid/rays/beams.h"
#include "hybrid/rays/shadow_rays.h"

#include <vector>

namespace shadowdag {

/// Answers the rays of one cluster after the other. Not thread-safe: one a thread.
class BeamRays {
public:
    /// @param cache begun with the hierarchy of `exact`
    BeamRays(const ExactView& exact, BeamCache& cache, StreamIsa isa = bestStreamIsa());

    /// Goes on to the samples of another cluster: sorts them into cells of surface about as wide as
    /// some pixels, those of a cell side by side.
    /// @param footprintWorld side of a pixel there, above 0
    /// @param sorted receives `samples` in the order in which they are to be asked
    void setCluster(View<const glm::vec3> positionWorld, View<const glm::vec3> normalWorld,
                    View<const uint32_t> samples, double footprintWorld,
                    std::vector<uint32_t>& sorted);
    /// Sets how the rays of the sorted samples start.
    void setStarts(View<const TruthStart> starts);
    bool hasStarts() const { return starts_.count != 0; }

    /// Sets isDark[i] for the samples that are asked (1, else 0) and whose beams are known; for
    /// others to anything. Returns how many are asked and not known: listOpen. Arrays by sorted
    /// sample; isAsked: readable up to a multiple of 16.
    /// @param light not directional
    uint32_t answer(uint32_t lightIndex, const Light& light, const uint8_t* isAsked,
                    View<uint8_t> isDark);
    /// Sets isOpen[i] to whether sample i was asked by the last answer, and is not known.
    void listOpen(View<uint8_t> isOpen) const;

private:
    struct Group {
        uint64_t key;
        float size;          ///< of the cell
        Box box;             ///< of its starts, local space
        uint32_t begin, end; ///< sorted samples
        BeamCache::Cell* cell;
    };
    struct Listed;

    /// The cells of a size.
    struct Cells {
        glm::vec3 originWorld;
        float inverseSize;
        uint64_t sizeBits;

        uint64_t keyOf(const glm::vec3& positionWorld, const glm::vec3& normal) const;
    };
    Cells cellsOf(int exponent) const; ///< of side 2^exponent
    uint32_t groupOf(uint64_t key, float size);
    /// Calls f(word, mask) for the words of bits that hold a group's samples.
    template <class F> static void forWords(const Group& group, const F& f) {
        for (uint32_t word = group.begin / 64; 64 * word < group.end; ++word) {
            uint64_t mask = ~uint64_t(0);
            if (64 * word < group.begin)
                mask <<= group.begin - 64 * word;
            if (group.end - 64 * word < 64)
                mask &= (uint64_t(1) << (group.end - 64 * word)) - 1;
            f(word, mask);
        }
    }
    uint32_t countOpen() const;
    void traceListed(const Group& group, const Beam& beam, const glm::dvec3& lightLocal,
                     View<uint8_t> isDark);

    ExactView exact_;
    BeamCache& cache_;
    StreamIsa isa_;
    std::vector<Group> groups_;
    std::vector<uint32_t> table_, usedSlots_; ///< of groups by key
    std::vector<uint32_t> groupOf_;
    View<const TruthStart> starts_;
    // By sorted sample:
    std::vector<float> start_[3], plane_[4]; ///< normal and offset of the receiver's plane
    std::vector<float> clear_;
    std::vector<uint32_t> receivers_;
    std::vector<uint64_t> active_, open_; ///< bits
};

} // namespace shadowdag
