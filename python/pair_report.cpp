// SPDX-License-Identifier: Apache-2.0
#include "python/pair_report.h"

#include "hybrid/frame/shade.h"
#include "shadowmap/shadow_map_lookup.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace shadowdag::python {

namespace {

Json pointJson(const glm::dvec3& p) {
    return {p.x, p.y, p.z};
}

Json truthBlocker(const World& world, const Truth& truth, const ShadowPair& pair) {
    const TruthBlocker blocker =
        truth.blocker(pair.positionWorld, pair.normalWorld, pair.receiver, pair.lightWorld);
    if (blocker.triangle == kBackground)
        return nullptr;
    const Scene& scene = world.scene();
    const Instance& instance = world.instances()[world.triangleInstance()[blocker.triangle]];
    return {{"triangle", blocker.triangle},
            {"distance_world", blocker.distanceWorld},
            {"mesh", scene.meshes[instance.mesh].name},
            {"material", scene.materials[world.triangleMaterial()[blocker.triangle]].name}};
}

Json voxelBlocker(const VisibilityInputs& method, const ShadowPair& pair) {
    if (method.rays.options.believesNone() || method.rays.dag.rootAddress == kNoNode)
        return nullptr;
    DagHit hit;
    if (!isStopped(method.rays, pairSegment(method.rays, pair), &hit))
        return nullptr;
    const VoxelGrid& grid = method.rays.dag.grid;
    const double side = double(1u << hit.level);
    return {{"cell", {hit.cell.x, hit.cell.y, hit.cell.z}},
            {"level", hit.level},
            {"size_world", side * grid.voxelSizeWorld},
            {"center_world", pointJson(grid.worldFromVoxel(glm::dvec3(hit.cell) + 0.5 * side))}};
}

Json mapBlocker(const VisibilityInputs& method, const ShadowPair& pair, uint32_t map) {
    ShadowMapTrace trace{};
    const uint8_t visibility = lookupVisibility(method.maps, map, pair.positionWorld,
                                                pair.normalWorld, method.bias, &trace);
    Json json = {{"face_texels", method.maps.maps[map].faceTexels}};
    json["texel_world"] = visibility < kLit ? Json(trace.texelWorld) : Json();
    json["blocker_world"] = visibility < kLit ? pointJson(glm::dvec3(trace.blockerWorld)) : Json();
    return json;
}

} // namespace

Json pairReport(Workspace& workspace, const RunParameters& run, const PairResults& answers,
                const std::vector<uint8_t>& truth, uint64_t index) {
    const FrameResult& frame = answers.frame;
    const GBufferView& gbuffer = answers.gbuffer;
    const World& world = workspace.world();
    const auto& start = frame.pairs.sampleStart;
    const auto sample =
        size_t(std::upper_bound(start.begin(), start.end(), index) - start.begin() - 1);
    const uint32_t lightIndex = frame.pairs.light[index];
    const Light& light = world.lights()[lightIndex];
    const glm::vec3 position = gbuffer.positionWorld[sample];
    const ShadowPair pair{position,
                          gbuffer.normalWorld[sample],
                          pointAtLight(light, position),
                          gbuffer.triangle[sample],
                          lightIndex,
                          light.kind == Light::kSun};
    const PairServer server = frame.pairServer[index];
    const char* const servers[] = {"rays", "map", "proof"};
    const bool hasVoxels = server.by() == ServedBy::kRays && run.usesRays() && !run.usesEmbree();
    return {{"pair", index},
            {"pixel", {sample % gbuffer.width, sample / gbuffer.width}},
            {"light", lightIndex},
            {"position_world", pointJson(position)},
            {"normal_world", pointJson(pair.normalWorld)},
            {"light_world", pointJson(pair.lightWorld)},
            {"triangle", pair.receiver},
            {"server", servers[size_t(server.by())]},
            {"visibility", frame.visibility[index]},
            {"truth", truth[index]},
            {"truth_blocker", truthBlocker(world, workspace.truth(), pair)},
            {"voxel", hasVoxels ? voxelBlocker(answers.method, pair) : Json()},
            {"map", server.isMap() ? mapBlocker(answers.method, pair, server.map()) : Json()}};
}

} // namespace shadowdag::python
