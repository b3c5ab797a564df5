// SPDX-License-Identifier: Apache-2.0
// The bench of a device, on the CPU in its place: same code, same checks.
#include "scenes/builtin.h"
#include "tools/bench/bench_device.h"
#include "tools/workspace/scene_setup.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>
#include <sstream>

namespace shadowdag {

TEST(BenchDevice, VerifiesAndTimesBothTracersInBothOrders) {
    const Console console(true);
    const LoadedScene scene = loadSceneAndWorld("builtin:fail-self-shadow", -1, 1, true, console);
    VoxelBenchOptions options;
    options.width = 64;
    options.height = 36;
    options.resolutionLog2 = 6;
    options.repeats = 3;
    const Json json = runDeviceBench(Backend::kCpu, *scene.world,
                                     chooseCamera(*scene.world, "auto"), options, console);
    EXPECT_EQ(json["resolution"], 64);
    EXPECT_GT(json["ray_count"].get<int>(), 100);
    EXPECT_EQ(json["nanovdb_difference_count"], 0); // the same text on the same processor
    std::set<std::string> rows;
    for (const Json& rate : json["rates"]) {
        rows.insert(rate["tracer"].get<std::string>() + " " + rate["order"].get<std::string>());
        EXPECT_GT(rate["megarays_per_s_min"].get<double>(), 0.0);
        EXPECT_LE(rate["megarays_per_s_min"], rate["megarays_per_s"]);
        EXPECT_LE(rate["megarays_per_s"], rate["megarays_per_s_max"]);
    }
    EXPECT_EQ(rows, (std::set<std::string>{"traceSegments image", "traceSegments cluster",
                                           "NanoVDB HDDA image", "NanoVDB HDDA cluster"}));
    std::ostringstream table;
    printDeviceBench(table, json);
    EXPECT_NE(table.str().find("NanoVDB HDDA"), std::string::npos);

    options.nanoVdbResolutionLog2 = 5;
    EXPECT_EQ(runDeviceBench(Backend::kCpu, *scene.world, chooseCamera(*scene.world, "auto"),
                             options, console)["rates"]
                  .size(),
              2u);
}

} // namespace shadowdag
