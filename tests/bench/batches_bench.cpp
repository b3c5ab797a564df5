// SPDX-License-Identifier: Apache-2.0
// Costs and gains of batches: their size and the cut of the tree, updates compared with rebuilds,
// polygon levels of detail. One JSON object on standard output; scenes/BATCHES.md and
// shadowmap/POLYGON_LOD.md contain the tables.
//     batches_bench sizes SCENE TIME...     triangles and batches drawn, times of two stages
//     batches_bench lod SCENE TIME...       triangles drawn and errors, at 640 x 360
//     batches_bench update|refit|rebuild SCENE COUNT   the same motion three ways: for callgrind
#include "hybrid/frame.h"
#include "hybrid/judge/error.h"
#include "scenes/builtin.h"
#include "scenes/polygon_lod.h"
#include "tools/settings/json.h"

#include <nlohmann/json.hpp>

#include <ctime>
#include <iostream>

using namespace shadowdag;

namespace {

double userSeconds() {
    return double(std::clock()) / CLOCKS_PER_SEC;
}

double stageMs(const StageTimes& times, const std::string& stage) {
    for (const auto& [name, timeMs] : times.stagesMs)
        if (name == stage)
            return timeMs;
    return 0;
}

struct Stage {
    Scene scene;
    World world;
    Dag noDag;
    std::unique_ptr<CostModel> allMaps = makeCostModel("texels:0");

    explicit Stage(const std::string& name) : scene(loadScene(name)), world(scene, {}) {}
    Camera camera() const {
        return world.cameras().empty() ? placeCamera(world) : world.cameras()[0];
    }
};

FrameOptions frameOptions() {
    FrameOptions options;
    options.maps.poolBytes = 2ull << 30;
    options.maps.useStaticOptimization = false; // every frame draws
    options.recordPairs = false;
    return options;
}

Json sizes(const std::string& name, const std::vector<float>& times) {
    Json rows = Json::array();
    for (const BatchCut cut : {BatchCut::kFull, BatchCut::kSubtree})
        for (const uint32_t size : {32u, 64u, 128u, 256u, 512u}) {
            Stage stage(name);
            const BatchOptions options{size, cut};
            const double start = userSeconds();
            const BatchSet batches(stage.world, options);
            const double built = userSeconds();
            FrameRenderer renderer(Backend::kCpu, stage.world, stage.noDag, options);
            uint64_t triangles = 0, batchFaces = 0;
            double cullMs = 0, rasterMs = 0;
            for (const float time : times) {
                renderer.worldChanged(stage.world.setTime(time));
                const FrameResult frame =
                    renderer.render(stage.camera(), *stage.allMaps, frameOptions());
                triangles += frame.counts.maps.triangleDrawCount;
                batchFaces += frame.counts.maps.batchFaceCount;
                for (const char* stage : {"culling masks", "culling query", "culling tests"})
                    cullMs += stageMs(frame.stages, stage);
                rasterMs += stageMs(frame.stages, "rasterization");
            }
            rows.push_back({{"cut", cut == BatchCut::kFull ? "full" : "subtree"},
                            {"size", size},
                            {"batch_count", batches.size()},
                            {"build_user_s", built - start},
                            {"triangle_draw_count", triangles},
                            {"batch_face_count", batchFaces},
                            {"culling_ms", cullMs},
                            {"rasterization_ms", rasterMs}});
            std::cerr << rows.back().dump() << "\n";
        }
    return rows;
}

Json lod(const std::string& name, const std::vector<float>& times) {
    Json rows = Json::array();
    Stage stage(name);
    const double start = userSeconds();
    const PolygonLod levels(stage.world);
    std::cerr << "levels " << userSeconds() - start << " s, triangles "
              << levels.triangles().count() << " of " << stage.world.triangles().count() << "\n";
    FrameRenderer renderer(Backend::kCpu, stage.world, stage.noDag);
    Truth truth(stage.world);
    // Texels allowed, and by how many of them the constant bias is raised beside what lookups
    // forgive.
    for (const auto& [texels, raise] : {std::pair(0.0f, 0.0f),
                                        {0.25f, 0.0f},
                                        {0.5f, 0.0f},
                                        {1.0f, 0.0f},
                                        {1.0f, 1.0f},
                                        {2.0f, 0.0f}}) {
        FrameOptions options = frameOptions();
        options.maps.lodTexels = texels;
        options.bias.constantTexels += raise * texels;
        options.recordPairs = true;
        ErrorCounts total;
        uint64_t triangles = 0;
        for (const float time : times) {
            renderer.worldChanged(stage.world.setTime(time));
            truth.update(stage.world);
            const FrameResult frame = renderer.render(stage.camera(), *stage.allMaps, options);
            triangles += frame.counts.maps.triangleDrawCount;
            const std::vector<uint8_t> truthVisibility =
                truth.visibility(renderer.gbuffer(), stage.world.lights(), frame.pairs);
            ErrorOptions errorOptions;
            errorOptions.nullSampleCount = 0;
            errorOptions.bias = options.bias;
            total.add(
                computeError(renderer, frame, stage.world, truth, truthVisibility, errorOptions)
                    .total);
        }
        rows.push_back({{"texels", texels},
                        {"bias_texels", options.bias.constantTexels},
                        {"triangle_draw_count", triangles},
                        {"pair_count", total.pairCount},
                        {"false_shadow_count", total.falseShadowCount},
                        {"false_light_count", total.falseLightCount},
                        {"unexplained_false_shadow_count", total.unexplainedFalseShadowCount},
                        {"unexplained_false_light_count", total.unexplainedFalseLightCount},
                        {"acne_count", total.acneCount},
                        {"contact_count", total.contactCount}});
        std::cerr << rows.back().dump() << "\n";
    }
    return rows;
}

Json updates(const std::string& how, const std::string& name, int count) {
    Stage stage(name);
    BatchSet batches(stage.world);
    WideBvh bvh;
    bvh.build(batches.view().boxesWorld);
    uint64_t moved = 0, sorted = 0;
    for (int i = 1; i <= count; ++i) {
        const std::vector<uint32_t> instances = stage.world.setTime(0.1f * float(i));
        if (how == "update") {
            batches.update(stage.world, instances);
            moved += batches.updateCounts().boxCount;
            sorted += batches.updateCounts().hierarchy.sortedKeyCount;
        } else if (how == "refit") {
            bvh.refit(batches.view().boxesWorld);
        } else {
            bvh.build(batches.view().boxesWorld);
        }
    }
    return {{"how", how},
            {"batch_count", batches.size()},
            {"moved_batch_count", moved},
            {"sorted_key_count", sorted}};
}

} // namespace

int main(int argc, char** argv) try {
    const std::string mode = argc > 2 ? argv[1] : "";
    std::vector<float> times;
    for (int i = 3; i < argc; ++i)
        times.push_back(std::stof(argv[i]));
    if (times.empty())
        throw Error(ErrorKind::kUsage,
                    "batches_bench sizes|lod SCENE TIME... or update|refit|rebuild SCENE COUNT");
    const Json rows = mode == "sizes" ? sizes(argv[2], times)
                      : mode == "lod" ? lod(argv[2], times)
                                      : updates(mode, argv[2], int(times[0]));
    std::cout << Json{{"mode", mode}, {"scene", argv[2]}, {"rows", rows}}.dump(1) << "\n";
    return 0;
} catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
}
