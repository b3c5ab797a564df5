// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_pixel.h"

#include "hybrid/frame/shade.h"
#include "hybrid/judge/truth.h"
#include "tools/settings/parse.h"
#include "tools/window/view_pair.h"

#include <algorithm>
#include <chrono>

namespace shadowdag {

namespace {

/// Returns the nanoseconds of one call: the median of 15 runs of 8 calls.
template <class F> double timeOf(const F& ask) {
    constexpr int kRuns = 15, kCalls = 8;
    std::array<double, kRuns> times;
    for (double& time : times) {
        const auto start = std::chrono::steady_clock::now();
        for (int i = 0; i < kCalls; ++i)
            ask();
        time = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start)
                   .count() /
               kCalls;
    }
    std::nth_element(times.begin(), times.begin() + kRuns / 2, times.end());
    return times[kRuns / 2];
}

std::string surfaceName(const World& world, uint32_t triangle) {
    if (triangle == kBackground)
        return "";
    const Scene& scene = world.scene();
    const Instance& instance = world.instances()[world.triangleInstance()[triangle]];
    const std::string& mesh = scene.meshes[instance.mesh].name;
    const std::string& material = scene.materials[world.triangleMaterial()[triangle]].name;
    return (mesh.empty() ? "mesh " + std::to_string(instance.mesh) : mesh) +
           (material.empty() ? "" : ", " + material) + ", triangle " + std::to_string(triangle);
}

/// Computes one pair with every method.
class PairTeller {
public:
    PairTeller(FrameRenderer& renderer, const World& world, const Truth& truth,
               const FrameOptions& options)
        : world_(world), truth_(truth), options_(options),
          rays_(renderer.rayInputs(voxelOptions(options))), exact_(renderer.exact()),
          maps_(renderer.shadowMaps()) {}

    std::vector<PairResult> tell(const ShadowPair& pair, PairServer server) const {
        std::vector<PairResult> answers;
        if (rays_.dag.rootAddress != kNoNode)
            answers.push_back(byVoxels(pair));
        if (exact_.bvh.root != kNoTriangleChild)
            answers.push_back(byTriangles(pair));
        answers.push_back(server.isMap() ? byMap(pair, server.map())
                                         : PairResult{"maps", -1, 0, "no map of it is drawn"});
        answers.push_back(byTruth(pair));
        return answers;
    }

    PairGeometry geometryOf(const ShadowPair& pair, PairServer server) const {
        PairGeometry geometry;
        geometry.sampleWorld = pair.positionWorld;
        geometry.lightWorld = pair.lightWorld;
        DagHit hit;
        if (rays_.dag.rootAddress != kNoNode && isStopped(rays_, pairSegment(rays_, pair), &hit)) {
            const VoxelGrid& grid = rays_.dag.grid;
            const glm::dvec3 low(hit.cell);
            geometry.voxelWorld =
                Box{glm::vec3(grid.worldFromVoxel(low)),
                    glm::vec3(grid.worldFromVoxel(low + double(1u << hit.level)))};
        }
        if (server.isMap()) {
            ShadowMapTrace trace{};
            lookupVisibility(maps_, server.map(), pair.positionWorld, pair.normalWorld,
                             options_.bias, &trace);
            const bool isBlocked = trace.texelWorld > 0.0f;
            geometry.texelWorld = texelCorners(maps_.maps[server.map()],
                                               isBlocked ? trace.blockerWorld : pair.positionWorld);
        }
        const uint32_t blocker =
            truth_.blocker(pair.positionWorld, pair.normalWorld, pair.receiver, pair.lightWorld)
                .triangle;
        if (blocker != kBackground) {
            const TriangleView triangles = world_.triangles();
            geometry.triangleWorld =
                std::array{triangles.vertex(blocker, 0), triangles.vertex(blocker, 1),
                           triangles.vertex(blocker, 2)};
        }
        return geometry;
    }

private:
    static RayOptions voxelOptions(const FrameOptions& options) {
        RayOptions rays = options.rays;
        rays.believe = RayOptions{}.believe;
        return rays;
    }

    PairResult byVoxels(const ShadowPair& pair) const {
        PairResult answer{"dag believe all", 0, 0, ""};
        bool isDark = false;
        answer.nanoseconds = timeOf([&] { isDark = isDarkByRays(rays_, pair); });
        answer.visibility = isDark ? 0 : kLit;
        DagHit hit;
        if (isStopped(rays_, pairSegment(rays_, pair), &hit))
            answer.blocker = "cell " + std::to_string(hit.cell.x) + " " +
                             std::to_string(hit.cell.y) + " " + std::to_string(hit.cell.z) +
                             ", level " + std::to_string(hit.level);
        else if (isDark)
            answer.blocker = "moving geometry";
        return answer;
    }

