// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/variants.h"

#include "cuda/error.h"
#include "hybrid/clusters/clusters.h"
#include "hybrid/routing/resolution.h"
#include "tools/settings/parse.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <map>
#include <utility>

namespace shadowdag {

namespace {

constexpr const char* kPaperModel = "texels:96";
constexpr float kUsualRouteMargin = 0.1f;

constexpr std::array<std::pair<const char*, MapCulling>, 5> kCullings{
    {{"Sphere", MapCulling::kSphere},
     {"CFM", MapCulling::kFaceMask},
     {"PMC", MapCulling::kProjectionMap},
     {"PMCD", MapCulling::kMaximumDepth},
     {"PMCC", MapCulling::kCellDepth}}};

/// One part of a name.
struct Part {
    std::string text;
    size_t position; ///< of its first character, from 1
    size_t number;   ///< from 1
};

/// Returns the position of the first '-' from `begin` on that is not in parentheses, or the end.
size_t findDash(const std::string& text, size_t begin) {
    int depth = 0;
    for (size_t i = begin; i < text.size(); ++i) {
        depth += text[i] == '(' ? 1 : text[i] == ')' ? -1 : 0;
        if (text[i] == '-' && depth <= 0)
            return i;
    }
    return text.size();
}

std::vector<Part> splitName(const std::string& name) {
    // The only part that contains a dash outside of parentheses.
    const std::string allRays = "all-rays";
    std::vector<Part> parts;
    for (size_t begin = 0; begin <= name.size();) {
        size_t end = findDash(name, begin);
        if (name.compare(begin, allRays.size(), allRays) == 0 &&
            (begin + allRays.size() == name.size() || name[begin + allRays.size()] == '-'))
            end = begin + allRays.size();
        parts.push_back({name.substr(begin, end - begin), begin + 1, parts.size() + 1});
        begin = end + 1;
    }
    return parts;
}

/// Returns the number in `text` between `prefix` and `suffix`, or nothing when the text has another
/// form.
std::optional<double> numberIn(const std::string& text, const std::string& prefix,
                               const std::string& suffix, bool isWhole) {
    if (text.size() <= prefix.size() + suffix.size() || !text.starts_with(prefix) ||
        !text.ends_with(suffix))
        return std::nullopt;
    const char* begin = text.data() + prefix.size();
    const char* end = text.data() + text.size() - suffix.size();
    const bool hasDigits = std::all_of(
        begin, end, [&](char c) { return (c >= '0' && c <= '9') || (c == '.' && !isWhole); });
    double value = 0;
    const auto [last, error] = std::from_chars(begin, end, value, std::chars_format::fixed);
    if (!hasDigits || last != end || error != std::errc())
        return std::nullopt;
    return value;
}

/// Returns a number in the spelling of names.
float spelled(double value) {
    return std::stof(numberText(value));
}

/// Returns whether the parenthesis at the beginning of a text closes at its end.
bool isWrapped(const std::string& text) {
    if (text.empty() || text.front() != '(' || text.back() != ')')
        return false;
    int depth = 0;
    for (size_t i = 0; i + 1 < text.size(); ++i) {
        depth += text[i] == '(' ? 1 : text[i] == ')' ? -1 : 0;
        if (depth == 0)
            return false;
    }
    return true;
}

/// Returns the canonical spelling of a cost model that makeCostModel accepts: thresholds as short
/// as possible, expressions without blanks and outer parentheses.
std::string modelSpelling(std::string model) {
    const std::string texels = "texels:", expression = "expr:";
    if (model.starts_with(texels) && model != "texels:inf") {
        double value = 0;
        std::from_chars(model.data() + texels.size(), model.data() + model.size(), value);
        char shortest[400]; // fits every finite double in any notation
        const auto [end, error] =
            std::to_chars(shortest, shortest + sizeof shortest, value, std::chars_format::fixed);
        return texels + std::string(shortest, end);
    }
    if (!model.starts_with(expression))
        return model;
    std::erase_if(model, [](char c) { return std::isspace(static_cast<unsigned char>(c)); });
    std::string text = model.substr(expression.size());
    while (isWrapped(text))
        text = text.substr(1, text.size() - 2);
    return expression + text;
}

/// Reads the parts of one name.
class NameReader {
public:
    NameReader(const std::string& option, const std::string& name) : option_(option), name_(name) {}

