// SPDX-License-Identifier: Apache-2.0
// Times the building of virtual cube shadow maps, stage by stage, after checking what it built:
// depths against Embree along texel centres, the CPU's kernel against the one text. Beside it,
// Embree's rays along as many texel centres.
//     raster_bench [SCENE] [mapCount] [faceTexels] [pageTexels] [repeats]
#include "scenes/builtin.h"
#include "shadowmap/shadow_maps.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <random>

using namespace shadowdag;

namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

struct Embree {
    RTCDevice device = rtcNewDevice(nullptr);
    RTCScene scene = rtcNewScene(device);

    explicit Embree(const TriangleView& triangles) {
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        memcpy(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                       triangles.positions.count),
               triangles.positions.data, triangles.positions.count * 12);
        memcpy(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                       triangles.triangles.count),
               triangles.triangles.data, triangles.triangles.count * 12);
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g);
        rtcReleaseGeometry(g);
        rtcCommitScene(scene);
    }
    Embree(const Embree&) = delete;
    Embree& operator=(const Embree&) = delete;
    ~Embree() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
    float firstHit(const glm::vec3& o, const glm::vec3& d, float tFar) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit hit{};
        hit.ray.org_x = o.x, hit.ray.org_y = o.y, hit.ray.org_z = o.z;
        hit.ray.dir_x = d.x, hit.ray.dir_y = d.y, hit.ray.dir_z = d.z;
        hit.ray.tfar = tFar;
        hit.ray.mask = ~0u;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &hit);
        return hit.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::infinity()
                                                         : hit.ray.tfar;
    }
};

/// Returns boxes of a metre-sized grid around what a camera sees: stand-ins for a frame's clusters.
std::vector<Box> visibleBoxes(const Embree& embree, const Camera& camera, float cell) {
    std::map<std::tuple<int, int, int>, Box> boxes;
    const float tanY = std::tan(0.5f * camera.yfov);
    for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x) {
            const glm::vec3 d =
                camera.forward +
                camera.right() * (tanY * 16 / 9 * (2 * (float(x) + 0.5f) / 320 - 1)) +
                camera.up * (tanY * (1 - 2 * (float(y) + 0.5f) / 180));
            const float t = embree.firstHit(camera.positionWorld, d, camera.zfar);
            if (std::isinf(t))
                continue;
            const glm::vec3 p = camera.positionWorld + t * d;
            const glm::ivec3 k = glm::ivec3(glm::floor(p / cell));
            boxes[{k.x, k.y, k.z}].add(p);
        }
    std::vector<Box> result;
    for (const auto& entry : boxes)
        result.push_back(entry.second);
    return result;
}

} // namespace

