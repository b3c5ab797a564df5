// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench` at smoke size: the answers are verified, the keys are there, wrong options are
// named.
#include "hybrid/judge/embree_baseline.h"
#include "tests/tools/program/program_runner.h"
#include "voxel/dag_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace shadowdag {

namespace {

using testing::HasSubstr;

void expectProvenance(const Json& json) {
    EXPECT_EQ(json["scene"], "builtin:fail-self-shadow");
    EXPECT_EQ(json["scene_hash"].get<std::string>().size(), 32u);
    for (const char* key : {"commit", "compiler", "flags", "cpu", "thread_count"})
        EXPECT_TRUE(json["provenance"].contains(key)) << key;
}

} // namespace

TEST(ProgramBench, VoxelComparesOursWithEmbreeAndNanoVdb) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"bench", "voxel", "builtin:fail-self-shadow", "--size", "64x36",
                                 "--resolution", "64", "--repeats", "3", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("NanoVDB HDDA"));
    const Json json = result.json();
    expectProvenance(json);
    EXPECT_EQ(json["resolution"], 64);
    EXPECT_GT(json["ray_count"].get<int>(), 100);
    EXPECT_EQ(json["voxelize"]["repeat_count"], 3);
    EXPECT_GT(json["voxelize"]["voxel_count"].get<int>(), 0);
    EXPECT_GT(json["voxelize"]["traced_bits_per_voxel"].get<double>(), 0.0);
    EXPECT_LE(json["voxelize"]["cpu_s_min"].get<double>(), json["voxelize"]["cpu_s"].get<double>());
    EXPECT_GT(json["nanovdb_bytes"].get<int>(), 0);
    for (const char* key :
         {"false_shadow_count", "false_light_count", "dark_by_ours_lit_by_nanovdb_count",
          "lit_by_ours_dark_by_nanovdb_count"})
        EXPECT_TRUE(json["checks"].contains(key)) << key;
    std::set<std::string> tracers;
    for (const Json& rate : json["rates"]) {
        tracers.insert(rate["tracer"].get<std::string>());
        EXPECT_GT(rate["megarays_per_s"].get<double>(), 0.0);
        EXPECT_LE(rate["megarays_per_s_min"].get<double>(), rate["megarays_per_s"].get<double>());
        EXPECT_GE(rate["megarays_per_s_max"].get<double>(), rate["megarays_per_s"].get<double>());
        EXPECT_TRUE(rate.contains("occluded_count") && rate.contains("ours_over_it"));
    }
    std::set<std::string> expected = {"occluded", "traceSegments", "NanoVDB HDDA"};
    for (const EmbreeCall call : embreeCalls())
        expected.insert(embreeCallName(call));
    for (const StreamIsa isa : {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512})
        if (hasStreamIsa(isa))
            expected.insert(std::string("traceStream ") + streamIsaName(isa));
    EXPECT_EQ(tracers, expected);
    EXPECT_EQ(json["rates"].size(), 2 * tracers.size());

    EXPECT_THAT(result.err, HasSubstr("completely lit"));
    const Json& frame = json["frame"];
    EXPECT_EQ(frame["pair_count"], json["ray_count"]);
    EXPECT_EQ(frame["width"], json["width"]);
    EXPECT_NEAR(frame["true_lit_share"].get<double>() + frame["true_dark_share"].get<double>() +
                    frame["true_mixed_share"].get<double>(),
                1.0, 1e-9);
    ASSERT_EQ(frame["methods"].size(), 4u);
    EXPECT_EQ(frame["methods"][3]["method"], "rtcOccluded8");
    EXPECT_EQ(frame["exact_wrong_count"], 0);
    EXPECT_GT(frame["exact_bytes"].get<uint64_t>(), 0u);
    for (const Json& method : frame["methods"]) {
        EXPECT_GT(method["ns_per_pair"].get<double>(), 0.0);
        EXPECT_GE(method["disagreement_share"].get<double>(), 0.0);
    }
}

