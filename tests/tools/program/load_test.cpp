// SPDX-License-Identifier: Apache-2.0
// The program under load: many lights, instances, pixels, voxels; lights at one point, cameras that
// see nothing. Each is an answer or a refusal, within the stated memory and processor time.
// SDAG_LOAD=1 in the environment runs the largest ones, too.
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <cstdlib>

namespace shadowdag {
namespace {

using testing::HasSubstr;

constexpr uint64_t kMiB = uint64_t(1) << 20;

/// A run with what it took.
struct LoadResult {
    int status = -1;
    std::string out, err;
    uint64_t peakBytes = 0;
    double cpuSeconds = 0;

    Json json() const { return Json::parse(out); }
};

LoadResult runLoad(const TemporaryDirectory& directory, const Arguments& arguments,
                   const Arguments& before = {}) {
    LoadResult result;
    const std::string out = directory / "load.out", err = directory / "load.err";
    const pid_t child = startProgram(directory, arguments, out, err, before);
    int status = 0;
    struct rusage usage {};
    wait4(child, &status, 0, &usage);
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = readText(out);
    result.err = readText(err);
    result.peakBytes = uint64_t(usage.ru_maxrss) << 10;
    const auto seconds = [](const timeval& t) {
        return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
    };
    result.cpuSeconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    return result;
}

/// Expects success, and no more than the stated memory and time.
void expectWithin(const LoadResult& result, uint64_t bytes, double cpuSeconds) {
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_LE(result.peakBytes, bytes) << result.peakBytes / kMiB << " MiB";
    EXPECT_LE(result.cpuSeconds, cpuSeconds);
}

Arguments render(const std::string& scene, const std::string& method,
                 const TemporaryDirectory& directory, const Arguments& more = {}) {
    Arguments arguments = {"render", scene, "--method",         method, "--json", "--size",
                           "64x36",  "-o",  directory / "f.png"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

/// A scene of one triangle, (0 0 0), (1 0 0), (0 1 0), placed by these nodes; light 0 is a point.
std::string writeScene(const TemporaryDirectory& directory, const std::string& nodes,
                       size_t nodeCount) {
    std::string roots;
    for (size_t i = 0; i < nodeCount; ++i)
        roots += (i ? "," : "") + std::to_string(i);
    const std::string path = directory / "load.gltf";
    writeText(
        path,
        R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],)"
        R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":5,"range":5}]}},)"
        R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
        R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],)"
        R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
        R"("nodes":[)" +
            nodes + R"(],"scenes":[{"nodes":[)" + roots + "]}]}");
    return path;
}

bool isFullLoad() {
    return std::getenv("SDAG_LOAD") != nullptr;
}

TEST(Load, AHundredThousandLightsAreAFrame) {
    const TemporaryDirectory directory;
    for (const char* method : {"dag", "maps", "hybrid"}) {
        SCOPED_TRACE(method);
        const LoadResult result = runLoad(
            directory, render("builtin:fail-acne", method, directory, {"--lights", "100000"}));
        expectWithin(result, 256 * kMiB, 20);
        EXPECT_EQ(result.json()["light_count"], 100000);
    }
}

TEST(Load, AMillionInstancesAreRead) {
    constexpr size_t kSide = 1000;
    std::string nodes;
    for (size_t i = 0; i < kSide * kSide; ++i)
        nodes += (i ? ",{" : "{") + std::string("\"mesh\":0,\"translation\":[") +
                 std::to_string(2 * (i % kSide)) + ",0," + std::to_string(2 * (i / kSide)) + "]}";
    const TemporaryDirectory directory;
    const std::string scene = writeScene(directory, nodes, kSide * kSide);
    const uint64_t fileBytes = std::filesystem::file_size(scene);
    const LoadResult result = runLoad(directory, {"info", scene, "--json"});
    expectWithin(result, 128 * kMiB + 32 * fileBytes, 30);
    EXPECT_EQ(result.json()["triangle_count"], kSide * kSide);
    if (!isFullLoad())
        GTEST_SKIP() << "read, not rendered: set SDAG_LOAD=1 to render them (a minute)";
    expectWithin(runLoad(directory, render(scene, "dag", directory, {"--lights", "100"})),
                 256 * kMiB + 64 * fileBytes, 120);
}