    Variant read() {
        for (const Part& part : splitName(name_))
            take(part);
        finish();
        return variant_;
    }

private:
    // Groups of parts that may contradict each other; RT also contradicts parts about maps.
    enum Kind {
        kMethod,
        kCulling,
        kBounds,
        kStatic,
        kNormals,
        kLod,
        kPruning,
        kPages,
        kResolution,
        kOrder,
        kMaps,
        kUndersample,
        kTaps,
        kRoutes,
        kKindCount
    };

    [[noreturn]] void refuse(const Part& part, const std::string& why) const {
        throw Error(ErrorKind::kUsage,
                    option_ + " '" + name_ + "': part " + std::to_string(part.number) + ", '" +
                        part.text + "' at character " + std::to_string(part.position) + ", " + why);
    }

    void claim(const Part& part, Kind kind) {
        if (claimed_[kind])
            refuse(part, "contradicts part " + std::to_string(claimed_[kind]->number) + ", '" +
                             claimed_[kind]->text + "': use one of them");
        claimed_[kind] = part;
    }

    double ranged(const Part& part, double value, double min, double max) const {
        if (value < min || value > max)
            refuse(part, "is out of range: use " + numberText(min) + " to " + numberText(max));
        return value;
    }

    /// Returns the remedy if an expression may have been cut at a '-'.
    std::string dashHint() const {
        return name_.find("Hybrid:expr:") == std::string::npos
                   ? ""
                   : "; put an expression with '-' in parentheses, as in "
                     "Hybrid:expr:(texels-96)";
    }

