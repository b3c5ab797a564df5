// SPDX-License-Identifier: Apache-2.0
// The table of the keys of settings, and the conversion of texts to a setup.
#include "tools/studies/cell_setup.h"

#include "cuda/error.h"
#include "hybrid/routing/resolution.h"
#include "tools/settings/parse.h"
#include "tools/settings/setting.h"

#include <algorithm>
#include <initializer_list>
#include <sstream>

namespace shadowdag {

namespace {

constexpr MatrixMethod kMaps = MatrixMethod::kMaps, kDag = MatrixMethod::kDagAll,
                       kHybrid = MatrixMethod::kHybrid;

bool isOn(const std::string& key, const std::string& value) {
    if (value != "on" && value != "off")
        throw Error(ErrorKind::kUsage, key + " '" + value + "': must be on or off");
    return value == "on";
}

uint32_t whole(const std::string& key, const std::string& value, uint32_t min, uint32_t max) {
    return uint32_t(parseInteger(key, value, min, max));
}

/// Returns the index of a value among names. Throws Error kUsage with all of them.
size_t oneOf(const std::string& key, const std::string& value,
             std::initializer_list<const char*> names) {
    std::string all;
    size_t index = 0;
    for (const char* name : names) {
        if (value == name)
            return index;
        all += (all.empty() ? "" : ", ") + std::string(name);
        ++index;
    }
    throw Error(ErrorKind::kUsage, key + " '" + value + "': must be one of " + all);
}

float believeOf(const std::string& key, const std::string& value) {
    FrameOptions frame;
    settingOf("--believe").setFrame(frame, key, value);
    return frame.rays.believe;
}

/// A key of settings: an option of the program, whose row of the settings' table says what values
/// it has and sets it; or, without one, what only studies set.
struct Key {
    CellSetting setting;
    void (*set)(CellSetup& setup, const std::string& key, const std::string& value);
    const char* option = nullptr;

    Key(CellSetting s, void (*f)(CellSetup&, const std::string&, const std::string&))
        : setting(std::move(s)), set(f) {}
    Key(const char* key, const char* o, std::vector<MatrixMethod> readBy)
        : setting{key, std::string(o) + ": " + settingOf(o).help, std::move(readBy)}, set(nullptr),
          option(o) {}

