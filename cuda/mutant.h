// SPDX-License-Identifier: Apache-2.0
// Faults that a build with assertions can commit on request, one at a time, so that the checks of
// accuracy can be checked themselves: `shadowdag study mutants` runs each fault in a process of its
// own and records which check notices it. Source of the idea: DeMillo, Lipton, Sayward, Hints on
// Test Data Selection, Computer 1978. A build without assertions contains none of them: isMutant is
// false at compile time.
#pragma once

#include "cuda/macros.h"

#include <cstdint>

/// All faults: X(enumerator, name, what is wrong). The order is that of the published table.
#define SDAG_MUTANTS(X)                                                                            \
    X(kDagDilated, "dag-dilated", "each voxel occupies its 26 neighbours as well")                 \
    X(kDagEroded, "dag-eroded", "voxels with an empty neighbour along an axis are empty")          \
    X(kDagShifted, "dag-shifted", "all voxels are one voxel further along x")                      \
    X(kDagSubtreesSwapped, "dag-subtrees-swapped", "two octants of the root are exchanged")        \
    X(kDagSubtreeLost, "dag-subtree-lost", "one subtree of an eighth of the edge is empty")        \
    X(kDagBitsFlipped, "dag-bits-flipped", "one bit is flipped in a sixteenth of the leaves")      \
    X(kWideBitLost, "wide-bit-lost", "the wide form lacks the first voxel of each leaf")           \
    X(kRayOffsetZero, "ray-offset-zero", "voxel rays start on their own surface")                  \
    X(kRayOffsetDoubled, "ray-offset-doubled", "voxel rays start twice as far from their surface") \
    X(kRayNormalFlipped, "ray-normal-flipped", "voxel rays start behind their surface")            \
    X(kRayLightMoved, "ray-light-moved", "voxel rays end two voxels beside the light")             \
    X(kLiftEightfold, "lift-eightfold", "voxel rays start eight times as high over their surface") \
    X(kLevelTooCoarse, "level-too-coarse", "cells are a level coarser than their footprint")       \
    X(kRayLaneLost, "ray-lane-lost", "the last ray of each packet of voxel rays is lit")           \
    X(kBeliefTooWide, "belief-too-wide", "voxels are believed up to 4 times the displacement")     \
    X(kMoversIgnored, "movers-ignored", "rays are not tested against moving triangles")            \
    X(kMoversStale, "movers-stale", "the hierarchy of moving batches is not rebuilt")              \
    X(kExactLaneLost, "exact-lane-lost", "the last ray of each packet of exact rays is lit")       \
    X(kExactLeafSkipped, "exact-leaf-skipped", "one leaf of the triangles' hierarchy is empty")    \
    X(kExactNormalFlipped, "exact-normal-flipped", "exact rays start behind their surface")        \
    X(kExactLightMoved, "exact-light-moved", "exact rays end 2^-10 of their range beside it")      \
    X(kExactDoubtLit, "exact-doubt-lit", "uncertain tests of exact rays count as missed")          \
    X(kBeamLit, "beam-lit", "beams with a list of triangles count as lit")                         \
    X(kExactMasksIgnored, "exact-masks-ignored", "exact rays take cut triangles for whole ones")   \
    X(kEmbreeFilterOff, "embree-filter-off", "the truth accepts every hit that Embree reports")    \
    X(kMapTexelShifted, "map-texel-shifted", "lookups read the texel to the right")                \
    X(kMapCentreShifted, "map-centre-shifted", "taps compare half a texel beside their centre")    \
    X(kMapFaceHalved, "map-face-halved", "maps have half the texels that were asked")              \
    X(kMapBiasZero, "map-bias-zero", "lookups use no constant bias")                               \
    X(kMapBiasTenfold, "map-bias-tenfold", "lookups use ten times the constant bias")              \
    X(kMapPageDropped, "map-page-dropped", "the first map lacks the middle row of its pages")      \
    X(kMapFaceMirrored, "map-face-mirrored", "lookups mirror the columns of the face -y")          \
    X(kMapPlaneDropped, "map-plane-dropped", "taps are compared without the receiver's plane")     \
    X(kMapTapsDoubled, "map-taps-doubled", "the filter has 9 taps where 4 are stated")             \
    X(kMapWeightsSwapped, "map-weights-swapped", "the filter's weights are reversed")              \
    X(kMapSeamClamped, "map-seam-clamped", "taps beyond a face read the border of the same face")  \
    X(kLookupLaneLost, "lookup-lane-lost", "the eighth lookup of a cluster in a cube map is lit")  \
    X(kMapMarginZero, "map-margin-zero", "pages are marked without the filter's margin")           \
    X(kBatchCulled, "batch-culled", "one batch in eight is drawn into no map")                     \
    X(kDepthLimitHalved, "depth-limit-halved", "culling keeps batches to half the depth only")     \
    X(kFaceSkipped, "face-skipped", "the face -y of maps is not drawn")                            \
    X(kRasterLaneLost, "raster-lane-lost", "the last of each four triangles is not drawn")         \
    X(kRasterNearLost, "raster-near-lost", "triangles across the light's plane are not drawn")     \
    X(kFloorTooHigh, "floor-too-high", "a page's least depth is taken for its greatest")           \
    X(kPagesKeptStale, "pages-kept-stale", "kept pages are not drawn again after a move")          \
    X(kMapsKeptStale, "maps-kept-stale", "maps are kept although their light moved")               \
    X(kPagesNotCleared, "pages-not-cleared", "pages that get memory keep its old content")         \
    X(kLightShort, "light-short", "clusters beyond 3/4 of the first light's range lack it")        \
    X(kLightPulled, "light-pulled", "lookups and rays of the frame see the first light moved")     \
    X(kRoutesSwapped, "routes-swapped", "the first two maps answer for each other's light")        \
    X(kOrderWithoutMaps, "order-without-maps", "lights are reordered, their maps are not")         \
    X(kProofBlind, "proof-blind", "the proof of light accepts clusters with a blocked ray")        \
    X(kFacingLost, "facing-lost", "a cluster's first sample decides that it faces no light")       \
    X(kBoxShrunk, "box-shrunk", "clusters' boxes have nine tenths of their size")                  \
    X(kMarkLost, "mark-lost", "the last sample of each cluster asks for no light")                 \
    X(kSampleMoved, "sample-moved", "the G-buffer is seen from one pixel to the right")            \
    X(kSeenBatchLost, "seen-batch-lost", "one batch in eight is not in the G-buffer")

