// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/cost_file.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

namespace shadowdag {

TEST(CostFile, RoundTripsExactly) {
    const TemporaryDirectory directory;
    CostTable table;
    table[{"a", 3}] = FrameCosts{3, {{1, 0, 0.1, 2.5}, {7, 0, 1.0 / 3.0, 0}}};
    table[{"a", 3}].degradeDivisor = 1.4142135;
    table[{"a", 3}].wholeFrameTexels = 0.0f;
    table[{"a", 3, FrameStart::kWarm}] = FrameCosts{3, {{1, 0, 0.1, 0.5}}};
    writeText(directory / "c.json", jsonText(toJson(table)));
    const CostTable back = readCosts(directory / "c.json");
    const FrameCosts& costs = findCosts(back, "c.json", {"a", 3});
    EXPECT_EQ(costs.frame, 3u);
    ASSERT_EQ(costs.maps.size(), 2u);
    EXPECT_EQ(costs.maps[1].light, 7u);
    EXPECT_EQ(costs.maps[1].raysMs, 1.0 / 3.0);
    EXPECT_EQ(costs.maps[0].mapMs, 2.5);
    EXPECT_EQ(costs.degradeDivisor, 1.4142135);
    EXPECT_EQ(costs.wholeFrameTexels, 0.0f);
    EXPECT_EQ(findCosts(back, "c.json", {"a", 3, FrameStart::kWarm}).maps[0].mapMs, 0.5);
    EXPECT_THROW(findCosts(back, "c.json", {"a", 4}), Error);
    EXPECT_THROW(findCosts(back, "c.json", {"b", 3}), Error);
}

TEST(CostFile, WholeFramesAreOfOneMethodOrAThreshold) {
    for (const float texels : {0.0f, 96.25f, std::numeric_limits<float>::infinity()})
        EXPECT_EQ(wholeFrameFromJson(wholeFrameJson(texels), ""), texels);
    EXPECT_EQ(wholeFrameJson(0.0f), "map");
    for (const Json& other : {Json("maps"), Json(-1), Json(0), Json(1e39), Json(), Json::array()})
        EXPECT_THROW(wholeFrameFromJson(other, "c.json"), Error) << other;
}

TEST(CostFile, OneLightMayHaveSeveralMaps) {
    const TemporaryDirectory directory;
    CostTable table;
    table[{"a", 0}] = FrameCosts{0, {{4, 6, 1, 2}, {4, 7, 3, 4}, {5, 2, 5, 6}}};
    writeText(directory / "c.json", jsonText(toJson(table)));
    const FrameCosts back = readCosts(directory / "c.json").begin()->second;
    ASSERT_EQ(back.maps.size(), 3u);
    EXPECT_EQ(back.maps[1].octave, 7u);
    EXPECT_EQ(back.maps[1].mapMs, 4);
}

TEST(CostFile, CostsOfOtherConditionsAreRefusedUnlessStaleOnesAreAllowed) {
    const TemporaryDirectory directory;
    const Json of = {{"scene_hash", "h"}, {"size", "32x18"}, {"lights", 5}, {"light_seed", 1}};
    CostTable table;
    table[{"a", 0}] = {FrameCosts{0, {{0, 0, 1, 2}}}, of};
    table[{"b", 0}] = FrameCosts{0, {{0, 0, 1, 2}}};
    writeText(directory / "c.json", jsonText(toJson(table)));
    const CostTable back = readCosts(directory / "c.json");
    std::string notes;
    const Console console(Console::Listener{[&](const std::string& note) { notes += note; }, {}});
    const auto refusalOf = [&](const char* scene, const Json& here, bool allowStale) {
        try {
            findCosts(back, "c.json", {scene, 0}, here, allowStale, console);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(refusalOf("a", of, false), "");
    for (const auto& [key, value] :
         {std::pair("scene_hash", Json("g")), std::pair("size", Json("64x36")),
          std::pair("lights", Json(6)), std::pair("light_seed", Json(2))}) {
        Json here = of;
        here[key] = value;
        EXPECT_THAT(refusalOf("a", here, false),
                    testing::HasSubstr("c.json: its costs of a frame 0, cold were measured with " +
                                       std::string(key) + " " + of[key].dump() + " instead of " +
                                       value.dump()));
        EXPECT_EQ(notes, "");
        EXPECT_EQ(refusalOf("a", here, true), "");
        EXPECT_THAT(std::exchange(notes, ""), testing::HasSubstr("used nevertheless"));
        EXPECT_EQ(refusalOf("b", here, false), "") << "an older file";
    }
    CostSource source = readCostSource(directory / "c.json", Json::object());
    EXPECT_THAT(remarksOn(source, {}),
                testing::ElementsAre(testing::HasSubstr("does not record the geometry")));
    source.table->erase({"b", 0});
    EXPECT_THAT(remarksOn(source, {}), testing::IsEmpty());
}

TEST(CostFile, BrokenFilesAreInputErrors) {
    const TemporaryDirectory directory;
    const std::string path = directory / "c.json";
    for (const char* text :
         {"", "[]", "{}", "{\"costs\": 3}", "{\"costs\": [{\"scene\": \"a\", \"frame\": 0}]}",
          "{\"costs\": [{\"scene\": \"a\", \"frame\": 0, \"maps\": [{\"light\": 0, \"rays_ms\": "
          "-1, \"map_ms\": 0}]}]}",
          "{\"costs\": [{\"scene\": \"a\", \"frame\": 0, \"maps\": [{\"light\": 2, \"rays_ms\": 1, "
          "\"map_ms\": 0},"
          "{\"light\": 1, \"rays_ms\": 1, \"map_ms\": 0}]}]}",
          "{\"costs\": [{\"scene\": \"a\", \"frame\": 0, \"maps\": []}, {\"scene\": \"a\", "
          "\"frame\": 0, \"maps\": []}]}",
          "{\"costs\": [{\"scene\": \"a\", \"frame\": 0, \"maps\": [], \"of\": 7}]}"}) {
        writeText(path, text);
        try {
            readCosts(path);
            ADD_FAILURE() << "accepted: " << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << text;
            EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
        }
    }
    EXPECT_THROW(readCosts(directory / "none.json"), Error);
}

} // namespace shadowdag
