// SPDX-License-Identifier: Apache-2.0
// The one table of bands, each with its derivation, and the one table of what is known instead.
//
// Words used throughout. An outline is wrong by a strip as wide as its distance from where voxels
// or texels put it: anywhere between none and a whole one, evenly, so half of one on average with a
// standard deviation of sqrt(1/12), 0.577 of the mean. Of K outlines at places of their own the
// mean has 0.577 / sqrt(K); three of these, a = 1.73 / sqrt(K), is what the error may move by when
// only the places change.
#include "tools/studies/stability.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

constexpr StabilityPart kTime = StabilityPart::kTime, kPerturbation = StabilityPart::kPerturbation,
                        kNumeric = StabilityPart::kNumeric,
                        kResolution = StabilityPart::kResolution;
constexpr MatrixMethod kMaps = MatrixMethod::kMaps, kDag = MatrixMethod::kDag,
                       kExact = MatrixMethod::kDagExact, kHybrid = MatrixMethod::kHybrid;
using Limits = std::pair<double, double>;

/// What three pairs more or less change.
double threeOf(const BandInputs& in) {
    return 3.0 / std::max(in.count, 1.0);
}

double placesOf(const BandInputs& in) {
    return 1.73 / std::sqrt(std::max(in.outlineCount, 1.0));
}

/// What `share` of the wrong pairs being others changes at most: that share, three standard
/// deviations of its count, and three pairs.
double othersOf(const BandInputs& in, double share) {
    return share * in.base + 3.0 * std::sqrt(share * in.base / std::max(in.count, 1.0)) +
           threeOf(in);
}

Limits tiny(const BandInputs& in) {
    const double others = othersOf(in, 0.004);
    return {std::max(in.base - others, 0.0), in.base + others};
}

/// Rounding in the unit that the method answers in: rays know nothing of texels, maps nothing of
/// voxels.
double spacingOf(const BandInputs& in) {
    return in.method == kMaps     ? in.texelSpacing
           : in.method == kHybrid ? std::max(in.voxelSpacing, in.texelSpacing)
                                  : in.voxelSpacing;
}

Limits shifted(const BandInputs& in) {
    const double a = placesOf(in), far = 6.0 * spacingOf(in);
    return {std::max(in.base * (1.0 - a) - threeOf(in), 0.0),
            in.base * (1.0 + a + far) + threeOf(in)};
}

Limits turned(const BandInputs& in, double factor, double least, double greatest) {
    const double a = placesOf(in);
    return {std::max(in.base * least / factor * (1.0 - a) - threeOf(in), 0.0),
            in.base * greatest * factor * (1.0 + a) + threeOf(in)};
}

/// At least one, and no more than there are.
Limits someOf(const BandInputs& in) {
    return {1.0, std::max(in.count, 1.0)};
}

Limits unitRate(const BandInputs& in) {
    const double x = in.count * (in.count * in.count - 1.0) / 12.0;
    const double width = 1.44 * placesOf(in) / std::sqrt(std::max(x, 1e-3));
    return {1.0 - width, 1.0 + width};
}

/// Returns a row's group, case and method, for messages.
std::string nameOf(const Json& row) {
    return row["group"].get<std::string>() + ", " + row["case"].get<std::string>() + ", by " +
           row["method"].get<std::string>();
}

constexpr double kVoxelTurn = 1.732; // sqrt(3)
constexpr double kTexelTurn = 2.28;  // 27^(1/4)

} // namespace

