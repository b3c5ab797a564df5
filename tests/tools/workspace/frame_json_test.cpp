// SPDX-License-Identifier: Apache-2.0
// Rows of lights that have several maps.
#include "tools/workspace/frame_json.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

MapRecord mapOf(uint32_t light, uint32_t octave, Route route, float texels, uint32_t faceTexels,
                uint32_t pages) {
    MapRecord map;
    map.quantities.light = light;
    map.quantities.octave = octave;
    map.quantities.texels = texels;
    map.quantities.faceTexels = faceTexels;
    map.quantities.pages = pages;
    map.route = route;
    return map;
}

} // namespace

TEST(FrameJson, ARowOfALightSumsItsMaps) {
    const Json rows =
        lightsJson({mapOf(2, 4, Route::kRays, 20, 32, 3), mapOf(2, 5, Route::kMap, 40, 64, 5),
                    mapOf(2, 7, Route::kMap, 130, 128, 11), mapOf(3, 4, Route::kMap, 17, 16, 2),
                    mapOf(9, 4, Route::kRays, 18, 16, 1), mapOf(9, 5, Route::kRays, 33, 32, 4)});
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0], (Json{{"light", 2},
                             {"route", "both"},
                             {"map_count", 3},
                             {"drawn_map_count", 2},
                             {"texels", 130.0f},
                             {"face_texels", 128},
                             {"pages", 19}}));
    EXPECT_EQ(rows[1]["light"], 3);
    EXPECT_EQ(rows[1]["route"], "map");
    EXPECT_EQ(rows[1]["pages"], 2);
    EXPECT_EQ(rows[2]["light"], 9);
    EXPECT_EQ(rows[2]["route"], "rays");
    EXPECT_EQ(rows[2]["map_count"], 2);
    EXPECT_EQ(rows[2]["drawn_map_count"], 0);
    EXPECT_EQ(rows[2]["pages"], 5);
    EXPECT_EQ(lightsJson({}).size(), 0u);
}

} // namespace shadowdag