namespace shadowdag {

enum class Mutant : uint8_t {
    kNone,
#define SDAG_ENUMERATOR(enumerator, name, what) enumerator,
    SDAG_MUTANTS(SDAG_ENUMERATOR)
#undef SDAG_ENUMERATOR
};

/// The texts of a fault.
struct MutantText {
    Mutant mutant;
    const char* name; ///< as SHADOWDAG_MUTANT and the study "mutants" spell it
    const char* what; ///< is wrong
};

inline constexpr MutantText kMutantTexts[] = {
#define SDAG_TEXT(enumerator, name, what) {Mutant::enumerator, name, what},
    SDAG_MUTANTS(SDAG_TEXT)
#undef SDAG_TEXT
};

/// Whether this build contains the faults: it does where SDAG_ASSERT is checked.
#if defined(SDAG_ASSERTIONS) || !defined(NDEBUG)
#define SDAG_HAS_MUTANTS 1
inline constexpr bool kHasMutants = true;
#else
#define SDAG_HAS_MUTANTS 0
inline constexpr bool kHasMutants = false;
#endif

/// The environment variable that names the fault of a process.
inline constexpr const char* kMutantVariable = "SHADOWDAG_MUTANT";

#if SDAG_HAS_MUTANTS
namespace detail {

/// The fault of this process: that of kMutantVariable, read before main. A name that is not in the
/// table ends the process with a message and status 1.
extern Mutant chosenMutant;
/// Counts a use of the chosen fault.
void countMutantUse();

} // namespace detail

/// Returns how often the fault of this process changed something.
uint64_t mutantUseCount();
#endif

/// Returns the fault of this process.
inline Mutant chosenMutant() {
#if SDAG_HAS_MUTANTS
    return detail::chosenMutant;
#else
    return Mutant::kNone;
#endif
}

/// Returns whether this process commits a fault, and counts its use if so. False on devices and in
/// builds without assertions, at compile time. Thread safe.
SDAG_HD inline bool isMutant([[maybe_unused]] Mutant mutant) {
#if SDAG_HAS_MUTANTS && !defined(__CUDA_ARCH__)
    if (detail::chosenMutant != mutant)
        return false;
    detail::countMutantUse();
    return true;
#else
    return false;
#endif
}

/// Returns `right`, or `wrong` where this process commits the fault.
template <class T> SDAG_HD inline T mutated(Mutant mutant, const T& right, const T& wrong) {
    return isMutant(mutant) ? wrong : right;
}

} // namespace shadowdag