const std::vector<StabilityBand>& stabilityBands() {
    static const std::vector<StabilityBand> bands = {
        {"exact rays are Embree's",
         kPerturbation,
         {"tiny", "tiny, aligned", "shifted", "shifted, aligned", "scaled", "scaled, aligned",
          "turned", "turned, aligned"},
         {kExact},
         "wrong_share",
         "0",
         "dag-exact asks the truth's own ray of the triangles in the voxels that it meets, "
         "relative "
         "to an origin in the scene; no motion takes that from it.",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},
        {"a thousandth changes four thousandths",
         kPerturbation,
         {"tiny", "scaled"},
         {kMaps, kDag, kHybrid},
         "wrong_share",
         "W0 +- (0.004 W0 + 3 sqrt(0.004 W0 / N) + 3 / N)",
         "Wrong pairs fill strips between the method's outline and the truth's, half a unit wide "
         "on "
         "average; when both outlines move by a thousandth of the unit at most 2 x 0.001 / 0.5 of "
         "these pairs become others. Floats of a scaled scene round by less than that.",
         tiny},
        {"a thousandth changes four thousandths, mean",
         kPerturbation,
         {"tiny", "scaled", "tiny, aligned", "scaled, aligned"},
         {kMaps},
         "mean_error",
         "E0 +- (0.004 E0 + 3 sqrt(0.004 E0 / N) + 3 / N)",
         "The filter is continuous in the receiver's place, so the mean error of maps moves as "
         "little, ties or not.",
         tiny},
        {"ties of voxels fall either way",
         kPerturbation,
         {"tiny, aligned", "scaled, aligned", "shifted, aligned"},
         {kDag, kHybrid},
         "wrong_share",
         "0 to W0 (1 + a + 6 s)",
         "A face in the plane between two voxels fills both (voxels are closed), the worst place "
         "that an outline can have; any rounding frees one of them. So the error may fall to none "
         "and never rises but as for any other scene far away (s: float spacing in voxels).",
         [](const BandInputs& in) -> Limits {
             return {0.0, shifted(in).second};
         }},
        {"ties of texels fall either way",
         kPerturbation,
         {"tiny, aligned", "scaled, aligned", "shifted, aligned"},
         {kMaps},
         "wrong_share",
         "W0 (1 - a) - 3 / N to W0 (1 + a + 6 s) + 3 / N",
         "Where an outline lies on a texel's centre the filter is half lit along it, and any "
         "rounding takes it to either side: places change.",
         shifted},
        {"far away floats are coarse",
         kPerturbation,
         {"shifted"},
         {kMaps, kDag, kHybrid},
         "wrong_share",
         "W0 (1 - a) - 3 / N to W0 (1 + a + 6 s) + 3 / N",
         "Rounding redraws the places of outlines. Samples lie up to sqrt(3) / 2 of the spacing s "
         "(in the method's unit, voxels or texels, the hybrid's whichever is finer) off their "
         "surface, and the truth and the lookup take what is "
         "nearer "
         "than 2^-22 of the coordinate, 2 s to 4 s, for one surface: outlines may move by 3 s, of "
         "a "
         "mean half.",
         shifted},
        {"turned voxels are wider",
         kPerturbation,
         {"turned"},
         {kDag},
         "wrong_share",
         "W0 h / h0 / sqrt(3) (1 - a) - 3 / N to W0 h / h0 sqrt(3) (1 + a) + 3 / N",
         "Along a direction n a voxel is |nx| + |ny| + |nz| wide, 1 to sqrt(3); and the cube "
         "around "
         "a turned scene is larger, so its voxels are (h over h0).",
         [](const BandInputs& in) { return turned(in, kVoxelTurn, in.voxelRatio, in.voxelRatio); }},
        {"turned voxels are wider, ties freed",
         kPerturbation,
         {"turned, aligned"},
         {kDag, kHybrid},
         "wrong_share",
         "0 to W0 max(h / h0, t / t0) 2.28 (1 + a) + 3 / N",
         "As for voxels and texels of other scenes, but what was a tie of voxels is one no more.",
         [](const BandInputs& in) -> Limits {
             return {0.0,
                     turned(in, kTexelTurn, 1.0, std::max(in.voxelRatio, in.texelRatio)).second};
         }},
        {"turned texels are wider or narrower",
         kPerturbation,
         {"turned", "turned, aligned"},
         {kMaps},
         "wrong_share",
         "W0 t / t0 / 2.28 (1 - a) - 3 / N to W0 t / t0 2.28 (1 + a) + 3 / N",
         "Texels of a cube's face fill solid angles that are 27^(1/2) times smaller at its corners "
         "than in its middle, so their sides vary by 27^(1/4) with where a shadow falls on the "
         "face; and a step of resolution may change all (t over t0).",
         [](const BandInputs& in) { return turned(in, kTexelTurn, in.texelRatio, in.texelRatio); }},
        {"turned hybrids are either",
         kPerturbation,
         {"turned"},
         {kHybrid},
         "wrong_share",
         "as voxels and texels, whichever is wider",
         "Routes may change as well, so it is no less and no more than either method's.",
         [](const BandInputs& in) {
             return turned(in, kTexelTurn, std::min(in.voxelRatio, in.texelRatio),
                           std::max(in.voxelRatio, in.texelRatio));
         }},
        {"no motion leaves anything without a name",
         kPerturbation,
         {"tiny", "tiny, aligned", "shifted", "shifted, aligned", "scaled", "scaled, aligned",
          "turned", "turned, aligned"},
         {kMaps, kDag, kExact, kHybrid},
         "unnamed_share",
         "0 to U0 + 3 / N",
         "What shifts miss is settled by asking the truth for the triangle or along the taps' own "
         "rays (hybrid/judge/explain.h), which are where the rounded map has them; three are left.",
         [](const BandInputs& in) -> Limits {
             return {0.0, in.base + threeOf(in)};
         }},
        {"far away rounding leads out of the shifts' reach",
         kPerturbation,
         {"shifted", "shifted, aligned"},
         {kMaps, kHybrid},
         "unexplained_share",
         "0 to U0 + 3 / N + 2 W0 max(0, 1 + 3 s - r)",
         "An outline of a map is off by up to a texel and, far away, by up to 3 s more (s: float "
         "spacing in texels). Shifts reach r texels, 1 and half the diagonal of the filter; what "
         "lies beyond is a strip of that width, and half a texel holds W0.",
         [](const BandInputs& in) -> Limits {
             const double beyond = std::max(0.0, 1.0 + 3.0 * in.texelSpacing - in.reachTexels);
             return {0.0, in.base + threeOf(in) + 2.0 * in.wrongShare * beyond};
         }},
        {"no motion leaves anything unexplained",
         kPerturbation,
         {"tiny", "tiny, aligned", "shifted", "shifted, aligned", "scaled", "scaled, aligned",
          "turned", "turned, aligned"},
         {kMaps, kDag, kExact, kHybrid},
         "unexplained_share",
         "0 to U0 + 3 / N",
         "A shift by no more than the method's own resolution explains a wrong pair wherever the "
         "scene stands; three are left to what 32 shifts miss.",
         [](const BandInputs& in) -> Limits {
             return {0.0, in.base + threeOf(in)};
         }},

        {"hybrids are of both",
         kPerturbation,
         {"unperturbed", "unperturbed, aligned"},
         {kHybrid},
         "least_served_count",
         "1 and more",
         "Maps drawn or maps traced, whichever are fewer: a hybrid that is one of the methods "
         "alone "
         "proves what that method proved.",
         someOf},

        {"a still light's answers stay",
         kTime,
         {"camera path"},
         {kMaps, kDag, kExact, kHybrid},
         "held_flicker_share",
         "0",
         "Voxels and triangles do not know the camera, and a map of the same resolution holds the "
         "same texels: a point's answer is the same number in every frame.",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},
        {"a moving light's outlines sweep as the truth's do",
         kTime,
         {"moving lights"},
         {kMaps, kDag, kHybrid},
         "held_flicker_share",
         "0 to (1 + a) T",
         "A shadow's outline sweeps about the same area by the method as by the truth, only not "
         "the "
         "same places at the same time: at worst every change by the method is a flicker, as many "
         "as "
         "the truth changes itself (T).",
         [](const BandInputs& in) -> Limits {
             return {0.0, (1.0 + placesOf(in)) * in.truthChange};
         }},
        {"exact rays never flicker",
         kTime,
         {"moving lights"},
         {kExact},
         "held_flicker_share",
         "0",
         "dag-exact asks the truth's own ray.",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},
        {"without holding resolutions switch",
         kTime,
         {"camera path", "moving lights"},
         {kMaps, kHybrid},
         "resolution_switch_answer_count",
         "1 to N, every frame for itself",
         "What is held must be something: where nothing switches, holding has nothing to lessen.",
         someOf},
        {"without holding routes switch",
         kTime,
         {"camera path", "moving lights"},
         {kHybrid},
         "method_switch_answer_count",
         "1 to N, every frame for itself",
         "The threshold lies among the resolutions that requests waver over.",
         someOf},
        {"holding lessens flicker at switches",
         kTime,
         {"camera path", "moving lights"},
         {kMaps, kHybrid},
         "switch_flicker_share",
         "0 to F + 3 sqrt(F / N), F with less held",
         "Resolutions, then routes, are held while they are good enough; fewer switches, fewer "
         "changes at them, within three standard deviations of the count.",
         [](const BandInputs& in) -> Limits {
             return {0.0, in.base + 3.0 * std::sqrt(in.base / std::max(in.count, 1.0))};
         }},

        {"what touches is never lost",
         kNumeric,
         {"rays"},
         {kDag},
         "lost_count",
         "0",
         "The slab test grows boxes by what it may round (voxel/ray_slabs.h).",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},
        {"nothing stops beyond two margins",
         kNumeric,
         {"rays"},
         {kDag},
         "too_far_count",
         "0",
         "It may round outwards once more by as much.",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},
        {"every tracer gives the same bits",
         kNumeric,
         {"rays"},
         {kDag},
         "mismatch_count",
         "0",
         "The answer is a predicate box by box, whatever the order and the width.",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},
        {"every texel has one place",
         kNumeric,
         {"faces"},
         {kMaps},
         "mismatch_count",
         "0",
         "Face and texel are those that integers find, or, where the border to the next texel is "
         "nearer than n 2^-22 texels, that one.",
         [](const BandInputs&) -> Limits {
             return {0.0, 0.0};
         }},

        {"outlines are wrong by their unit",
         kResolution,
         {"outlines"},
         {kDag, kMaps},
         "mean_error_rate",
         "1 +- 3 x 0.577 x 1.44 / sqrt(K) / sqrt(X)",
         "The wrong area is an outline's length times a share of a voxel or texel, so the rate is "
         "1. "
         "Each point scatters by 0.577 / sqrt(K), times 1.44 in octaves, and the slope through n "
         "points an octave apart by that over the root of X = n (n^2 - 1) / 12.",
         unitRate},
        {"thin things are, once they are resolved",
         kResolution,
         {"thin"},
         {kDag},
         "mean_error_rate",
         "as outlines, through voxels of a quarter of the gaps and less",
         "Coarser voxels close the gaps, and all is dark that can be: no rate.",
         unitRate},
    };
    return bands;
}

