// SPDX-License-Identifier: Apache-2.0
// The variants of the method by name, as the paper spells them: `PMCD-EB-SO-4SM-u2`. Source:
// Olsson, Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual Shadow Maps for Many Lights,
// TVCG 2015, sec. VII. A name says everything that tells variants apart; what it leaves out is at
// the paper's default, not at ours: implicit cluster bounds, four maps a light, nothing kept, no
// pair taken out.
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
// A variant has one name, its parts in this order, without those that say what holds anyhow: 4SM,
// u1, Hybrid's PMCD-EB, T<n> and RH<m> where --taps and --route-margin say the same. Results and
// files carry that name, however it was spelled.
#pragma once

#include "tools/settings/experiment.h"

#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Returns what --help says of names of variants, their parts included.
std::string variantsHelp();

/// Taps where neither a name nor --taps says them: the paper's.
constexpr uint32_t kPaperTaps = 9;

/// A variant: everything that its name says.
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
    ResolutionRule resolutionRule = ResolutionRule::kSphere;
    bool reorderLights = false;
    uint32_t mapsPerLight = 4;
    float undersample = 1;
    uint32_t taps = 0;                ///< 0: not named
    std::optional<float> routeMargin; ///< of kHybrid; nothing: not named

    bool operator==(const Variant&) const = default;
};

/// Returns the variant that `name` names. Throws Error kUsage naming the option, the name, the part
/// and its position, for a part that is unknown, out of range, there twice or contradicting
/// another, and for a name without any method.
Variant parseVariant(const std::string& option, const std::string& name);

/// Returns the one name of a variant, parts in the order of this file's head, defaults left out:
/// parseVariant gives the variant back, and all spellings of a variant have one name.
std::string variantName(const Variant& variant);

/// Returns whether a variant's name says the setting of that key, of those that names may leave to
/// options ("taps", "route_margin").
bool saysSetting(const Variant& variant, const std::string& key);

/// Returns the names that a list of variants means, canonical, in order, each once: `paper` stands
/// for those of paperVariants() that the list does not name itself. Throws as parseVariant does,
/// and Error kUsage for two spellings of one variant.
/// @param base what names may leave out: taps, margin of routes
std::vector<std::string> parseVariants(const std::string& option,
                                       const std::vector<std::string>& names,
                                       const FrameOptions& base);

/// Returns what the paper's evaluation measured, canonical: cullings, EB, SO, maps a light,
/// undersampling, Nk3, polygon level of detail, rays, hybrid.
const std::vector<std::string>& paperVariants();

/// Returns a configuration with the variant's switches set and all others as in `base`.
/// @param base parameters that names do not say: size, page size, pool, bias, taps, rays, margin
RunParameters variantRun(const Variant& variant, const FrameOptions& base);

/// Returns the variant that a configuration of maps, dag or hybrid is.
Variant variantOf(const RunParameters& run);

} // namespace shadowdag
