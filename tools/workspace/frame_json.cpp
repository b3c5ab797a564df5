// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/frame_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace shadowdag {

namespace {

std::string poolNote(double divisor, unsigned long long wantedCount, unsigned long long pageCount) {
    // `wanted` counts the pages of the undivided resolutions; either difference shows that they did
    // not fit.
    if (!(divisor > 1.0) && wantedCount <= pageCount)
        return "";
    char text[160];
    std::snprintf(text, sizeof text,
                  "pool full: resolutions divided by %.2f; wanted %llu pages, %llu fit", divisor,
                  wantedCount, pageCount);
    return text;
}

} // namespace

std::string poolNote(const FrameCounts& counts) {
    return poolNote(counts.maps.degradeDivisor, counts.maps.pagesWantedCount,
                    counts.maps.pageCount);
}

bool isPoolFull(const Json& run) {
    return !poolNote(run.value("degrade_divisor", 1.0), run.value("pages_wanted_count", 0ull),
                     run.value("page_count", 0ull))
                .empty();
}

std::string poolNote(const Json& run) {
    std::string note =
        poolNote(run.value("degrade_divisor", 1.0), run.value("pages_wanted_count", 0ull),
                 run.value("page_count", 0ull));
    if (const double divisor = run.value("costs_degrade_divisor", 1.0); divisor > 1) {
        char text[200];
        std::snprintf(text, sizeof text,
                      "pool full while costs were measured: single maps undivided, all together "
                      "divided by %.2f, so that routes match neither",
                      divisor);
        note += (note.empty() ? "" : "; ") + std::string(text);
    }
    return note;
}

Json toJson(const ErrorCounts& c) {
    return {{"pair_count", c.pairCount},
            {"occluded_count", c.occludedCount},
            {"false_shadow_count", c.falseShadowCount},
            {"false_light_count", c.falseLightCount},
            {"unexplained_false_shadow_count", c.unexplainedFalseShadowCount},
            {"unexplained_false_light_count", c.unexplainedFalseLightCount},
            {"settled_false_shadow_count", c.settledFalseShadowCount},
            {"settled_false_light_count", c.settledFalseLightCount},
            {"tap_settled_count", c.tapSettledCount},
            {"acne_count", c.acneCount},
            {"contact_count", c.contactCount},
            {"magnified_count", c.magnifiedCount},
            {"mean_abs_visibility_error", c.meanAbsVisibilityError()}};
}

Json nullRatesJson(const ErrorReport& report) {
    return {{"null_rate", report.nullRate},
            {"null_sample_count", report.nullSampleCount},
            {"outline_null_rate", report.outlineNullRate},
            {"outline_null_sample_count", report.outlineNullSampleCount},
            {"tap_null_rate", report.tapNullRate},
            {"tap_only_null_rate", report.tapOnlyNullRate},
            {"tap_null_sample_count", report.tapNullSampleCount}};
}

Json toJson(const StageTimes& stages) {
    Json json = Json::object();
    for (const auto& [name, timeMs] : stages.stagesMs)
        json[name] = timeMs;
    return json;
}

Json toJson(const FrameCounts& c) {
    return {{"sample_count", c.sampleCount},
            {"cluster_count", c.clusterCount},
            {"cluster_light_count", c.clusterLightCount},
            {"pruned_cluster_light_count", c.prunedClusterLightCount},
            {"traced_light_count", c.tracedLightCount},
            {"mapped_light_count", c.mappedLightCount},
            {"traced_map_count", c.tracedMapCount},
            {"drawn_map_count", c.drawnMapCount},
            {"proven_pair_count", c.provenPairCount},
            {"page_count", c.maps.pageCount},
            {"pages_wanted_count", c.maps.pagesWantedCount},
            {"degrade_divisor", c.maps.degradeDivisor},
            {"pages_committed_count", c.maps.pagesCommittedCount},
            {"pages_freed_count", c.maps.pagesFreedCount},
            {"pages_retained_count", c.maps.pagesRetainedCount},
            {"pages_cleared_count", c.maps.pagesClearedCount},
            {"kept_map_count", c.maps.keptMapCount},
            {"batch_face_kept_count", c.maps.batchFaceKeptCount},
            {"triangle_kept_count", c.maps.triangleKeptCount},
            {"texel_count", c.maps.texelCount},
            {"triangle_draw_count", c.maps.triangleDrawCount},
            {"triangle_sphere_count", c.maps.triangleSphereCount},
            {"batch_face_count", c.maps.batchFaceCount},
            {"batch_face_sphere_count", c.maps.batchFaceSphereCount},
            {"unsplit_triangle_count", c.unsplitTriangleCount + c.maps.unsplitTriangleCount},
            {"list_rerun_count", c.listRerunCount},
            {"ray_count", c.rayCount},
            {"exact_ray_count", c.exactRayCount},
            {"beam_ray_count", c.beamRayCount},
            {"beam_made_count", c.beamMadeCount},
            {"mover_test_count", c.moverTestCount},
            {"whole_lit_pair_count", c.wholeLitPairCount},
            {"whole_dark_pair_count", c.wholeDarkPairCount},
            {"mixed_pair_count", c.mixedPairCount},
            {"lookup_count", c.lookupCount},
            {"missing_tap_count", c.missingTapCount},
            {"map_bytes", c.maps.mapBytes}};
}

Json lightsJson(const std::vector<MapRecord>& maps) {
    Json list = Json::array();
    for (size_t first = 0, end = 0; first < maps.size(); first = end) {
        const uint32_t light = maps[first].quantities.light;
        uint32_t drawnCount = 0, faceTexels = 0;
        uint64_t pages = 0;
        float texels = 0;
        for (end = first; end < maps.size() && maps[end].quantities.light == light; ++end) {
            const MapQuantities& q = maps[end].quantities;
            drawnCount += maps[end].route == Route::kMap;
            texels = std::max(texels, q.texels);
            faceTexels = std::max(faceTexels, q.faceTexels);
            pages += q.pages;
        }
        const size_t count = end - first;
        list.push_back({{"light", light},
                        {"route", drawnCount == 0       ? "rays"
                                  : drawnCount == count ? "map"
                                                        : "both"},
                        {"map_count", count},
                        {"drawn_map_count", drawnCount},
                        {"texels", texels},
                        {"face_texels", faceTexels},
                        {"pages", pages}});
    }
    return list;
}

Json toJson(const std::vector<MapRecord>& maps) {
    Json list = Json::array();
    for (const MapRecord& map : maps) {
        const MapQuantities& q = map.quantities;
        list.push_back({{"light", q.light},
                        {"octave", q.octave},
                        {"route", map.route == Route::kRays ? "rays" : "map"},
                        {"texels", q.texels},
                        {"face_texels", q.faceTexels},
                        {"pages", q.pages},
                        {"samples", q.samples},
                        {"clusters", q.clusters},
                        {"triangles", q.triangles},
                        {"batches", q.batches},
                        {"range", q.range},
                        {"pairs", q.pairs},
                        {"movers", q.movers},
                        {"mover_crossings", q.moverCrossings},
                        {"pair_count", map.pairCount}});
    }
    return list;
}

} // namespace shadowdag