const std::vector<KnownBreak>& knownBreaks() {
    // What is given are the slopes measured once, a twentieth to both sides.
    static const std::vector<KnownBreak> breaks = {
        {"resolution-wires", "thin", "maps", "mean_error_rate", 1.04, 1.14,
         "At the grate texels are 4 cm wide at undersample 4 and wires 12 mm: the two coarsest "
         "maps "
         "miss whole wires, which is all the error there can be, so the local rate is 0.6 there; "
         "it "
         "is 1.5 where wires come to be drawn and 1.2 beyond, by the filter's four taps."},
        {"resolution-atrium", "mixed", "dag", "mean_error_rate", 0.65, 0.75,
         "Rails, leaves and carvings are narrower than coarse voxels (0.4 m at 64^3), where voxels "
         "run together and cannot err more; as they part the local rate rises, from 0.58 to 0.91 "
         "between 2048 and 4096. Contact shadows lost within the offset are a seventh of the error "
         "at 64^3 and under a hundredth at 4096^3."},
        {"resolution-atrium", "mixed", "maps", "mean_error_rate", 0.72, 0.82,
         "The same rails and leaves, narrower than coarse texels: the local rate rises from 0.66 "
         "to "
         "0.87."},
        {"resolution-necropolis", "mixed", "dag", "mean_error_rate", 0.29, 0.39,
         "Leaves are as small as the finest voxel (26 mm) and lie over one another: outlines get "
         "longer the finer one looks, the rate of length l ~ h^-(D-1) being 2 - D. The local rate "
         "is 0.2 at 64^3 and 0.47 at 4096^3, far from 1: depth alone does not mend this scene."},
        {"resolution-necropolis", "mixed", "maps", "mean_error_rate", 0.38, 0.48,
         "The same leaves: the local rate rises from 0.36 to 0.53. A quarter of the error at "
         "undersample 4, a tenth at 1/4, is contact within the bias of half a texel."},
    };
    return breaks;
}