    void take(const Part& part) {
        const std::string& text = part.text;
        for (const auto& [spelling, culling] : kCullings)
            if (text == spelling) {
                claim(part, kCulling);
                variant_.culling = culling;
                return;
            }
        if (text == "EB" || text == "TB") {
            claim(part, kBounds);
            variant_.bounds = text == "EB" ? ClusterBounds::kExplicit : ClusterBounds::kTight;
        } else if (text == "SO" || text == "SOR") {
            claim(part, kStatic);
            variant_.useStaticOptimization = true;
            variant_.retainsPages = text == "SOR";
        } else if (const auto k = numberIn(text, "Nk", "", true)) {
            claim(part, kNormals);
            variant_.normalClusters = uint32_t(ranged(part, *k, 1, kMaxNormalCellsPerEdge));
        } else if (const auto texels = numberIn(text, "PLOD", "", false)) {
            claim(part, kLod);
            variant_.lodTexels = spelled(ranged(part, *texels, 0.01, 1024));
        } else if (text == "FP" || text == "LP") {
            claim(part, kPruning);
            variant_.pruning = text == "FP" ? PairPruning::kFacing : PairPruning::kLit;
        } else if (text == "SP") {
            claim(part, kPages);
            variant_.pageMarks = PageMarks::kLookups;
        } else if (text == "RP") {
            claim(part, kResolution);
            variant_.resolutionRule = ResolutionRule::kPlane;
        } else if (text == "RL") {
            claim(part, kOrder);
            variant_.reorderLights = true;
        } else if (text == "RH") {
            claim(part, kRoutes);
            variant_.routeMargin = kUsualRouteMargin;
        } else if (const auto margin = numberIn(text, "RH", "", false)) {
            claim(part, kRoutes);
            variant_.routeMargin = spelled(ranged(part, *margin, 0, kMaxRouteMargin));
        } else if (const auto count = numberIn(text, "", "SM", true)) {
            claim(part, kMaps);
            variant_.mapsPerLight = uint32_t(ranged(part, *count, 1, kMaxMapsPerLight));
        } else if (const auto divisor = numberIn(text, "u", "", false)) {
            claim(part, kUndersample);
            variant_.undersample = spelled(ranged(part, *divisor, 1, 1024));
        } else if (const auto taps = numberIn(text, "T", "", true)) {
            claim(part, kTaps);
            if (*taps != 1 && *taps != 4 && *taps != 9)
                refuse(part, "is not a filter: use T1, T4 or T9");
            variant_.taps = uint32_t(*taps);
        } else if (text == "RT" || text == "Ray Tracing" || text == "all-rays") {
            claim(part, kMethod);
            variant_.method = Variant::Method::kRays;
        } else if (text == "Hybrid" || text.starts_with("Hybrid:")) {
            claim(part, kMethod);
            variant_.method = Variant::Method::kHybrid;
            variant_.model = text == "Hybrid" ? kPaperModel : text.substr(7);
            try {
                makeCostModel(variant_.model);
            } catch (const Error& error) {
                refuse(part, std::string("is not a cost model: ") + error.what() + dashHint());
            }
            variant_.model = modelSpelling(variant_.model);
            if (variant_.model == "texels:0")
                refuse(part, "draws every map: use its culling and bounds without Hybrid");
            if (variant_.model == "texels:inf")
                refuse(part, "traces every light: use RT");
        } else if (text == "PLOD" || text == "Nk" || text == "u" || text == "T" || text == "SM") {
            refuse(part, std::string("lacks its number, which follows without a dash, as "
                                     "in ") +
                             (text == "SM" ? "4" + text : text + (text == "Nk" ? "3" : "1")));
        } else {
            refuse(part, "is unknown; the parts are Sphere, CFM, PMC, PMCD, PMCC, EB, TB, SO, SOR, "
                         "Nk<k>, PLOD<texels>, FP, LP, SP, RP, RL, <n>SM, u<d>, T<taps>, RT, "
                         "Hybrid[:MODEL], RH[<margin>]" +
                             dashHint());
        }
    }

    void finish() {
        if (!claimed_[kMethod] && !claimed_[kCulling])
            throw Error(ErrorKind::kUsage,
                        option_ + " '" + name_ +
                            "': has no culling; add Sphere, CFM, PMC, PMCD or PMCC for maps, or "
                            "use RT or Hybrid");
        if (claimed_[kRoutes] && variant_.method != Variant::Method::kHybrid)
            refuse(*claimed_[kRoutes], "is for Hybrid, which has routes: add that or drop it");
        if (variant_.method == Variant::Method::kRays)
            for (const Kind kind :
                 {kCulling, kStatic, kLod, kPages, kResolution, kMaps, kUndersample, kTaps})
                if (claimed_[kind])
                    refuse(*claimed_[kind], "contradicts '" + claimed_[kMethod]->text +
                                                "', which draws no maps: drop one of them");
        if (variant_.method == Variant::Method::kHybrid && !claimed_[kCulling] &&
            !claimed_[kBounds])
            variant_.bounds = ClusterBounds::kExplicit;
    }