TEST(Load, APictureBeyondTheLimitIsRefused) {
    const TemporaryDirectory directory;
    const LoadResult result = runLoad(directory, {"render", "builtin:fail-acne", "-o",
                                                  directory / "f.png", "--size", "16384x16384"});
    EXPECT_EQ(result.status, 1);
    EXPECT_THAT(result.err, HasSubstr("67108864 pixels at most"));
    EXPECT_LE(result.cpuSeconds, 2);
}

TEST(Load, APictureThatCannotFitIsRefusedWithItsMemory) {
    const TemporaryDirectory directory;
    const LoadResult result =
        runLoad(directory,
                {"render", "builtin:fail-acne", "-o", directory / "f.png", "--size", "8192x8192"},
                {"/usr/bin/prlimit", "--data=" + std::to_string(2048 * kMiB)});
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, HasSubstr("a picture of 8192 x 8192 pixels takes at least 8960 MiB of "
                                      "memory, this process may take 2048 MiB"));
    EXPECT_LE(result.peakBytes, 256 * kMiB);
}

TEST(Load, TheLargestPictureIsAnAnswerOrARefusal) {
    if (!isFullLoad())
        GTEST_SKIP() << "set SDAG_LOAD=1 to render 8192 x 8192 pixels (two minutes, 16 GiB)";
    const TemporaryDirectory directory;
    const LoadResult result = runLoad(directory, {"render", "builtin:fail-acne", "-o",
                                                  directory / "f.png", "--size", "8192x8192"});
    if (result.status == 3) {
        EXPECT_THAT(result.err, HasSubstr("8192 x 8192"));
    } else {
        expectWithin(result, 16384 * kMiB, 300);
    }
}

TEST(Load, OneShareOf131072CubedStaysWithinItsMemory) {
    const TemporaryDirectory directory;
    const Arguments arguments = {"voxelize",
                                 "builtin:fail-wires",
                                 "--resolution",
                                 "131072",
                                 "--part",
                                 isFullLoad() ? "7/64" : "7/512",
                                 "--memory-limit",
                                 "256M",
                                 "--json",
                                 "-o",
                                 directory / "p.svpart"};
    expectWithin(runLoad(directory, arguments), 256 * kMiB, isFullLoad() ? 60 : 20);
    EXPECT_GT(std::filesystem::file_size(directory / "p.svpart"), 1000u);
}

TEST(Load, LightsAtOnePointAreAFrame) {
    constexpr size_t kLights = 5000;
    std::string nodes = R"({"mesh":0})";
    for (size_t i = 0; i < kLights; ++i)
        nodes +=
            R"(,{"translation":[0.25,0.25,1],"extensions":{"KHR_lights_punctual":{"light":0}}})";
    const TemporaryDirectory directory;
    const std::string scene = writeScene(directory, nodes, 1 + kLights);
    for (const char* method : {"dag", "maps", "hybrid"}) {
        SCOPED_TRACE(method);
        const LoadResult result = runLoad(directory, render(scene, method, directory));
        expectWithin(result, 768 * kMiB, 20);
        const Json frame = result.json()["frames"][0];
        // Equal lights light equal samples.
        EXPECT_GT(frame["pair_count"], 0);
        EXPECT_EQ(frame["pair_count"].get<uint64_t>() % kLights, 0u);
    }
}

TEST(Load, ACameraInsideAWallOrLookingAtNothingIsAFrame) {
    const TemporaryDirectory directory;
    for (const char* method : {"dag", "maps", "hybrid", "embree"}) {
        SCOPED_TRACE(method);
        // In the middle of a wall of 2 cm, and from above the roof into the sky.
        for (const char* camera : {"0,1.5,0,0,1.5,-3", "0,100,0,0,200,0.01"}) {
            SCOPED_TRACE(camera);
            const LoadResult result = runLoad(directory, render("builtin:fail-thin-wall", method,
                                                                directory, {"--camera", camera}));
            expectWithin(result, 512 * kMiB, 20);
            if (camera[2] == '1' && camera[3] == '0') {
                EXPECT_EQ(result.json()["frames"][0]["pair_count"], 0);
            }
        }
    }
    const LoadResult judged = runLoad(directory, {"validate", "builtin:fail-thin-wall", "--camera",
                                                  "0,100,0,0,200,0.01", "--size", "64x36"});
    EXPECT_EQ(judged.status, 2);
    EXPECT_THAT(judged.err, HasSubstr("no light reaches what the camera sees"));
}

} // namespace
} // namespace shadowdag
