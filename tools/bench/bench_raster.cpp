// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench_raster.h"

#include "scenes/batches.h"
#include "tools/bench/bench_view.h"
#include "tools/settings/parse.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <deque>
#include <ostream>

namespace shadowdag {

namespace {

/// The centres of the texels that contain the receivers' centres, as rays from their lights.
struct TexelRays {
    std::vector<WorldSegment>
        before; ///< must be free: up to just before the stored depth, or the receiver's
    std::vector<WorldSegment>
        beyond; ///< must be blocked where isClosed: to just beyond the stored depth
    std::vector<uint8_t> isClosed; ///< something is stored nearer than the receiver
    size_t emptyPageCount = 0;     ///< the texel has no page: always wrong
};

TexelRays makeTexelRays(const ShadowMapView& view, const RasterBenchInputs& inputs) {
    TexelRays rays;
    for (const MapReceiver& receiver : inputs.receivers) {
        const ShadowMapInfo& map = view.maps[receiver.map];
        const glm::vec3 d = inputs.boxes[receiver.box].center() - map.lightPositionWorld;
        const uint32_t face = faceOf(d);
        const glm::vec3 q = faceFromLight(face, d);
        const uint32_t x = faceCell(q.x / q.z, map.faceTexels),
                       y = faceCell(q.y / q.z, map.faceTexels);
        const glm::vec3 centre =
            lightFromFace(face, glm::vec3(faceCellCentre(int32_t(x), map.faceTexels),
                                          faceCellCentre(int32_t(y), map.faceTexels), 1.0f));
        const uint32_t bits = depthAt(view, map, {face, x, y});
        if (bits == kNoPage) {
            ++rays.emptyPageCount;
            continue;
        }
        const float inverseDepth = bitsFloat(bits);
        const bool isClosed = inverseDepth * q.z > 1.0f + kDepthTolerance;
        // Beyond its range a light needs no blockers, and a large box's centre may lie there.
        const float z =
            isClosed ? 1.0f / inverseDepth : std::min(q.z, map.rangeWorld / glm::length(centre));
        const glm::vec3 light = map.lightPositionWorld;
        rays.before.push_back({light, light + centre * (z * (1.0f - kDepthTolerance))});
        rays.beyond.push_back({light, light + centre * (z * (1.0f + kDepthTolerance))});
        rays.isClosed.push_back(isClosed);
    }
    return rays;
}

/// Maps of one resolution that are drawn again and again.
struct DrawnSize {
    RasterBenchInputs inputs;
    ShadowMaps maps{Backend::kCpu};
    std::vector<double> rasterizationMs;
};

/// Returns the cost of a triangle and of a texel in ns of a thread that fit the medians of the
/// sizes' rasterization best, by least squares of relative errors; none when they are not told
/// apart.
Json fitRasterization(const std::deque<DrawnSize>& sizes) {
    double tt = 0, tx = 0, xx = 0, t1 = 0, x1 = 0;
    Json points = Json::array();
    for (const DrawnSize& size : sizes) {
        const ShadowMapCounts& counts = size.maps.counts();
        const double ns =
            1e6 * double(threadCount()) * Spread::of(size.rasterizationMs).median.value;
        const double t = double(counts.triangleDrawCount) / ns, x = double(counts.texelCount) / ns;
        tt += t * t;
        tx += t * x;
        xx += x * x;
        t1 += t;
        x1 += x;
        points.push_back({{"triangle_draw_count", counts.triangleDrawCount},
                          {"texel_count", counts.texelCount},
                          {"rasterization_ms", Spread::of(size.rasterizationMs).median.value}});
    }
    Json fit = {{"points", points}, {"ns_per_triangle", nullptr}, {"ns_per_texel", nullptr}};
    const double determinant = tt * xx - tx * tx;
    if (determinant > 1e-6 * tt * xx) {
        fit["ns_per_triangle"] = (t1 * xx - x1 * tx) / determinant;
        fit["ns_per_texel"] = (x1 * tt - t1 * tx) / determinant;
    }
    return fit;
}

} // namespace

RasterBenchInputs makeRasterBenchInputs(const World& world, const Camera& camera,
                                        const RasterBenchOptions& options) {
    RasterBenchInputs inputs;
    inputs.boxes =
        makeBenchView(world, camera, options.width, options.height).clusters.boxesWorld.download();
    for (uint32_t i = 0; i < world.lights().size() && inputs.requests.size() < options.mapCount;
         ++i) {
        const Light& light = world.lights()[i];
        if (light.kind == Light::kSun) // cubes are measured
            continue;
        const size_t before = inputs.receivers.size();
        for (uint32_t b = 0; b < inputs.boxes.size(); ++b)
            if (distanceSquared(inputs.boxes[b], light.positionWorld) <
                light.rangeWorld * light.rangeWorld)
                inputs.receivers.push_back({b, uint32_t(inputs.requests.size())});
        // Resolutions spread over a factor of 16, as those of near and far lights do.
        const uint32_t faceTexels =
            std::max(8u, uint32_t(double(options.faceTexels) * std::exp2(-0.5 * double(i % 9))));
        if (inputs.receivers.size() > before)
            inputs.requests.push_back({light.positionWorld, light.rangeWorld, i, faceTexels});
    }
    return inputs;
}

Json runRasterBench(const World& world, const Camera& camera, const RasterBenchOptions& options,
                    const Console&) {
    SDAG_ASSERT(options.repeats >= 1);
    const BatchSet batches(world);
    const RasterBenchInputs inputs = makeRasterBenchInputs(world, camera, options);
    if (inputs.requests.empty())
        throw Error(ErrorKind::kInput,
                    "bench raster: no light reaches a visible surface; use --lights N or --camera");
    ShadowMapOptions mapOptions;
    mapOptions.pageTexels = options.pageTexels;
    mapOptions.poolBytes = 2ull << 30;
    mapOptions.useStaticOptimization = false; // every build draws
    const auto build = [&](ShadowMaps& target, const RasterBenchInputs& of, bool useText,
                           StageTimes& stages) {
        mapOptions.useAtomicRasterizer = useText;
        target.build(of.requests, of.boxes, of.receivers, world.triangles(), batches.view(),
                     mapOptions, stages);
        SDAG_ASSERT(target.counts().keptMapCount == 0);
    };

    ShadowMaps maps(Backend::kCpu);
    StageTimes ignored;
    {
        ShadowMaps text(Backend::kCpu);
        build(maps, inputs, false, ignored);
        build(text, inputs, true, ignored);
        const View<const uint32_t> depths = maps.view().depths;
        if (depths.count != text.view().depths.count ||
            std::memcmp(depths.data, text.view().depths.data, depths.count * sizeof(uint32_t)) != 0)
            throw Error(ErrorKind::kInput, "bench raster: the CPU's kernel and the shared code "
                                           "differ; please report the scene");
    }
    const TexelRays rays = makeTexelRays(maps.view(), inputs);
    const EmbreeBaseline robust(world.triangles(), {.isRobust = true});
    const std::vector<uint8_t> before = robust.occluded(EmbreeCall::kOccluded1, rays.before);
    const std::vector<uint8_t> beyond = robust.occluded(EmbreeCall::kOccluded1, rays.beyond);
    size_t wrong = rays.emptyPageCount;
    for (size_t i = 0; i < before.size(); ++i)
        wrong += before[i] || (rays.isClosed[i] && !beyond[i]);
    if (double(wrong) > kTexelTolerance * double(inputs.receivers.size()))
        throw Error(ErrorKind::kInput, "bench raster: " + std::to_string(wrong) + " of " +
                                           std::to_string(inputs.receivers.size()) +
                                           " depths differ from Embree's; please report the scene");

    // The same maps at several resolutions tell what a triangle takes from what a texel takes.
    std::deque<DrawnSize> sizes;
    for (uint32_t halvings = 0; halvings < 4 && options.faceTexels >> halvings >= 8; ++halvings) {
        RasterBenchOptions of = options;
        of.faceTexels >>= halvings;
        sizes.emplace_back().inputs = makeRasterBenchInputs(world, camera, of);
    }
    for (int r = -1; r < options.repeats; ++r) // once to warm up
        for (DrawnSize& size : sizes) {
            StageTimes stages;
            build(size.maps, size.inputs, false, stages);
            for (const auto& [name, timeMs] : stages.stagesMs)
                if (name == "rasterization" && r >= 0)
                    size.rasterizationMs.push_back(timeMs);
            checkInterrupted();
        }

    StageTimes order;
    std::vector<std::vector<double>> times;
    std::vector<double> total, processor;
    for (int r = 0; r < options.repeats; ++r) {
        StageTimes stages;
        const std::clock_t start = std::clock();
        build(maps, inputs, false, stages);
        processor.push_back(1e3 * double(std::clock() - start) / CLOCKS_PER_SEC);
        total.push_back(stages.totalMs());
        times.resize(stages.stagesMs.size());
        for (size_t s = 0; s < times.size(); ++s)
            times[s].push_back(stages.stagesMs[s].second);
        order = stages;
        checkInterrupted();
    }
    const ShadowMapCounts& counts = maps.counts();
    Json result = {
        {"bench", "raster"},
        {"width", options.width},
        {"height", options.height},
        {"page_texels", options.pageTexels},
        {"face_texels", options.faceTexels},
        {"map_count", inputs.requests.size()},
        {"box_count", inputs.boxes.size()},
        {"receiver_count", inputs.receivers.size()},
        {"triangle_count", world.triangles().count()},
        {"batch_count", batches.size()},
        {"page_count", counts.pageCount},
        {"texel_count", counts.texelCount},
        {"batch_face_count", counts.batchFaceCount},
        {"batch_face_sphere_count", counts.batchFaceSphereCount},
        {"triangle_draw_count", counts.triangleDrawCount},
        {"triangle_sphere_count", counts.triangleSphereCount},
        {"repeat_count", options.repeats},
        {"thread_count", threadCount()},
        {"checks", {{"texel_count", inputs.receivers.size()}, {"differing_count", wrong}}},
        {"stages", Json::object()},
        {"total", Spread::of(total).toJson("time_ms")},
        {"total_cpu", Spread::of(processor).toJson("time_ms")},
        {"fit", fitRasterization(sizes)},
        {"embree", Json::array()}};
    for (size_t s = 0; s < times.size(); ++s)
        result["stages"][order.stagesMs[s].first] = Spread::of(times[s]).toJson("time_ms");
    const double texelsPerSecond =
        double(counts.texelCount) / Spread::of(processor).median.value * 1e-3;
    result["megatexels_per_cpu_s"] = texelsPerSecond;
    const EmbreeBaseline fast(world.triangles());
    for (const EmbreeRate& rate : fast.measure(rays.before, options.repeats))
        result["embree"].push_back(
            {{"call", embreeCallName(rate.call)},
             {"megarays_per_s", rate.megaraysPerSecond.value},
             {"megarays_per_s_low", rate.megaraysPerSecond.low},
             {"megarays_per_s_high", rate.megaraysPerSecond.high},
             {"megarays_per_s_confidence", rate.megaraysPerSecond.confidence},
             {"texels_per_ray", rate.megaraysPerSecond.value > 0
                                    ? texelsPerSecond / rate.megaraysPerSecond.value
                                    : 0.0}});
    return result;
}

void printRasterBench(std::ostream& out, const Json& result) {
    char line[200];
    const auto number = [](const Json& json, const char* key) { return json[key].get<double>(); };
    std::snprintf(line, sizeof line,
                  "%.0f maps up to %.0f texels, pages of %.0f: %.0f pages, %.1f M texels\n",
                  number(result, "map_count"), number(result, "face_texels"),
                  number(result, "page_texels"), number(result, "page_count"),
                  1e-6 * number(result, "texel_count"));
    out << line;
    std::snprintf(line, sizeof line,
                  "%.0f batch faces (sphere x 6: %.0f), %.2f M triangle draws (%.2f M)\n",
                  number(result, "batch_face_count"), number(result, "batch_face_sphere_count"),
                  1e-6 * number(result, "triangle_draw_count"),
                  1e-6 * number(result, "triangle_sphere_count"));
    out << line;
    std::snprintf(line, sizeof line,
                  "verified: %.0f texels against Embree, %.0f differ; both kernels equal\n",
                  number(result["checks"], "texel_count"),
                  number(result["checks"], "differing_count"));
    out << line;
    const auto row = [&](const std::string& name, const Json& spread) {
        std::snprintf(line, sizeof line, "%-18s %9.2f ms (%.2f .. %.2f)\n", name.c_str(),
                      number(spread, "time_ms"), number(spread, "time_ms_min"),
                      number(spread, "time_ms_max"));
        out << line;
    };
    for (const auto& [stage, spread] : result["stages"].items())
        row(stage, spread);
    row("total", result["total"]);
    row("total, processor", result["total_cpu"]);
    if (const Json& fit = result["fit"]; fit["ns_per_triangle"].is_number()) {
        std::snprintf(line, sizeof line,
                      "rasterization      %9.2f ns of a thread a triangle, and %.2f ns a texel\n",
                      number(fit, "ns_per_triangle"), number(fit, "ns_per_texel"));
        out << line;
    }
    for (const Json& rate : result["embree"]) {
        std::snprintf(
            line, sizeof line,
            "%-18s %9.2f M rays/s a core along texel centres; %.1f texels built per ray\n",
            rate["call"].get<std::string>().c_str(), number(rate, "megarays_per_s"),
            number(rate, "texels_per_ray"));
        out << line;
    }
}

} // namespace shadowdag