    void apply(CellSetup& setup, const std::string& value) const {
        if (option)
            settingOf(option).setFrame(setup.frame, setting.key, value);
        else
            set(setup, setting.key, value);
    }
};

using Text = const std::string&;

const std::vector<Key>& keys() {
    static const std::vector<Key> all = {
        {{"resolution", "--resolution: voxels an axis", {kDag, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.resolutionLog2 = parsePowerOfTwo(k, v, 16, 4096); }},
        {"offset", "--offset", {kDag, kHybrid}},
        {{"believe", "--believe: the voxels that block a ray", {kDag, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.believe = believeOf(k, v); }},
        {{"hybrid_believe", "--believe of the hybrid alone", {kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.hybridBelieve = believeOf(k, v); }},
        {"lod", "--lod", {kDag, kHybrid}},
        {"beams_mib", "--beams", {kDag, kHybrid}},
        {{"ray_batch",
          "how many rays are traced together: single, stream (no option)",
          {kDag, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.rays.batch = RayBatch(oneOf(k, v, {"single", "stream"}));
         }},
        {{"movers",
          "off: rays are not tested against moving geometry (no option)",
          {kDag, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.hasMovers = isOn(k, v); }},
        {{"cluster_bounds", "parts EB, TB of --variants: boxes of clusters", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.clusterBounds = ClusterBounds(oneOf(k, v, {"implicit", "explicit", "tight"}));
         }},
        {{"normal_clusters", "part Nk of --variants: directions per edge", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.frame.normalClusters = whole(k, v, 0, 16); }},
        {{"light_order",
          "part RL of --variants: light lists by index or along a curve",
          {kMaps, kDag, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.reorderLights = oneOf(k, v, {"index", "curve"}) == 1;
         }},
        {{"page_pruning", "parts FP, LP of --variants: pairs without pages", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.pruning = PairPruning(oneOf(k, v, {"none", "facing", "lit"}));
         }},
        {{"page_marks", "part SP of --variants: what pages are marked by", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.pageMarks = PageMarks(oneOf(k, v, {"boxes", "lookups"}));
         }},
        {{"culling",
          "part CFM, PMC, PMCD of --variants: the batches drawn into each face",
          {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             constexpr MapCulling kKinds[] = {MapCulling::kSphere, MapCulling::kFaceMask,
                                              MapCulling::kProjectionMap, MapCulling::kMaximumDepth,
                                              MapCulling::kCellDepth};
             s.frame.maps.culling = kKinds[oneOf(k, v, {"sphere", "cfm", "pmc", "pmcd", "pmcc"})];
         }},
        {{"rasterizer",
          "atomic: the code of all processors; cpu: the kernel of the CPU (no option)",
          {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.maps.useAtomicRasterizer = oneOf(k, v, {"cpu", "atomic"}) == 1;
         }},
        {{"undersample",
          "--undersample: divides the requested resolution; below 1, maps are finer",
          {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.undersample = float(parseNumber(k, v, 1.0 / 64, 1024));
         }},
        {{"resolution_rule", "part RP of --variants: the rule of resolution", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) {
             s.frame.resolutionRule = ResolutionRule(oneOf(k, v, {"sphere", "plane"}));
         }},
        {{"min_face_texels",
          "texels of the edge of the smallest map (no option)",
          {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.frame.minFaceTexels = whole(k, v, 1, 2048); }},
        {"maps_per_light", "--maps-per-light", {kMaps, kHybrid}},
        {{"pool", "--pool: budget of pages, in bytes or with K, M, G", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.frame.maps.poolBytes = parseBytes(k, v); }},
        {"page_size", "--page-size", {kMaps, kHybrid}},
        {"bias", "--bias", {kMaps, kHybrid}},
        {"taps", "--taps", {kMaps, kHybrid}},
        {"polygon_lod", "--polygon-lod", {kMaps, kHybrid}},
        {{"static_optimization",
          "part SO of --variants: keeps maps of earlier frames",
          {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.frame.maps.useStaticOptimization = isOn(k, v); }},
        {{"retained_pages",
          "part SOR of --variants: kept maps keep unused pages",
          {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.frame.maps.retainsPages = isOn(k, v); }},
        {{"receiver_plane",
          "off: taps are compared with the receiver's distance (no option)",
          {kMaps}},
         [](CellSetup& s, Text k, Text v) { s.hasPlane = isOn(k, v); }},
        {{"redraw", "off: maps of the frame before are used (no option)", {kMaps}},
         [](CellSetup& s, Text k, Text v) { s.redraws = isOn(k, v); }},
        {{"hysteresis", "on: --sequence; off: frames are independent", {kMaps, kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.keepsFrames = isOn(k, v); }},
        {{"threshold", "--model texels:T of the hybrid", {kHybrid}},
         [](CellSetup& s, Text k, Text v) { s.hybridTexels = float(parseNumber(k, v, 0, 8192)); }},
        {"route_margin", "--route-margin", {kHybrid}},
    };
    return all;
}

std::string keyNames() {
    std::string names;
    for (const Key& key : keys())
        names += (names.empty() ? "" : ", ") + key.setting.key;
    return names;
}

/// Calls visit(key, value) for each "key=value" of a text.
template <class Visit> void forSettings(const std::string& text, const Visit& visit) {
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const size_t sign = word.find('=');
        const std::string name = word.substr(0, sign);
        const auto found = std::find_if(keys().begin(), keys().end(),
                                        [&](const Key& key) { return key.setting.key == name; });
        if (sign == std::string::npos || found == keys().end())
            throw Error(ErrorKind::kUsage, "setting '" + word + "' of '" + text +
                                               "': must be KEY=VALUE; the keys are " + keyNames());
        visit(*found, word.substr(sign + 1));
    }
}

} // namespace

const std::vector<CellSetting>& cellSettings() {
    static const std::vector<CellSetting> settings = [] {
        std::vector<CellSetting> list;
        for (const Key& key : keys())
            list.push_back(key.setting);
        return list;
    }();
    return settings;
}

std::string fileNameOf(MatrixMethod method) {
    std::string name = kMatrixMethodNames[size_t(method)];
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

std::unique_ptr<CostModel> modelOf(MatrixMethod method, CellSetup& setup) {
    const float asked =
        method == MatrixMethod::kHybrid ? setup.hybridBelieve : RayOptions{}.believe;
    setup.frame.rays.believe =
        method == MatrixMethod::kDagNone ? 0.0f : setup.believe.value_or(asked);
    return makeCostModel(method == MatrixMethod::kMaps ? "texels:0"
                         : method == MatrixMethod::kHybrid
                             ? "texels:" + numberText(setup.hybridTexels)
                             : "texels:inf");
}

CellSetup cellSetup(const std::vector<std::string>& settings) {
    CellSetup setup;
    setup.frame.width = 256;
    setup.frame.height = 144;
    setup.frame.maps.poolBytes = 128ull << 20;
    for (const std::string& text : settings)
        forSettings(text,
                    [&](const Key& key, const std::string& value) { key.apply(setup, value); });
    return setup;
}

bool readsAny(MatrixMethod method, const std::string& settings) {
    bool reads = false;
    forSettings(settings, [&](const Key& key, const std::string&) {
        const std::vector<MatrixMethod>& readBy = key.setting.readBy;
        reads |= std::find(readBy.begin(), readBy.end(), method) != readBy.end();
    });
    return reads;
}

} // namespace shadowdag