    const std::string& option_;
    const std::string& name_;
    std::array<std::optional<Part>, kKindCount> claimed_;
    Variant variant_;
};

const char* cullingName(MapCulling culling) {
    for (const auto& [spelling, named] : kCullings)
        if (named == culling)
            return spelling;
    return "";
}

/// Returns a model in the form of a name, in which '-' separates.
std::string modelPart(const std::string& model) {
    const std::string expression = "expr:";
    if (!model.starts_with(expression) || findDash(model, 0) == model.size())
        return model;
    return expression + "(" + model.substr(expression.size()) + ")";
}

} // namespace

std::string variantsHelp() {
    return "Instead: variants by name, as in PMCD-EB-SO-4SM-u2, or paper for all that the paper "
           "measured. Parts, in any order: Sphere, CFM, PMC, PMCD, PMCC (culling); EB, TB (cluster "
           "bounds); SO, SOR (static optimization); Nk<k>; PLOD<texels>; FP, LP (pages only for "
           "pairs that face, that are not proven lit), SP (for what samples look up); RP "
           "(resolution rule); RL (light order); "
           "<n>SM [4SM]; u<d> [u1]; T<taps>; RT (all rays); Hybrid[:MODEL]; RH[<margin>] (routes "
           "held)";
}

Variant parseVariant(const std::string& option, const std::string& name) {
    return NameReader(option, name).read();
}

std::string variantName(const Variant& v) {
    std::string name;
    const auto add = [&](const std::string& part) { name += (name.empty() ? "" : "-") + part; };
    const bool isHybrid = v.method == Variant::Method::kHybrid;
    if (v.method == Variant::Method::kRays)
        add("RT");
    if (isHybrid)
        add(v.model == kPaperModel ? "Hybrid" : "Hybrid:" + modelPart(v.model));
    // The implied parts of Hybrid may be omitted.
    const bool isImplied =
        isHybrid && v.culling == MapCulling::kMaximumDepth && v.bounds == ClusterBounds::kExplicit;
    if (v.method != Variant::Method::kRays && !isImplied)
        add(cullingName(v.culling));
    if (v.bounds == ClusterBounds::kExplicit && !isImplied)
        add("EB");
    if (v.bounds == ClusterBounds::kTight)
        add("TB");
    if (v.useStaticOptimization)
        add(v.retainsPages ? "SOR" : "SO");
    if (v.normalClusters > 0)
        add("Nk" + std::to_string(v.normalClusters));
    if (v.lodTexels > 0)
        add("PLOD" + numberText(v.lodTexels));
    if (v.pruning != PairPruning::kNone)
        add(v.pruning == PairPruning::kFacing ? "FP" : "LP");
    if (v.pageMarks == PageMarks::kLookups)
        add("SP");
    if (v.resolutionRule == ResolutionRule::kPlane)
        add("RP");
    if (v.reorderLights)
        add("RL");
    if (v.mapsPerLight != Variant{}.mapsPerLight)
        add(std::to_string(v.mapsPerLight) + "SM");
    if (v.undersample != 1)
        add("u" + numberText(v.undersample));
    if (v.taps != 0)
        add("T" + std::to_string(v.taps));
    if (v.routeMargin)
        add(*v.routeMargin == kUsualRouteMargin ? "RH" : "RH" + numberText(*v.routeMargin));
    return name;
}

bool saysSetting(const Variant& variant, const std::string& key) {
    return key == "taps" ? variant.taps != 0 : key == "route_margin" && variant.routeMargin;
}

std::vector<std::string> parseVariants(const std::string& option,
                                       const std::vector<std::string>& names,
                                       const FrameOptions& base) {
    if (base.maps.lodTexels > 0.0f)
        throw Error(ErrorKind::kUsage, option + " and a polygon level of detail of " +
                                           numberText(base.maps.lodTexels) +
                                           " texels contradict each other: variants set it, as in "
                                           "PMCD-EB-PLOD1; drop one of them");
    std::map<std::string, std::string> spellings; // by canonical name
    const auto nameOf = [&](const std::string& name) {
        Variant variant = parseVariant(option, name);
        if (variant.taps == base.bias.taps)
            variant.taps = 0;
        if (variant.routeMargin == base.routeMargin)
            variant.routeMargin.reset();
        return variantName(variant);
    };
    for (const std::string& name : names)
        if (name != "paper")
            if (const auto [found, isNew] = spellings.try_emplace(nameOf(name), name); !isNew)
                throw Error(ErrorKind::kUsage, option + " '" + name + "': is the variant '" +
                                                   found->first + "', which '" + found->second +
                                                   "' denotes as well; drop one of them");
    std::vector<std::string> canonical;
    for (const std::string& name : names) {
        if (name != "paper") {
            canonical.push_back(nameOf(name));
            continue;
        }
        for (const std::string& of : paperVariants())
            if (!spellings.contains(of))
                canonical.push_back(of);
    }
    return canonical;
}

const std::vector<std::string>& paperVariants() {
    // PMCD-EB is PMCD-EB-4SM.
    static const std::vector<std::string> kNames{
        "CFM",        "PMC",        "PMCD",        "PMCD-EB",       "PMCD-EB-SO", "PMCD-EB-1SM",
        "PMCD-EB-u2", "PMCD-EB-u4", "PMCD-EB-Nk3", "PMCD-EB-PLOD1", "RT",         "Hybrid"};
    return kNames;
}

RunParameters variantRun(const Variant& v, const FrameOptions& base) {
    RunParameters run;
    run.variant = variantName(v);
    run.frame = base;
    run.frame.clusterBounds = v.bounds;
    switch (v.method) {
    case Variant::Method::kMaps:
        run.method = "maps";
        run.model = "texels:0";
        break;
    case Variant::Method::kRays:
        run.method = "dag";
        run.model = "texels:inf";
        break;
    case Variant::Method::kHybrid:
        run.method = "hybrid";
        run.model = v.model;
        break;
    }
    run.frame.undersample = v.undersample;
    run.frame.mapsPerLight = v.method == Variant::Method::kRays ? 1 : v.mapsPerLight;
    run.frame.normalClusters = v.normalClusters;
    run.frame.resolutionRule = v.resolutionRule;
    run.frame.reorderLights = v.reorderLights;
    run.frame.routeMargin = v.routeMargin.value_or(base.routeMargin);
    run.frame.pruning = v.pruning;
    run.frame.pageMarks = v.pageMarks;
    if (v.method != Variant::Method::kMaps && v.pruning == PairPruning::kLit &&
        !run.frame.rays.believesAll())
        throw Error(
            ErrorKind::kUsage,
            "variant '" + run.variant +
                "': LP decides pairs by voxel rays, also pairs of its own rays, which do not "
                "believe all voxels; use --believe all, or drop LP");
    if (v.lodTexels > 0)
        run.frame.maps.lodTexels = v.lodTexels;
    run.frame.maps.culling = v.culling;
    run.frame.maps.useStaticOptimization = v.useStaticOptimization;
    run.frame.maps.retainsPages = v.retainsPages;
    if (v.taps != 0)
        run.frame.bias.taps = run.frame.maps.taps = v.taps;
    return run;
}

Variant variantOf(const RunParameters& run) {
    Variant v;
    const FrameOptions& frame = run.frame;
    v.bounds = frame.clusterBounds;
    v.normalClusters = frame.normalClusters;
    v.reorderLights = frame.reorderLights;
    v.pruning = frame.pruning;
    if (!run.usesMaps()) {
        v.method = Variant::Method::kRays;
        return v;
    }
    if (run.isRouted()) {
        v.method = Variant::Method::kHybrid;
        v.model = modelSpelling(run.model);
        if (frame.routeMargin > 0)
            v.routeMargin = frame.routeMargin;
    }
    v.pageMarks = frame.pageMarks;
    v.resolutionRule = frame.resolutionRule;
    v.lodTexels = frame.maps.lodTexels;
    v.culling = frame.maps.culling;
    v.useStaticOptimization = frame.maps.useStaticOptimization;
    v.retainsPages = v.useStaticOptimization && frame.maps.retainsPages;
    v.mapsPerLight = frame.mapsPerLight;
    v.undersample = frame.undersample;
    if (frame.bias.taps != ShadowMapBias{}.taps)
        v.taps = frame.bias.taps;
    return v;
}

} // namespace shadowdag