    PairResult byTriangles(const ShadowPair& pair) const {
        PairResult answer{"dag believe none", 0, 0, ""};
        RayInputs inputs = rays_;
        inputs.options.believe = 0.0f;
        inputs.exact = exact_;
        bool isDark = false;
        uint32_t blocker = kBackground;
        answer.nanoseconds = timeOf([&] {
            blocker = kBackground;
            isDark = isDarkByRays(inputs, pair, nullptr, &blocker);
        });
        answer.visibility = isDark ? 0 : kLit;
        if (isDark)
            answer.blocker =
                blocker == kBackground ? "moving geometry" : surfaceName(world_, blocker);
        return answer;
    }

    PairResult byMap(const ShadowPair& pair, uint32_t map) const {
        PairResult answer{"maps", 0, 0, ""};
        ShadowMapTrace trace{};
        uint8_t visibility = 0;
        answer.nanoseconds = timeOf([&] {
            visibility = lookupVisibility(maps_, map, pair.positionWorld, pair.normalWorld,
                                          options_.bias, &trace);
        });
        answer.visibility = visibility;
        if (visibility < kLit)
            answer.blocker = "texel of " + numberText(trace.texelWorld) + " m at " +
                             numberText(glm::length(trace.blockerWorld - pair.positionWorld)) +
                             " m";
        return answer;
    }

    PairResult byTruth(const ShadowPair& pair) const {
        PairResult answer{"truth", 0, 0, ""};
        TruthBlocker blocker;
        const TruthRay ray =
            truth_.pairRay(pair.positionWorld, pair.normalWorld, pair.receiver, pair.lightWorld);
        answer.nanoseconds = timeOf([&] {
            uint8_t blocked = 0;
            truth_.traceBlocked(&ray, 1, &blocked);
            answer.visibility = blocked ? 0 : kLit;
        });
        blocker =
            truth_.blocker(pair.positionWorld, pair.normalWorld, pair.receiver, pair.lightWorld);
        if (blocker.triangle != kBackground)
            answer.blocker = surfaceName(world_, blocker.triangle) + " at " +
                             numberText(blocker.distanceWorld) + " m";
        return answer;
    }

    const World& world_;
    const Truth& truth_;
    const FrameOptions& options_;
    RayInputs rays_;
    ExactView exact_;
    ShadowMapView maps_;
};

} // namespace

PixelReport reportPixel(FrameRenderer& renderer, const World& world, const Truth& truth,
                        const FrameResult& frame, const FrameOptions& options, uint32_t x,
                        uint32_t y) {
    PixelReport report;
    report.x = x;
    report.y = y;
    const GBufferView gbuffer = renderer.gbuffer();
    const uint32_t sample = y * gbuffer.width + x;
    if (x >= gbuffer.width || y >= gbuffer.height || gbuffer.triangle[sample] == kBackground)
        return report;
    report.hasSample = true;
    report.positionWorld = gbuffer.positionWorld[sample];
    report.normalWorld = gbuffer.normalWorld[sample];
    report.surface = surfaceName(world, gbuffer.triangle[sample]);
    report.cluster = renderer.clusters().clusterOfSample[sample];

    const std::vector<PairServer> servers = serversOf(frame.maps);
    const ClusterLightsView lists = renderer.clusterLights();
    renderer.prepareExact();
    const PairTeller teller(renderer, world, truth, options);
    for (uint32_t l = lists.start[report.cluster]; l < lists.start[report.cluster + 1]; ++l) {
        const uint32_t index = lists.lights[l];
        const Light& light = world.lights()[index];
        if (!isPair(light, report.positionWorld, report.normalWorld))
            continue;
        const uint32_t record = lists.record[l];
        const glm::vec3 way = towardsLight(light, report.positionWorld);
        PixelPair pair;
        pair.light = index;
        pair.distanceWorld = light.kind == Light::kSun ? 0.0f : glm::length(way);
        pair.cosine = glm::dot(glm::normalize(way), report.normalWorld);
        const bool isProven = record == kProvenLit || record >= frame.maps.size();
        pair.servedBy = isProven ? "proof" : servers[record].isMap() ? "map" : "rays";
        if (!isProven) {
            pair.requestedTexels = frame.maps[record].quantities.texels;
            pair.faceTexels = frame.maps[record].quantities.faceTexels;
        }
        const ShadowPair asked{report.positionWorld,
                               report.normalWorld,
                               pointAtLight(light, report.positionWorld),
                               gbuffer.triangle[sample],
                               index,
                               light.kind == Light::kSun};
        const PairServer server = isProven ? PairServer::rays() : servers[record];
        pair.answers = teller.tell(asked, server);
        pair.geometry = teller.geometryOf(asked, server);
        report.pairs.push_back(std::move(pair));
    }
    return report;
}

} // namespace shadowdag
