// SPDX-License-Identifier: Apache-2.0
// Ray sets and answers: what is written is read, what is wrong with them is said, and the score is
// the one computed by hand.
#include "tools/workspace/ray_set.h"

#include "scenes/builtin.h"
#include "tests/tools/temporary_directory.h"
#include "tests/tools/workspace/complaint.h"
#include "tests/tools/workspace/ray_set_files.h"
#include "tools/workspace/workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace shadowdag {
namespace {

using test::complaintOf;
using testing::HasSubstr;

TEST(RaySet, BothFormsAreRead) {
    const TemporaryDirectory directory;
    const RaySet set = makeSmallRaySet();
    for (const char* name : {"set.rays", "set.npz"}) {
        const std::string path = directory / name;
        writeRaySet(set, path);
        const RaySet read = readRaySet(path);
        EXPECT_EQ(read.id(), set.id());
        EXPECT_EQ(read.about, set.about);
        EXPECT_EQ(read.positionWorld, set.positionWorld);
        EXPECT_EQ(read.pixel, set.pixel);
        EXPECT_EQ(read.masks.cuts[0].uv[2], set.masks.cuts[0].uv[2]);
        EXPECT_EQ(read.pairEnd(2), glm::vec3(3, 0, 3.5f) + glm::vec3(8, 16, 0));
    }
}

TEST(RaySet, WhatIsWrongWithASetIsSaid) {
    const auto complaintAbout = [](const std::function<void(RaySet&)>& change) {
        RaySet set = makeSmallRaySet();
        change(set);
        return complaintOf([&] { raySetOf(arraysOf(set), "a.rays"); });
    };
    EXPECT_EQ(complaintAbout([](RaySet&) {}), "nothing was refused");
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.positionWorld[1].y = NAN; }),
                HasSubstr("a.rays: array \"position\", row 1: is not finite"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.normalWorld[2] *= 2.0f; }),
                HasSubstr("array \"normal\", row 2: has not the length 1"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.receiver[0] = 6; }),
                HasSubstr("array \"receiver\", row 0: is 6, beyond the 6 there are"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.pairLight[3] = 3; }),
                HasSubstr("array \"pair_light\", row 3: is 3, beyond the 3 there are"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.pairSample.pop_back(); }),
                HasSubstr("array \"pair_light\" has 4 rows; it needs 3; write the file again"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.triangle[5].z = 12; }),
                HasSubstr("array \"triangle\", row 5: names a vertex that does not exist"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.lightPoint[0].w = 0.5f; }),
                HasSubstr("array \"light_point\", row 0"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.masks.words.pop_back(); }),
                HasSubstr("array \"mask\", row 0: is no mask"));
    EXPECT_THAT(complaintAbout([](RaySet& set) { set.masks.triangleCut[4] = 1; }),
                HasSubstr("array \"triangle_cut\", row 4: is 1"));
    EXPECT_THAT(complaintOf([] {
                    std::vector<NamedArray> arrays = arraysOf(makeSmallRaySet());
                    arrays[1].bytes[0] ^= 1;
                    raySetOf(arrays, "a.rays");
                }),
                HasSubstr("array \"set_id\" is not that of the other arrays"));
    EXPECT_THAT(complaintOf([] {
                    std::vector<NamedArray> arrays = arraysOf(makeSmallRaySet());
                    arrays[0].bytes[0] = '[';
                    raySetOf(arrays, "a.rays");
                }),
                HasSubstr("array \"about\" is no JSON object"));
    const auto complaintAboutText = [&complaintAbout](const std::string& text) {
        return complaintAbout([&](RaySet& set) { set.about = Json::parse(text); });
    };
    EXPECT_THAT(complaintAboutText("{\"scene\": 5}"), HasSubstr("key scene: is no text"));
    EXPECT_THAT(complaintAboutText("{\"frame\": \"0\"}"),
                HasSubstr("key frame: is no whole number"));
    EXPECT_THAT(complaintAboutText("{\"experiment\": []}"),
                HasSubstr("key experiment: is no object"));
    EXPECT_THAT(
        complaintAboutText("{\"a\": " + std::string(200, '[') + std::string(200, ']') + "}"),
        HasSubstr("nest deeper than 100"));
}

TEST(RaySet, OfAFrameHasItsPairsEachOnceAndTheTruthOfTheFrame) {
    for (const char* name : {"fail-sun", "fail-alpha"}) {
        SCOPED_TRACE(name);
        Workspace workspace(loadedScene(makeBuiltin(name)), {});
        FrameOptions options;
        options.width = 80;
        options.height = 45;
        FrameRenderer& renderer = workspace.renderer(kNoVoxels);
        const PairList pairs = renderer.listPairs(workspace.camera(), options);
        const GBufferView gbuffer = renderer.gbuffer();
        const std::vector<Light>& lights = workspace.world().lights();
        RaySet set = makeRaySet(gbuffer, pairs, workspace.world());
        set.about = Json::object();
        ASSERT_EQ(set.pairCount(), pairs.count());
        const std::vector<uint8_t> truth = workspace.truth().visibility(gbuffer, lights, pairs);
        const RaySetTruth judged = judgeRaySet(raySetOf(arraysOf(set), "set"));
        std::vector<uint8_t> seen(pairs.count());
        uint64_t ambiguous = 0;
        for (size_t p = 0; p < set.pairCount(); ++p) {
            const uint32_t s = set.pixel[set.pairSample[p]];
            const uint64_t pair = pairOf(pairs, s, set.pairLight[p]);
            ASSERT_LT(pair, pairs.count());
            ASSERT_EQ(seen[pair]++, 0);
            ASSERT_EQ(set.pairEnd(p),
                      pointAtLight(lights[set.pairLight[p]], gbuffer.positionWorld[s]));
            ASSERT_EQ(judged.lit[p] != 0, truth[pair] == kLit);
            ambiguous += judged.verdicts[p] == Verdict::kAmbiguous;
            if (judged.verdicts[p] != Verdict::kAmbiguous) {
                ASSERT_EQ(judged.verdicts[p] == Verdict::kLit, judged.lit[p] != 0) << p;
            }
        }
        EXPECT_LT(ambiguous, pairs.count() / 50);
    }
}

} // namespace
} // namespace shadowdag