TEST(ProgramBench, NanoVdbIsOmittedWithAMessageAboveItsLimit) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"bench", "voxel", "builtin:fail-self-shadow", "--size", "32x18",
                                 "--resolution", "64", "--nanovdb-limit", "32", "--frame-size",
                                 "48x27", "--repeats", "1", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["width"], 32);
    EXPECT_EQ(result.json()["frame"]["width"], 48);
    EXPECT_EQ(result.json()["frame"]["height"], 27);
    EXPECT_THAT(result.err, HasSubstr("omitted above --nanovdb-limit 32"));
    EXPECT_FALSE(result.json().contains("nanovdb_bytes"));
    const size_t streams = size_t(bestStreamIsa()) + 1;
    EXPECT_EQ(result.json()["rates"].size(), 2 * (2 + streams + embreeCalls().size()));
}

TEST(ProgramBench, RasterComparesDepthsWithEmbree) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"bench", "raster", "builtin:fail-self-shadow", "--size", "64x36",
                                 "--face", "64", "--page-size", "32", "--repeats", "2", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json json = result.json();
    expectProvenance(json);
    EXPECT_EQ(json["page_texels"], 32);
    EXPECT_GT(json["checks"]["texel_count"].get<int>(), 0);
    EXPECT_EQ(json["checks"]["differing_count"], 0);
    for (const char* stage : {"page masks", "page clear", "culling tests", "rasterization"})
        EXPECT_TRUE(json["stages"][stage].contains("time_ms_max")) << stage;
    EXPECT_EQ(json["embree"].size(), embreeCalls().size());
}

TEST(ProgramBench, ShadingVerifiesEveryLookup) {
    const TemporaryDirectory directory;
    for (const char* scene : {"builtin:fail-self-shadow", "builtin:houses-by-day"}) {
        const ProgramResult result = runShadowdag(
            directory, {"bench", "shading", scene, "--size", "64x36", "--repeats", "1", "--json"});
        ASSERT_EQ(result.status, 0) << result.err;
        const Json json = result.json();
        EXPECT_TRUE(json["provenance"].contains("commit"));
        EXPECT_GT(json["pair_count"].get<int>(), 100);
        EXPECT_GE(json["checks"]["lookup_count"].get<int>(), 3 * json["lookup_count"].get<int>());
        EXPECT_EQ(json["checks"]["differing_count"], 0);
        ASSERT_EQ(json["rows"].size(), 4u);
        EXPECT_GT(json["rows"][0]["ns_each_low"].get<double>(), 0.0);
        EXPECT_TRUE(json["frame"]["stages_ms"].contains("g-buffer"));
    }
}

TEST(ProgramBench, OptionsOfTheOtherBenchmarkAreRefused) {
    const TemporaryDirectory directory;
    EXPECT_THAT(runShadowdag(directory, {"bench", "shading", "--maps", "4"}).err,
                HasSubstr("for bench raster"));
    EXPECT_THAT(runShadowdag(directory, {"bench", "shading", "--backend", "gl"}).err,
                HasSubstr("runs on the CPU"));
    EXPECT_THAT(runShadowdag(directory, {"bench", "raster", "--resolution", "64"}).err,
                HasSubstr("drop it"));
    EXPECT_THAT(runShadowdag(directory, {"bench", "voxel", "--face", "64"}).err,
                HasSubstr("drop it"));
    EXPECT_THAT(runShadowdag(directory, {"bench", "raster", "--page-size", "48"}).err,
                HasSubstr("--page-size '48'"));
    EXPECT_THAT(runShadowdag(directory, {"bench", "raster", "--backend", "cuda"}).err,
                HasSubstr("runs on the CPU: drop --backend cuda"));
    EXPECT_THAT(runShadowdag(directory, {"bench", "voxel", "--backend", "gl"}).err,
                HasSubstr("runs on the CPU and on CUDA: drop --backend gl"));
    EXPECT_THAT(
        runShadowdag(directory, {"bench", "voxel", "--backend", "cuda", "--frame-size", "9x9"}).err,
        HasSubstr("--frame-size is for the CPU's tracers"));
}

} // namespace shadowdag