void requireEvidence(const Json& row, uint64_t pairCount, uint64_t occludedCount) {
    if (occludedCount > 0 && occludedCount < pairCount)
        return;
    throw Error(ErrorKind::kInput,
                nameOf(row) + ": of " + std::to_string(pairCount) + " pairs " +
                    std::to_string(occludedCount) +
                    " are dark by the truth, so no shadow has an edge and nothing can be wrong; "
                    "give the group another scene or view");
}

double shareOf(const Json& row, const char* what, uint64_t part, uint64_t whole) {
    if (whole == 0)
        throw Error(ErrorKind::kInput, nameOf(row) + ": there are no " + what +
                                           ", and a share of nothing holds in every band; give the "
                                           "group another scene or more pixels");
    return double(part) / double(whole);
}

void addChecks(Json& checks, StabilityPart part, const Json& row, const std::string& measure,
               double value, const BandInputs& inputs) {
    const std::string kind = row["kind"], method = row["method"], group = row["group"];
    const auto add = [&](double low, double high, const std::string& band) {
        checks.push_back({{"part", kStabilityPartNames[size_t(part)]},
                          {"group", group},
                          {"case", row["case"]},
                          {"kind", kind},
                          {"method", method},
                          {"measure", measure},
                          {"value", value},
                          {"low", low},
                          {"high", high},
                          {"band", band},
                          {"holds", value >= low && value <= high}});
    };
    for (const KnownBreak& known : knownBreaks())
        if (known.group == group && known.kind == kind && known.method == method &&
            known.measure == measure)
            return add(known.low, known.high, "known");
    for (const StabilityBand& band : stabilityBands()) {
        const auto isMethod = [&](MatrixMethod m) {
            return kMatrixMethodNames[size_t(m)] == method;
        };
        if (band.part != part || band.measure != measure ||
            std::find(band.kinds.begin(), band.kinds.end(), kind) == band.kinds.end() ||
            std::none_of(band.methods.begin(), band.methods.end(), isMethod))
            continue;
        BandInputs ofRow = inputs;
        for (int m = 0; m < kMatrixMethodCount; ++m)
            if (isMethod(MatrixMethod(m)))
                ofRow.method = MatrixMethod(m);
        const auto [low, high] = band.limits(ofRow);
        return add(low, high, band.id);
    }
}

} // namespace shadowdag
