// SPDX-License-Identifier: Apache-2.0
// The variants of the method by name, in the paper's spelling: `PMCD-EB-SO-4SM-u2`. Source: Olsson,
// Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual Shadow Maps for Many Lights, TVCG
// 2015, sec. VII. A name contains everything that distinguishes variants; omitted parts have the
// paper's default, not ours: implicit cluster bounds, four maps per light, no state kept, no pair
// removed.
//
// A name is parts joined by '-', in any order, each at most once:
//   Sphere | CFM | PMC | PMCD | PMCC  which batches are drawn into which faces (MapCulling); one of
//            them unless the name has Hybrid or RT. PMCC, a depth a cell, and Sphere, no culling,
//            are ours
//   EB | TB  explicit cluster bounds; or those of the samples, which are ours (none: implicit)
//   SO | SOR static optimization; or with pages retained while the pool has room, which is ours
//   Nk<k>    normal clustering, k x k directions a face, 1 to 16
//   PLOD<t>  polygon level of detail, t texels a triangle may deviate by
//   FP | LP  no page for (cluster, light) pairs without an exact pair; or for these and those that
//            the voxels prove lit (PairPruning; ours)
//   SP       pages only for what the samples' lookups read, not for all that their clusters' boxes
//            cover (PageMarks; ours)
//   RP       the required resolution by the receiver's plane (ResolutionRule; ours; none: the
//            paper's equation 1)
//   RL       light lists reordered for coherent shading
//   <n>SM    maps a light, 1 to 16 [4]
//   u<d>     undersampling by d, 1 to 1024 [1]
//   T<n>     taps of the filter, 1, 4 or 9 [9, the paper's; or --taps]
//   RT       every light by rays; also spelled "Ray Tracing" or all-rays
//   Hybrid   rays for maps under 96 texels; Hybrid:MODEL by another model, an expression with '-'
//            in parentheses, as in Hybrid:expr:(texels-96). Without a culling it is PMCD, and EB
//            unless it names bounds, as in the paper
//   RH<m>    with Hybrid, over frames in sequence: a map changes its method only when the other is
//            cheaper by more than the factor 1 + m, 0 to 1000 (FrameOptions::routeMargin; ours);
//            RH is RH0.1 [--route-margin]
//
// Rays of RT and Hybrid go through all voxels, as the paper's, or as --believe says.
//
// A variant has one name, its parts in this order, without defaults: 4SM, u1, Hybrid's PMCD-EB, and
// T<n> and RH<m> if --taps and --route-margin have the same value. Results and files contain that
// name, however it was spelled.
#pragma once

#include "tools/settings/experiment.h"

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Returns the help text about names of variants, with their parts.
std::string variantsHelp();

/// Taps if neither a name nor --taps sets them, and the voxels that are believed unless --believe
/// says it: the paper's.
constexpr uint32_t kPaperTaps = 9;
constexpr float kPaperBelieve = std::numeric_limits<float>::infinity();

/// A variant: everything that its name contains.
struct Variant {
    enum class Method : uint8_t { kMaps, kRays, kHybrid };

    Method method = Method::kMaps;
    std::string model; ///< of kHybrid, as makeCostModel takes it
    MapCulling culling = MapCulling::kMaximumDepth;
    ClusterBounds bounds = ClusterBounds::kImplicit;
    bool useStaticOptimization = false, retainsPages = false;
    uint32_t normalClusters = 0; ///< k of Nk; 0: by position alone
    float lodTexels = 0;         ///< 0: full detail
    PairPruning pruning = PairPruning::kNone;
    PageMarks pageMarks = PageMarks::kBoxes;
    ResolutionRule resolutionRule = ResolutionRule::kSphere;
    bool reorderLights = false;
    uint32_t mapsPerLight = 4;
    float undersample = 1;
    uint32_t taps = 0;                ///< 0: not given
    std::optional<float> routeMargin; ///< of kHybrid; nothing: not given

    bool operator==(const Variant&) const = default;
};

/// Returns the variant of a name. Throws Error kUsage naming the option, the name, the part and its
/// position, for a part that is unknown, out of range, duplicate or contradicting another, and for
/// a name without any method.
Variant parseVariant(const std::string& option, const std::string& name);

/// Returns the canonical name of a variant, parts in the order of this file's head, without
/// defaults: parseVariant gives the variant back, and all spellings of a variant have one name.
std::string variantName(const Variant& variant);

/// Returns whether a variant's name sets the setting of that key, one of those that names may leave
/// to options ("taps", "route_margin").
bool saysSetting(const Variant& variant, const std::string& key);

/// Returns the names of a list of variants, canonical, in order, each once: `paper` is replaced by
/// those of paperVariants() that the list does not contain. Throws as parseVariant does, and Error
/// kUsage for two spellings of one variant.
/// @param base settings that names may omit: taps, margin of routes
std::vector<std::string> parseVariants(const std::string& option,
                                       const std::vector<std::string>& names,
                                       const FrameOptions& base);

/// Returns the variants of the paper's evaluation, canonical: cullings, EB, SO, maps per light,
/// undersampling, Nk3, polygon level of detail, rays, hybrid.
const std::vector<std::string>& paperVariants();

/// Returns a configuration with the variant's switches set and all others as in `base`.
/// @param base parameters that names do not contain: size, page size, pool, bias, taps, rays,
/// margin
RunParameters variantRun(const Variant& variant, const FrameOptions& base);

/// Returns the variant of a configuration of maps, dag or hybrid.
Variant variantOf(const RunParameters& run);

} // namespace shadowdag