int main(int argc, char** argv) try {
    const std::string name = argc > 1 ? argv[1] : "builtin:atrium";
    const uint32_t mapCount = argc > 2 ? uint32_t(atoi(argv[2])) : 40;
    const uint32_t faceTexels = argc > 3 ? uint32_t(atoi(argv[3])) : 512;
    ShadowMapOptions options;
    options.pageTexels = argc > 4 ? uint32_t(atoi(argv[4])) : 64;
    options.poolBytes = 2ull << 30;
    const int repeats = argc > 5 ? atoi(argv[5]) : 7;

    const Scene scene = loadScene(name);
    WorldOptions worldOptions;
    if (scene.lights.empty())
        worldOptions.placedLightCount = 65;
    const World world(scene, worldOptions);
    const auto batchStart = Clock::now();
    const BatchSet batches(world);
    double boxSides = 0;
    for (const Box& box : batches.view().boxesWorld)
        boxSides += glm::length(box.extent());
    std::printf("%s: %zu triangles in %zu batches (%.1f a batch, mean diagonal %.3f) in %.0f ms\n",
                name.c_str(), world.triangles().count(), batches.size(),
                double(world.triangles().count()) / double(batches.size()),
                boxSides / double(batches.size()), msSince(batchStart));

    const Embree embree(world.triangles());
    const Camera camera = world.cameras().empty() ? placeCamera(world) : world.cameras()[0];
    const std::vector<Box> boxes = visibleBoxes(embree, camera, 1.0f);
    std::vector<MapRequest> requests;
    std::vector<MapReceiver> receivers;
    // Resolutions spread over a factor of 16, as those of near and far lights do.
    for (uint32_t i = 0; i < world.lights().size() && requests.size() < mapCount; ++i) {
        const Light& light = world.lights()[i];
        const size_t before = receivers.size();
        for (uint32_t b = 0; b < boxes.size(); ++b)
            if (distanceSquared(boxes[b], light.positionWorld) <
                light.rangeWorld * light.rangeWorld)
                receivers.push_back({b, uint32_t(requests.size())});
        if (receivers.size() > before)
            requests.push_back(
                {light.positionWorld, light.rangeWorld, i,
                 std::max(8u, uint32_t(double(faceTexels) * std::exp2(-0.5 * double(i % 9))))});
    }

    ShadowMaps maps(Backend::kCpu), text(Backend::kCpu);
    StageTimes ignored;
    const auto build = [&](ShadowMaps& target, StageTimes& stages) {
        target.build(requests, boxes, receivers, world.triangles(), batches.view(), options,
                     stages);
    };
    build(maps, ignored);
    options.useAtomicRasterizer = true;
    build(text, ignored);
    options.useAtomicRasterizer = false;
    const ShadowMapView view = maps.view();
    if (memcmp(view.depths.data, text.view().depths.data, view.depths.count * 4) != 0) {
        std::printf("the CPU's kernel and the one text differ\n");
        return 1;
    }

    // Texels of receivers' centres: what stored depth says against Embree along the same ray, up to
    // the receiver.
    std::mt19937 rng(1);
    size_t asked = 0, wrong = 0;
    std::vector<std::pair<glm::vec3, glm::vec3>> rays;
    for (const MapReceiver& r : receivers) {
        const ShadowMapInfo& map = view.maps[r.map];
        const glm::vec3 d = boxes[r.box].center() - map.lightPositionWorld;
        const uint32_t face = faceOf(d);
        const glm::vec3 q = faceFromLight(face, d);
        const uint32_t x = faceCell(q.x / q.z, map.faceTexels),
                       y = faceCell(q.y / q.z, map.faceTexels);
        const glm::vec3 c =
            lightFromFace(face, glm::vec3(faceCellCentre(int32_t(x), map.faceTexels),
                                          faceCellCentre(int32_t(y), map.faceTexels), 1.0f));
        const uint32_t bits = depthAt(view, map, {face, x, y});
        const float z = embree.firstHit(map.lightPositionWorld, c, q.z);
        rays.push_back({map.lightPositionWorld, c});
        ++asked;
        if (bits == kNoPage || (std::isinf(z) ? bitsFloat(bits) > 1.0001f / q.z
                                              : std::abs(bitsFloat(bits) * z - 1.0f) > 1e-4f))
            ++wrong;
    }
    std::printf("verified: %zu texels against Embree, %zu differ; both kernels equal\n", asked,
                wrong);
    if (wrong * 1000 > asked) {
        std::printf("too many differ\n");
        return 1;
    }

    std::map<std::string, std::vector<double>> times;
    for (int i = 0; i < repeats; ++i) {
        StageTimes stages;
        const std::clock_t cpuStart = std::clock();
        build(maps, stages);
        stages.add("total", stages.totalMs());
        stages.add("total, CPU time", 1e3 * double(std::clock() - cpuStart) / CLOCKS_PER_SEC);
        for (const auto& [stage, timeMs] : stages.stagesMs)
            times[stage].push_back(timeMs);
    }
    const ShadowMapCounts& counts = maps.counts();
    for (auto& [stage, values] : times) {
        std::sort(values.begin(), values.end());
        std::printf("%-16s %9.2f ms (%.2f .. %.2f)\n", stage.c_str(), values[values.size() / 2],
                    values.front(), values.back());
    }
    const double rasterMs = times["rasterization"][size_t(repeats) / 2];
    std::printf("%zu maps, %zu boxes, %zu receivers; %llu pages, %.1f M texels; "
                "%llu batch faces (sphere x 6: %llu), %.2f M triangle draws (%.2f M)\n",
                requests.size(), boxes.size(), receivers.size(),
                (unsigned long long)counts.pageCount, double(counts.texelCount) * 1e-6,
                (unsigned long long)counts.batchFaceCount,
                (unsigned long long)counts.batchFaceSphereCount,
                double(counts.triangleDrawCount) * 1e-6, double(counts.triangleSphereCount) * 1e-6);
    std::printf("%.1f ns a triangle draw, %.2f ns a texel (%d threads)\n",
                rasterMs * 1e6 / double(counts.triangleDrawCount),
                rasterMs * 1e6 / double(counts.texelCount), threadCount());

    if (!rays.empty()) {
        const auto start = Clock::now();
        double sum = 0;
        for (const auto& [o, c] : rays)
            sum += embree.firstHit(o, c, 1e30f) < 1e30f;
        const double nsPerRay = msSince(start) * 1e6 / double(rays.size());
        std::printf(
            "Embree, rtcIntersect1: %.0f ns a ray and core; as many rays as texels: %.1f times the "
            "rasterization (%.0f hits)\n",
            nsPerRay, nsPerRay * double(counts.texelCount) * 1e-6 / rasterMs / threadCount(), sum);
    }
    return 0;
} catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return int(error.kind());
}
