// SPDX-License-Identifier: Apache-2.0
// The built program as scripts use it: help, exit statuses, messages, one JSON object on standard
// output.
#include "cuda/backend.h"
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tests/tools/program/end_by_signal.h"
#include "tests/tools/program/program_refusals.h"
#include "tools/workspace/judge.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// Returns one channel of a picture of 32 x 18, as floats; fails where size or channel differ.
std::vector<float> readChannel(const std::string& path, const char* channel) {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    EXPECT_EQ(window.max.x - window.min.x + 1, 32) << path;
    EXPECT_EQ(window.max.y - window.min.y + 1, 18) << path;
    EXPECT_NE(file.header().channels().findChannel(channel), nullptr) << path << ": " << channel;
    std::vector<float> values(32 * 18, -1.0f);
    Imf::FrameBuffer frame;
    frame.insert(channel,
                 Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 4 * 32));
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return values;
}

/// The smallest scene that the tests use.
const std::string kScene = "builtin:atrium";
const Arguments kSmall = {"--size", "32x18", "--resolution", "64"};

} // namespace

TEST(Program, EverySubcommandHasHelp) {
    const TemporaryDirectory directory;
    const ProgramResult root = runShadowdag(directory, {"--help"});
    EXPECT_EQ(root.status, 0);
    EXPECT_THAT(root.out, HasSubstr("Exit status"));
    for (const char* command : {"scene", "voxelize", "merge", "info", "export", "import", "render",
                                "validate", "compare", "bench"}) {
        const ProgramResult result = runShadowdag(directory, {command, "--help"});
        EXPECT_EQ(result.status, 0) << command;
        EXPECT_THAT(root.out, HasSubstr(command));
        for (const char* option : {"--json", "--threads", "--backend"})
            EXPECT_THAT(result.out, HasSubstr(option)) << command;
        EXPECT_THAT(result.err, IsEmpty()) << command;
    }
    EXPECT_THAT(runShadowdag(directory, {"--version"}).out, HasSubstr("shadowdag 0."));
}

TEST(Program, ScenesWithNothingToLightOrOnlyDarkLightsAreRefused) {
    const TemporaryDirectory directory;
    const std::string flat = directory / "flat.glb", dark = directory / "dark.glb";
    Scene scene = makeBuiltin("fail-contact");
    for (LightSource& light : scene.lights)
        light.intensity = 0;
    writeGlb(scene, dark);
    scene = makeBuiltin("fail-contact");
    for (Mesh& mesh : scene.meshes)
        for (glm::uvec3& triangle : mesh.triangles)
            triangle.z = triangle.y;
    writeGlb(scene, flat);
    const std::string png = directory / "a.png";
    expectRefused(directory,
                  {{Arguments{"render", dark, "-o", png} + kSmall, 2, "all its lights are dark"},
                   {Arguments{"render", flat, "-o", png} + kSmall, 2, "no triangle has an area"}});
    EXPECT_EQ(
        runShadowdag(directory, Arguments{"render", dark, "-o", png, "--lights", "3"} + kSmall)
            .status,
        0);
}

TEST(Program, UnknownCommandsAreRefused) {
    const TemporaryDirectory directory;
    for (const char* command : {"ray", "shade"}) {
        const ProgramResult result = runShadowdag(directory, {command});
        EXPECT_EQ(result.status, 1) << command;
        EXPECT_THAT(result.err,
                    HasSubstr("unknown subcommand '" + std::string(command) +
                              "'; the subcommands are scene, voxelize, merge, info, export, "
                              "import, render"));
    }
}

TEST(Program, ErrorsAreReportedWithTheirStatus) {
    const TemporaryDirectory directory;
    const std::string exr = directory / "a.exr", dag = directory / "a.svdag",
                      dir = directory / "report";
    writeText(directory / "broken.glb", "this is no glTF");
    writeText(directory / "broken.svdag", "this is no asset");
    writeText(directory / "experiment.json",
              "{\"scenes\": [\"builtin:atrium\"], \"sise\": \"1x1\"}");
    writeText(directory / "zero.json", "{\"a\\u0000b\": 1}");
    writeText(directory / "empty.json",
              R"({"scenes": ["builtin:atrium"], "methods": [], "thresholds": [], "models": []})");
    writeText(directory / "unread.json",
              R"({"scenes": ["builtin:atrium"], "methods": ["embree"], "thresholds": [],
                  "models": [], "resolutions": [64]})");
    writeText(directory / "unknown.json", R"({"scenes": ["builtin:nothing"]})");
    writeText(directory / "utf16.json", std::string("\xff\xfe{\0}\0", 6));
    std::filesystem::create_symlink("loop", directory / "loop");
    ASSERT_EQ(mkfifo((directory / "pipe.glb").c_str(), 0600), 0);
    const std::vector<Wrong> cases = {
        {{}, 1, "subcommand"},
        {{"rendr"}, 1, "rendr"},
        {{"render"}, 1, "required"},
        {{"render", kScene, "-o", exr, "--nonsense"}, 1, "--nonsense"},
        {{"render", kScene, "-o", exr, "--size", "16x9", "--size", "8x8"},
         1,
         "--size is given 2 times, as '16x9', '8x8'; give it once"},
        {{"render", kScene, "-o", exr, "--size", "0x0"}, 1, "--size '0x0'"},
        {{"render", kScene, "-o", exr, "--size", "1000000x1000000"}, 1, "pixels at most"},
        {{"render", kScene, "-o", exr, "--resolution", "1000"}, 1, "the nearest are 512 and 1024"},
        {{"render", kScene, "-o", exr, "--resolution", "512,1024"}, 1, "takes one value"},
        {{"render", kScene, "-o", exr, "--method", "magic"}, 1, "--method 'magic'"},
        {{"render", kScene, "-o", exr, "--method", "dag", "--model", "oracle"},
         1,
         "--model is for"},
        {{"render", kScene, "-o", exr, "--method", "maps", "--lod", "1"}, 1, "--lod is for"},
        {{"render", kScene, "-o", exr, "--method", "dag", "--lod", "1"},
         1,
         "--lod is for rays through voxels, not for 'dag' that believes none; add --believe all"},
        {{"render", kScene, "-o", exr, "--method", "dag", "--taps", "1"}, 1, "--taps is for"},
        {{"compare", kScene, "-o", dir, "--methods", "dag,exact"}, 1, "dag, maps, hybrid, embree"},
        {{"render", kScene, "-o", exr, "--lod", "pixels"}, 1, "footprint[:SCALE]"},
        {{"render", kScene, "-o", exr, "--lod", "footprint:0"}, 1, "the scale"},
        {{"render", kScene, "-o", exr, "--lod", "footprint:1:2"}, 1, "nothing more"},
        {{"render", kScene, "-o", exr, "--lod", "coverage:2"}, 1, "the share"},
        {{"render", kScene, "-o", exr, "--method", "dag", "--taps", "1"}, 1, "--taps is for"},
        {{"render", kScene, "-o", exr, "--model", "texel:96"}, 1, "texel:96"},
        {{"render", kScene, "-o", exr, "--costs", "c.json"}, 1, "--costs"},
        {{"render", kScene, "-o", exr, "--taps", "5"}, 1, "--taps '5'"},
        {{"render", kScene, "-o", exr, "--pool", "12Q"}, 1, "--pool '12Q'"},
        {{"render", kScene, "-o", exr, "--time", "1", "--frames", "0:1"},
         1,
         "--time and --frames contradict"},
        {{"render", kScene, "-o", exr, "--voxels", dag, "--resolution", "64"},
         1,
         "--voxels and --resolution"},
        {{"render", kScene, "-o", exr, "--believe", "all", "--voxels", directory / "none.svdag"},
         2,
         "none.svdag"},
        {{"render", kScene, "-o", exr, "--believe", "all", "--voxels", directory / "broken.svdag"},
         2,
         "broken.svdag"},
        {{"render", kScene, "-o", exr, "--threads", "-3"}, 1, "--threads '-3'"},
        {{"render", kScene, "-o", exr, "--methd", "dag"},
         1,
         "unknown option --methd; did you mean --method? See shadowdag render --help"},
        {{"render", kScene, "-o", exr, "--nonsense=1"}, 1, "unknown option --nonsense; see"},
        {{"voxelize", "--nonsense", kScene}, 1, "unknown option --nonsense; see"}, // and no -o
        {{"voxelize", "-x", kScene}, 1, "unknown option -x; see"},
        {{"voxelize", "-oa.svdag", "--", "--nonsense", "b"}, 1, "not expected"},
        {{"render", kScene, "-o", exr, "--backend", "gpu"}, 1, "gpu"},
        {Arguments{"render", kScene, "-o", exr, "--camera", "1,2,3"} + kSmall, 1, "six numbers"},
        {Arguments{"render", kScene, "-o", exr, "--camera", "1,2,3,1,2,3"} + kSmall, 1,
         "same point"},
        {{"render", kScene, "-o", exr, "--camera", "0,0,0,1,0,0,171"},
         1,
         "the angle must be from 0.057 to 170 degrees"},
        {{"render", kScene, "-o", exr, "--camera", "0,0,0,1,0,0,50,2,1"},
         1,
         "the planes must be 0 < near < far"},
        {{"render", kScene, "-o", exr, "--camera", "0,0,0,1,0,0,50,1,2,181"},
         1,
         "the roll must be from -180 to 180 degrees"},
        {Arguments{"render", kScene, "-o", exr, "--camera", "nobody", "--method", "maps", "--size",
                   "32x18"},
         1, "no camera of that name"},
        {{"render", kScene}, 1, "-o is missing"},
        {{"render", kScene, "-o", exr, "--laps", "2"}, 1, "--output and --laps contradict"},
        {{"render", kScene, "--laps", "2", "--truth"}, 1, "--truth and --laps contradict"},
        {{"render", kScene, "--laps", "0"}, 1, "--laps '0'"},
        {{"render", kScene, "--laps", "2", "--time", "3"}, 1, "--time and --laps contradict"},
        {{"render", kScene, "--laps", "2", "--method", "maps", "--route-margin", "0.5"},
         1,
         "--route-margin is for hybrid"},
        {{"render", kScene, "--laps", "1", "--method", "truth"}, 1, "no sequence"},
        {{"render", kScene, "-o", directory / "a.jpg"}, 1, ".exr or .png"},
        {{"render", kScene, "-o", directory / "a.png", "--per-light"}, 1, "--per-light"},
        {{"render", kScene, "-o", directory / "a.png", "--truth"},
         1,
         "--truth adds channels that a .png does not have"},
        {{"render", kScene, "-o", exr, "--per-light", "--lights", "1001", "--method", "maps"},
         1,
         "1000 channels at most"},
        {{"render", kScene, "-o", directory / "missing/a.exr"}, 3, "there is no directory"},
        {{"voxelize", kScene, "-o", directory / "broken.svdag/x"},
         3,
         "broken.svdag' is a file, not a folder"},
        {{"compare", kScene, "-o", directory / "broken.svdag/x/y", "--no-charts"},
         3,
         "broken.svdag' is a file, not a folder"},
        {{"render", "builtin:nothing", "-o", exr}, 1, "nothing"},
        {{"render", "builtin:fail_wires", "-o", exr}, 1, "did you mean builtin:fail-wires?"},
        {{"render", "fail_wires", "-o", exr}, 2, "no such file; did you mean builtin:fail-wires?"},
        {{"render", "atrium", "-o", exr}, 2, "no such file; did you mean builtin:atrium?"},
        {{"render", "", "-o", exr}, 1, "SCENE is empty"},
        {{"render", directory / "broken.svdag", "-o", exr}, 1, "pass the asset as --voxels"},
        {{"render", kScene, "-o", exr, "--lights", "0"}, 1, "--lights '0'"},
        {{"render", kScene, "-o", exr, "--camera", ""}, 1, "--camera '': is empty"},
        {{"render", directory / "none.glb", "-o", exr}, 2, "none.glb"},
        {{"render", directory / "broken.glb", "-o", exr}, 2, "broken.glb"},
        {{"info", directory / "broken.svdag"}, 2, "broken.svdag"},
        {{"info", directory / "broken.svdag", "--lights", "3"}, 1, "is an asset"},
        {{"info", directory / "a.svpart"}, 1, "is a part of a voxel build"},
        {{"info", kScene, "--verify"}, 1, "--verify is for assets (.svdag), not for"},
        {{"scene", "atrium"}, 1, "-o F.glb"},
        {{"scene", "atrium", "--list"}, 1, "--list"},
        {{"scene", "nothing", "-o", directory / "a.glb"}, 1, "nothing"},
        {{"scene", "atrium", "-o", directory / "a.obj"}, 1, ".glb"},
        {{"scene", "atrium", "-o", "/proc/a.glb"}, 3, "/proc/a.glb"},
        {{"voxelize", kScene, "-o", directory / "a.vox"}, 1, ".svdag"},
        {{"voxelize", kScene, "-o", dag, "--resolution", "262144"}, 1, "131072"},
        {{"voxelize", kScene, "-o", dag, "--backend", "cuda", "--memory-limit", "1G"},
         1,
         "--memory-limit and --backend cuda"},
        {{"validate", kScene, "--method", "truth"}, 1, "must be one of dag, maps, hybrid, embree"},
        {{"compare", kScene, "-o", dir, "--methods", "truth"},
         1,
         "must be one of dag, maps, hybrid, embree"},
        {{"validate", kScene, "--frames", "0:1"}, 1, "one frame"},
        {{"compare", "-o", dir}, 1, "SCENE or --experiment"},
        {{"compare", kScene, "-o", dir, "--methods", "dag,dag"}, 1, "twice"},
        {{"compare", kScene, "-o", dir, "--thresholds", "0,-1"}, 1, "'-1'"},
        {{"compare", kScene, "-o", dir, "--repeats", "0"}, 1, "--repeats '0'"},
        {{"compare", kScene, "-o", dir, "--experiment", directory / "none.json"}, 2, "none.json"},
        {{"compare", "-o", dir, "--experiment", directory / "experiment.json"},
         2,
         "unknown key \"sise\""},
        {{"compare", "-o", dir, "--experiment", directory / "unread.json", "--size", "1x1"},
         1,
         "contradict"},
        {{"compare", kScene, "-o", exr + "/x", "--no-charts", "--costs", directory / "none.json"},
         2,
         "none.json"},
        {{"compare", "-o", dir, "--experiment", directory / "empty.json"},
         2,
         "empty.json: nothing to compare: \"methods\", \"thresholds\" and \"models\" select no "
         "run"},
        {{"compare", "-o", dir, "--experiment", directory / "unread.json"},
         2,
         "unread.json: key \"resolutions\" is for methods dag and hybrid"},
        {{"compare", "-o", dir, "--experiment", directory / "unknown.json"},
         2,
         "unknown.json: there is no built-in scene 'nothing'"},
        {{"compare", "-o", dir, "--experiment", directory / "utf16.json"},
         2,
         "utf16.json: is UTF-16; save it as UTF-8"},
        {{"compare", kScene, "-o", directory / "loop", "--no-charts"},
         3,
         "loop: is a loop of symbolic links; remove them"},
        {{"compare", "-o", dir, "--experiment", directory / "zero.json"},
         2,
         "\"a\\u0000b\" contains a zero byte"},
        {{"info", directory / "a\x1b[31m.glb"}, 2, "a\\x1b[31m.glb: no such file"},
        {{"info", directory / "a\nb\x9b.glb"}, 2, "a\\x0ab\\x9b.glb: no such file"},
        {{"scene", "atrium", "-o", directory / "pipe.glb"},
         3,
         "it is a pipe, a socket or a device"},
        {{"info", directory / "pipe.glb"}, 2, "not a regular file"},
        // Of the default method, whose rays believe no voxel.
        {{"render", kScene, "-o", exr, "--voxels", directory / "none.svdag"},
         2,
         "none.svdag': cannot be opened: No such file"},
        {{"render", kScene, "-o", exr, "--voxels", directory / "broken.glb"},
         2,
         "broken.glb': is no voxel asset; give an asset of voxelize"},
        {{"render", kScene, "-o", exr, "--method", "hybrid", "--model", "expr: "},
         1,
         "is empty; give an expression"},
        {{"bench", "raster", kScene, "--lights", "100001"}, 1, "from -1 to 100000"},
        {{"info", kScene, "--lights", "100001"}, 1, "from -1 to 100000"},
        {{"bench", "nothing"}, 1, "use voxel, raster or shading"},
        {{"bench", "raster", "--backend", "cuda"}, 1, "drop --backend cuda"},
        {{"bench", "voxel", "--backend", "gl"}, 1, "drop --backend gl"},
        {{"info", kScene, "--backend", "gl", "--gl-pages", "atlas"},
         1,
         "is for commands that draw frames"},
        {{"validate", kScene, "--exposure", "2"}, 1, "--exposure has no effect without -o"},
        {{"info", kScene, "--gl-pages", "atlas"}, 1, "--gl-pages is for --backend gl"},
        {{"info", kScene, "--backend", "gl", "--gl-pages", "pool"}, 1, "use auto, sparse or atlas"},
    };
    expectRefused(directory, cases);
    EXPECT_FALSE(std::filesystem::exists(exr));
    EXPECT_FALSE(std::filesystem::exists(dag));
}

TEST(Program, NamesDoNotReachTheTerminalAsControlCharacters) {
    const TemporaryDirectory directory;
    const std::string name = directory / "a\x1b[31m\xc2\x9b\x9b\u202e", asset = name + ".svdag",
                      scene = name + ".glb";
    for (const Arguments& command :
         {Arguments{"scene", "fail-acne", "-o", scene},
          Arguments{"voxelize", scene, "-o", asset, "--resolution", "64"}, Arguments{"info", scene},
          Arguments{"info", asset}, Arguments{"export", asset, "-o", name + ".vdb"},
          Arguments{"import", name + ".vdb", "-o", asset},
          Arguments{"render", scene, "-o", name + ".exr", "--size", "32x18"},
          Arguments{"compare", scene, "-o", name, "--no-charts", "--size", "16x9", "--methods",
                    "embree,dag", "--repeats", "1"}}) {
        const ProgramResult result = runShadowdag(directory, command);
        EXPECT_EQ(result.status, 0) << result.err;
        for (const std::string& text : {result.out, result.err})
            for (const char* control : {"\x1b", "\x9b", "\u202e"})
                EXPECT_THAT(text, testing::Not(HasSubstr(control))) << command[0];
        EXPECT_THAT(result.out, HasSubstr("a\\x1b[31m\\xc2\\x9b\\x9b\\xe2\\x80\\xae"))
            << command[0];
    }
}

TEST(Program, FilesOfTheSystemWhoseSizeIsNotWhatTheyHoldAreRefusedWithATrueReason) {
    const TemporaryDirectory directory;
    for (const char* file : {"/proc/cpuinfo", "/sys/devices/system/cpu/online"})
        for (const char* name : {"a.glb", "a.gltf", "a.svdag", "a.vdb", "a.nvdb"}) {
            std::filesystem::remove(directory / name);
            std::filesystem::create_symlink(file, directory / name);
            const bool isGrid = std::string(name).find("vdb") != std::string::npos;
            const ProgramResult result =
                isGrid ? runShadowdag(directory,
                                      {"import", directory / name, "-o", directory / "b.svdag"})
                       : runShadowdag(directory, {"info", directory / name});
            EXPECT_EQ(result.status, 2);
            for (const char* untrue : {"Success", "is empty", "cannot be opened", "cannot be read"})
                EXPECT_THAT(result.err, testing::Not(HasSubstr(untrue))) << file;
        }
}

TEST(Program, ATooLongNameIsNotBlamedOnTheDisk) {
    const TemporaryDirectory directory;
    const std::string name = directory / std::string(250, 'a');
    for (const Arguments& command :
         {Arguments{"scene", "fail-acne", "-o", name + ".glb"},
          Arguments{"voxelize", kScene, "-o", name + ".svdag", "--memory-limit", "1G"},
          Arguments{"compare", kScene, "-o", name + "bcdefg", "--no-charts"},
          Arguments{"study", "failures", "-o", name + "bcdefg", "--no-charts"}}) {
        const ProgramResult result = runShadowdag(directory, command);
        EXPECT_EQ(result.status, 3) << command[0];
        EXPECT_THAT(result.err, HasSubstr("File name too long; ")) << command[0];
        EXPECT_THAT(result.err, testing::Not(HasSubstr("disk"))) << command[0];
    }
}

// The names that the program adds to while it writes: no input is looked at before.
TEST(Program, ANameWithoutRoomForUnfinishedFilesIsRefusedBeforeTheWork) {
    const TemporaryDirectory directory;
    const std::string absent = directory / "absent", glb = absent + ".glb";
    const auto named = [&](const std::string& extension, size_t bytes = 230) {
        return directory / std::string(bytes - extension.size(), 'a') + extension;
    };
    for (const auto& [command, output] : {
             std::pair{Arguments{"scene", "atrium"}, named(".glb")},
             {Arguments{"voxelize", glb}, named(".svdag")},
             {Arguments{"voxelize", glb, "--resume"}, named(".svdag")},
             {Arguments{"voxelize", glb, "--memory-limit", "1G"}, named(".svdag")},
             {Arguments{"voxelize", glb, "--part", "1/2"}, named(".svpart")},
             {Arguments{"merge", absent + ".svpart"}, named(".svdag")},
             {Arguments{"export", absent + ".svdag"}, named(".vdb")},
             {Arguments{"import", absent + ".vdb"}, named(".svdag")},
             {Arguments{"render", glb}, named(".exr")},
             {Arguments{"render", glb, "--frames", "0:1"}, named(".exr", 225)},
             {Arguments{"calibrate", glb}, named(".json")},
             {Arguments{"calibrate", glb, "--observations", named(".json")}, directory / "a.json"},
             {Arguments{"fit", glb, "--max", "1", "--no-charts"}, named(".json")},
             {Arguments{"fit", glb, "--max", "1", "--no-charts"}, named(".json", 229)},
             {Arguments{"rays", glb}, named(".rays")},
         }) {
        const ProgramResult result = runShadowdag(directory, command + Arguments{"-o", output});
        EXPECT_EQ(result.status, 3) << command[0];
        EXPECT_THAT(result.err,
                    HasSubstr("File name too long; choose a name of at most 229 bytes, so that "
                              "unfinished files"))
            << command[0];
    }
    // The longest name that is accepted works to the end, by every way that a build writes.
    const std::string longest = named(".svdag", 229);
    for (const Arguments& way : {Arguments{}, Arguments{"--resume", "--checkpoint", "0"},
                                 Arguments{"--memory-limit", "1G", "--checkpoint", "0"}}) {
        const ProgramResult result = runShadowdag(
            directory, Arguments{"voxelize", kScene, "-o", longest, "--resolution", "64"} + way);
        EXPECT_EQ(result.status, 0) << result.err;
        EXPECT_TRUE(std::filesystem::remove(longest));
    }
}

TEST(Program, ADeletedWorkingFolderIsRefusedBeforeTheWork) {
    const TemporaryDirectory directory;
    for (const Arguments& command :
         {Arguments{"voxelize", "absent.glb", "-o", "a.svdag"},
          Arguments{"rays", "absent.glb", "-o", "a.rays"},
          Arguments{"fit", "absent.glb", "-o", "a.json", "--max", "1", "--no-charts"}}) {
        const std::string gone = directory / "gone";
        std::filesystem::create_directory(gone);
        const ProgramResult result =
            runShadowdag(directory, command,
                         {"/bin/sh", "-c", "cd \"$0\" && rmdir \"$0\" && exec \"$@\"", gone});
        EXPECT_EQ(result.status, 3) << command[0];
        EXPECT_THAT(result.err, HasSubstr("it was deleted; choose another folder")) << command[0];
    }
}

// Root has the rights to write into /proc, but no file can be created there.
TEST(Program, APlaceWhereNoFileCanBeCreatedIsRefusedBeforeTheWork) {
    const TemporaryDirectory directory;
    const std::string none = directory / "none"; // an input, which is read later
    writeText(directory / "a.json", "{}");
    for (const Arguments& command :
         {Arguments{"voxelize", none, "-o", "/proc/a.svdag"},
          Arguments{"merge", none, "-o", "/proc/a.svdag"},
          Arguments{"export", none + ".svdag", "-o", "/proc/a.vdb"},
          Arguments{"import", none + ".vdb", "-o", "/proc/a.svdag"},
          Arguments{"render", none, "-o", "/proc/a.png"},
          Arguments{"diff", none, none, "-o", "/proc/a.html"},
          Arguments{"calibrate", none, "-o", "/proc/a.json"},
          Arguments{"fit", none, "-o", "/proc/a.json", "--max", "1", "--no-charts"},
          Arguments{"rays", none, "-o", "/proc/a.rays"},
          Arguments{"rays", none, "-o", "/proc", "--answer", none},
          Arguments{"compare", kScene, "-o", "/proc", "--no-charts"},
          Arguments{"study", "failures", "-o", "/proc"},
          Arguments{"figures", directory / "a.json", "-o", "/proc"},
          Arguments{"validate", none, "-o", "/proc"}}) {
        const ProgramResult result = runShadowdag(directory, command);
        EXPECT_EQ(result.status, 3) << command[0] << ": " << result.err;
        EXPECT_THAT(result.err, HasSubstr("/proc")) << command[0];
    }
}

TEST(Program, EveryCommandRefusesADeviceAndALinkThatLeadsNowhereAsItsOutputAlike) {
    const TemporaryDirectory directory;
    const std::string link = directory / "link";
    std::filesystem::create_symlink("nowhere", link);
    for (const Arguments& command :
         {Arguments{"scene", "atrium"}, Arguments{"voxelize", kScene}, Arguments{"merge", "p"},
          Arguments{"export", "a.svdag"}, Arguments{"import", "a.vdb"}, Arguments{"render", kScene},
          Arguments{"calibrate", kScene}, Arguments{"fit", kScene, "--max", "1"},
          Arguments{"rays", kScene}, Arguments{"rays", kScene, "--answer", "a.npz"},
          Arguments{"compare", kScene, "--no-charts"}, Arguments{"study", "failures"},
          Arguments{"figures", directory / "a.json"}, Arguments{"validate", kScene}}) {
        writeText(directory / "a.json", "{}");
        const ProgramResult result =
            runShadowdag(directory, command + Arguments{"-o", "/dev/null"});
        EXPECT_EQ(result.status, 3) << command[0] << ": " << result.err;
    }
    for (const Arguments& command :
         {Arguments{"compare", kScene, "--no-charts"}, Arguments{"study", "failures"},
          Arguments{"rays", kScene, "--answer", "a.npz"},
          Arguments{"figures", directory / "a.json"}, Arguments{"validate", kScene}}) {
        const ProgramResult result = runShadowdag(directory, command + Arguments{"-o", link});
        EXPECT_EQ(result.status, 3) << command[0];
        EXPECT_THAT(result.err, HasSubstr("is a symbolic link that leads nowhere")) << command[0];
    }
}

TEST(Program, PipesOfTheShellAreReadOnce) {
    const TemporaryDirectory directory;
    writeText(directory / "a.json", "{\"scenes\": [\"builtin:fail-acne\"], \"size\": \"16x9\", "
                                    "\"methods\": [\"embree\", \"dag\"]}");
    const std::string pipe = "<(cat " + (directory / "a.json") + ")";
    const ProgramResult compared =
        runShadowdag(directory, {"compare", "-o", directory / "report", "--no-charts"},
                     {"/bin/bash", "-c", "exec \"$@\" --experiment " + pipe, "bash"});
    EXPECT_EQ(compared.status, 0) << compared.err;
    const ProgramResult fitted =
        runShadowdag(directory, {"calibrate", "-o", directory / "c.json"},
                     {"/bin/bash", "-c", "exec \"$@\" --from " + pipe, "bash"});
    EXPECT_EQ(fitted.status, 2);
    EXPECT_THAT(fitted.err, HasSubstr("contains no observations")); // it was read
}

TEST(Program, TooManyOpenFilesAreAResourceError) {
    const TemporaryDirectory directory;
    const std::string scene = directory / "a.glb", asset = directory / "a.svdag",
                      experiment = directory / "a.json";
    writeText(experiment, "{\"scenes\": [\"builtin:fail-acne\"]}");
    ASSERT_EQ(runShadowdag(directory, {"scene", "fail-acne", "-o", scene}).status, 0);
    const Arguments voxelize = {"voxelize", scene, "--resolution", "64", "-o"};
    const auto with = [](Arguments first, const Arguments& more) {
        first.insert(first.end(), more.begin(), more.end());
        return first;
    };
    ASSERT_EQ(runShadowdag(directory, with(voxelize, {asset})).status, 0);
    const std::string part = directory / "a.svpart";
    ASSERT_EQ(runShadowdag(directory, with(voxelize, {part, "--part", "1/1"})).status, 0);
    const std::string grids[] = {directory / "in.vdb", directory / "in.nvdb"};
    for (const std::string& grid : grids)
        ASSERT_EQ(runShadowdag(directory, {"export", asset, "-o", grid}).status, 0);
    writeText(directory / "results.json", "{}");
    for (const Arguments& command :
         {Arguments{"info", scene}, Arguments{"info", asset},
          Arguments{"render", scene, "-o", directory / "a.exr", "--size", "32x18"},
          with(voxelize, {directory / "b.svdag", "--memory-limit", "1G"}),
          Arguments{"merge", part, "-o", directory / "c.svdag"},
          Arguments{"export", asset, "-o", directory / "a.vdb"},
          Arguments{"import", grids[0], "-o", directory / "d.svdag"},
          Arguments{"import", grids[1], "-o", directory / "d.svdag"},
          Arguments{"figures", directory / "results.json", "-o", directory / "f"},
          Arguments{"study", "failures", "--only", "acne", "-o", directory / "s"},
          Arguments{"compare", "-o", directory / "r", "--experiment", experiment},
          Arguments{"compare", "-o", directory / "r", "--no-charts", "--experiment", experiment}}) {
        int tooManyCount = 0;
        for (int limit = 4; limit < 9; ++limit) { // of files: below, libraries are not loaded
            const ProgramResult result = runShadowdag(
                directory, command,
                {"/bin/sh", "-c", "ulimit -n " + std::to_string(limit) + "; exec \"$@\"", "sh"});
            if (result.status == 0 || result.status == 127)
                continue;
            // With enough files for Python, it reads the empty results.
            if (command[0] == "figures" && result.status == 2 && limit > 5) {
                EXPECT_THAT(result.err, HasSubstr("results.json: not a results file")) << limit;
                continue;
            }
            EXPECT_EQ(result.status, 3) << command[0] << ", " << limit << ": " << result.err;
            EXPECT_THAT(result.err, HasSubstr("ulimit -n")) << command[0] << ", " << limit;
            for (const char* blamed :
                 {"disk space", "disk full", "another place", "apt-get", "damaged", "another dir"})
                EXPECT_THAT(result.err, testing::Not(HasSubstr(blamed)))
                    << command[0] << ", " << limit;
            ++tooManyCount;
        }
        EXPECT_GT(tooManyCount, 0) << command[0];
    }
}

TEST(Program, StandardStreamsThatAreClosedAreNotTakenByFiles) {
    const TemporaryDirectory directory;
    for (const auto& [closed, status] :
         {std::pair{"<&-", 0}, {">&-", 3}, {"2>&-", 0}, {"<&- 2>&-", 0}, {"<&- >&- 2>&-", 3}}) {
        const std::string output = directory / "a.glb";
        const ProgramResult result =
            runShadowdag(directory, {"scene", "fail-acne", "-o", output},
                         {"/usr/bin/timeout", "-s", "KILL", "20", "/bin/sh", "-c",
                          std::string("exec \"$@\" ") + closed, "sh"});
        EXPECT_EQ(result.status, status) << closed << ": " << result.err;
        EXPECT_EQ(result.err.find("standard output is closed; open it") != std::string::npos,
                  std::string_view(closed) == ">&-")
            << closed << ": " << result.err;
        EXPECT_TRUE(std::filesystem::remove(output)) << closed;
    }
}

TEST(Program, HelpThatCannotBeWrittenIsAnError) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"--help"}, {"/bin/sh", "-c", "exec \"$@\" >/dev/full", "sh"});
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, HasSubstr("standard output cannot be written; is the disk full"));
}

TEST(Program, TheHelpOfCalibrateShowsItsOwnDefaults) {
    const TemporaryDirectory directory;
    const std::string help = runShadowdag(directory, {"calibrate", "--help"}).out;
    EXPECT_THAT(help, HasSubstr("as in 256M [1G]"));
    EXPECT_THAT(help, HasSubstr("and cached [4096]"));
}

TEST(Program, AWindowWithoutADisplayLeavesNoLog) {
    const TemporaryDirectory directory;
    const std::string log = directory / "log.jsonl";
    const ProgramResult result =
        runShadowdag(directory, {"view", "builtin:fail-acne", "--log", log},
                     {"/usr/bin/env", "-u", "DISPLAY", "-u", "WAYLAND_DISPLAY"});
    EXPECT_EQ(result.status, 4) << result.err;
    EXPECT_FALSE(std::filesystem::exists(log));
}

// One binary for machines with and without a device: here none is visible, whatever there is.
TEST(Program, WithoutADeviceRefusesCudaWithTheReasonAndRunsOnTheCpu) {
    const TemporaryDirectory directory;
    const std::string exr = directory / "a.exr";
    const Arguments render = Arguments{"render", kScene, "-o", exr, "--method", "dag"} + kSmall;
    const Arguments blind = {"/usr/bin/env", "CUDA_VISIBLE_DEVICES="};
    for (const Arguments& command : {Arguments{"info", kScene}, render}) {
        const ProgramResult result =
            runShadowdag(directory, command + Arguments{"--backend", "cuda"}, blind);
        EXPECT_EQ(result.status, 4);
        EXPECT_THAT(result.err, HasSubstr("shadowdag: error: backend 'cuda' is not available: "));
        EXPECT_THAT(result.err, HasSubstr(builtWithCuda() ? "CUDA driver" : "built without CUDA"));
        EXPECT_THAT(result.err, HasSubstr("--backend cpu"));
        EXPECT_FALSE(std::filesystem::exists(exr));
    }
    ProgramResult result = runShadowdag(directory, render + Arguments{"--backend", "cpu"}, blind);
    EXPECT_EQ(result.status, 0) << result.err;
    const std::vector<float> byCpu = readChannel(exr, "R");
    std::filesystem::remove(exr);
    result = runShadowdag(directory, render, blind);
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("backend auto: cpu"));
    EXPECT_EQ(readChannel(exr, "R"), byCpu);
}

TEST(Program, JsonIsOneObjectAloneOnStandardOutput) {
    const TemporaryDirectory directory;
    const std::string dag = directory / "a.svdag";
    ProgramResult result = runShadowdag(directory, {"info", kScene, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    for (const char* key :
         {"triangle_count", "bounds_min", "bounds_max", "light_count", "camera_count"})
        EXPECT_TRUE(result.json().contains(key)) << key;

    result = runShadowdag(directory, {"scene", "--list", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_GE(result.json()["scenes"].size(), 3u);

    result =
        runShadowdag(directory, {"voxelize", kScene, "-o", dag, "--resolution", "64", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    for (const char* key : {"resolution", "voxel_count", "node_counts", "leaf_count", "asset_bytes",
                            "traced_bytes", "wall_s", "cpu_s", "peak_rss_bytes"})
        EXPECT_TRUE(result.json().contains(key)) << key;
    const Json built = result.json();
    result = runShadowdag(directory, {"info", dag, "--verify", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    for (const char* key :
         {"resolution", "voxel_count", "node_counts", "leaf_count", "asset_bytes", "traced_bytes"})
        EXPECT_EQ(result.json()[key], built[key]) << key;
    EXPECT_EQ(built["asset_bytes"], std::filesystem::file_size(dag));

    result = runShadowdag(directory, {"validate", kScene, "--size", "32x18", "--voxels", dag,
                                      "--json", "-o", directory / "errors"});
    ASSERT_EQ(result.status, 0) << result.err;
    for (const char* key :
         {"pair_count", "occluded_count", "false_shadow_count", "false_light_count",
          "unexplained_false_shadow_count", "unexplained_false_light_count", "acne_count",
          "contact_count", "null_rate", "tap_settled_count", "tap_null_rate", "tap_only_null_rate",
          "tap_null_sample_count"})
        EXPECT_TRUE(result.json().contains(key)) << key;
    uint64_t sum = 0;
    const Json validated = result.json();
    for (const Json& light : validated["lights"])
        sum += light["pair_count"].get<uint64_t>();
    EXPECT_EQ(sum, validated["pair_count"].get<uint64_t>());
    EXPECT_TRUE(std::filesystem::exists(directory / "errors/error.png"));
}

TEST(Program, RenderExposesPicturesAsRequested) {
    const TemporaryDirectory directory;
    const auto render = [&](const char* name, const Arguments& more) {
        const std::string file = directory / name;
        const ProgramResult result = runShadowdag(
            directory,
            Arguments{"render", kScene, "--method", "maps", "--size", "32x18", "-o", file} + more);
        EXPECT_EQ(result.status, 0) << result.err;
        return readText(file);
    };
    const std::string found = render("a.png", {});
    EXPECT_EQ(render("b.png", {"--exposure", "0"}), found);
    EXPECT_NE(render("c.png", {"--exposure", "0.001"}), found);
    const ProgramResult refused =
        runShadowdag(directory, {"render", kScene, "--method", "maps", "-o", directory / "d.exr",
                                 "--exposure", "2"});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("--exposure is for a .png"), std::string::npos) << refused.err;
}

TEST(Program, RenderWritesNumberedFramesOfEveryMethod) {
    const TemporaryDirectory directory;
    for (const char* method : {"truth", "embree", "dag", "maps", "hybrid"}) {
        Arguments arguments = {"render",   kScene, "--method",
                               method,     "-o",   directory / (std::string(method) + ".exr"),
                               "--frames", "0:1",  "--json",
                               "--size",   "32x18"};
        if (std::string(method) != "truth")
            arguments = arguments + Arguments{"--truth"};
        if (std::string(method).starts_with("dag") || std::string(method) == "hybrid")
            arguments = arguments + Arguments{"--resolution", "64"};
        const ProgramResult result = runShadowdag(directory, arguments);
        ASSERT_EQ(result.status, 0) << result.err;
        EXPECT_EQ(result.json()["frames"].size(), 2u);
        for (const char* number : {".0000.exr", ".0001.exr"}) {
            const std::string file = directory / (std::string(method) + number);
            ASSERT_TRUE(std::filesystem::exists(file)) << file;
            const std::vector<float> green = readChannel(file, "G");
            const std::vector<float> visibility = readChannel(file, "visibility.mean");
            EXPECT_TRUE(std::all_of(green.begin(), green.end(), [](float v) { return v >= 0; }));
            EXPECT_GT(*std::max_element(green.begin(), green.end()), 0.0f) << file << " is black";
            const auto [least, most] = std::minmax_element(visibility.begin(), visibility.end());
            EXPECT_GE(*least, 0.0f) << file;
            EXPECT_LE(*most, 1.0f) << file;
            EXPECT_LT(*least, *most) << file << ": shadow and light look alike";
            if (std::string(method) == "truth")
                continue;
            const std::vector<float> pairs = readChannel(file, "error.pairCount");
            const std::vector<float> share = readChannel(file, "method.rayShare");
            for (size_t i = 0; i < pairs.size(); ++i) {
                if (pairs[i] > 0 && std::string(method) != "hybrid") {
                    EXPECT_EQ(share[i], std::string(method) != "maps" ? 1.0f : 0.0f) << file;
                }
            }
        }
    }
}

TEST(Program, RenderTimesTheLastOfSeveralLapsAndWritesNothing) {
    const TemporaryDirectory directory;
    for (const char* method : {"maps", "dag", "hybrid", "embree"}) {
        Arguments arguments{"render", "builtin:atrium", "--laps", "2",        "--frames", "0:3",
                            "--size", "48x27",          "--json", "--method", method};
        if (std::string(method) == "dag")
            arguments = arguments + Arguments{"--believe", "all", "--resolution", "64"};
        const ProgramResult result = runShadowdag(directory, arguments);
        ASSERT_EQ(result.status, 0) << method << ": " << result.err;
        const Json json = result.json();
        EXPECT_EQ(json["laps"], 2);
        EXPECT_EQ(json["method"], method);
        ASSERT_EQ(json["frames"].size(), 4u);
        for (uint32_t i = 0; i < 4; ++i) {
            const Json& row = json["frames"][i];
            EXPECT_EQ(row["frame"], i);
            EXPECT_GT(row["pair_count"].get<int>(), 0);
            // Stages are parts of the frame; the clock of a thread may be read a little later.
            EXPECT_GE(row["wall_ms"].get<double>() * 1.01 + 0.05, row["time_ms"].get<double>());
        }
        // Maps of what stands still were drawn in the first lap; movers' are drawn anew.
        if (std::string(method) == "maps") {
            EXPECT_GT(json["frames"][0]["kept_map_count"].get<int>(), 0);
        }
        EXPECT_GT(json["stages_ms"]["shading"].get<double>(), 0.0);
    }
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
        EXPECT_TRUE(entry.path().extension() != ".exr" && entry.path().extension() != ".png");
}

TEST(Program, ValidateReplacesOnlyItsOwnPictures) {
    const TemporaryDirectory directory;
    const Arguments validate = {"validate",         kScene,   "--method", "maps", "-o",
                                directory / "maps", "--size", "32x18"};
    std::filesystem::create_directory(directory / "maps");
    writeText(directory / "maps/error.png", "mine");
    expectRefused(directory, {{validate, 1, "contains error.png and not method.png"}});
    EXPECT_EQ(readText(directory / "maps/error.png"), "mine");
    std::filesystem::remove(directory / "maps/error.png");
    EXPECT_EQ(runShadowdag(directory, validate).status, 0);
    EXPECT_EQ(runShadowdag(directory, validate).status, 0); // over its own
    // As a run leaves them that was killed before the last one, and before the last two.
    for (const Arguments& absent : {Arguments{"errors.exr"}, {"error.png", "errors.exr"}}) {
        for (const std::string& name : absent)
            std::filesystem::remove(directory / ("maps/" + name));
        EXPECT_EQ(runShadowdag(directory, validate).status, 0) << absent.size();
    }
}

TEST(Program, NoCommandReplacesAFileThatItReads) {
    const TemporaryDirectory directory;
    const std::string asset = directory / "a.svdag", part = directory / "b.svdag",
                      picture = directory / "s.png";
    ASSERT_EQ(
        runShadowdag(directory, {"voxelize", kScene, "--resolution", "64", "-o", asset}).status, 0);
    ASSERT_EQ(runShadowdag(directory, {"voxelize", kScene, "--resolution", "64", "-o",
                                       directory / "b.svpart", "--part", "1/1"})
                  .status,
              0);
    ASSERT_EQ(runShadowdag(directory, {"scene", "fail-acne", "-o", directory / "s.glb"}).status, 0);
    std::filesystem::rename(directory / "b.svpart", part);
    std::filesystem::rename(directory / "s.glb", picture);
    std::filesystem::create_symlink(picture, directory / "link.png");
    const std::string voxels = directory / "v.png";
    std::filesystem::copy_file(asset, voxels);
    for (const Arguments& command :
         {Arguments{"merge", part, "-o", part},
          Arguments{"merge", part, "-o", directory / "./b.svdag"},
          Arguments{"render", picture, "-o", picture},
          Arguments{"render", picture, "-o", directory / "link.png"},
          Arguments{"render", kScene, "-o", voxels, "--voxels", voxels}}) {
        const std::string before = readText(part) + readText(picture) + readText(voxels);
        expectRefused(directory, {{command, 1, "is also the file of another argument"}});
        EXPECT_EQ(readText(part) + readText(picture) + readText(voxels), before);
    }
}

TEST(Program, AFailedValidateLeavesNoFolder) {
    const TemporaryDirectory directory;
    for (const char* camera : {"0,900,0,0,901,0", "elsewhere"}) {
        EXPECT_NE(runShadowdag(directory, {"validate", kScene, "--size", "32x18", "--camera",
                                           camera, "-o", directory / "new/folder"})
                      .status,
                  0);
        EXPECT_FALSE(std::filesystem::exists(directory / "new")) << camera;
    }
}

// Embree ends the program for a ray to where floats end.
TEST(Program, AFarPlaneBeyondAnySceneIsValidated) {
    const TemporaryDirectory directory;
    for (const char* far : {"100", "1e20", "1e30"}) {
        const ProgramResult result =
            runShadowdag(directory, {"validate", "builtin:fail-wires", "--size", "40x23",
                                     "--camera", std::string("0,1,6,0,0,0,50,0.1,") + far});
        EXPECT_EQ(result.status, 0) << far << ": " << result.err;
        EXPECT_EQ(result.err.find("hides from the camera"), std::string::npos) << result.err;
    }
}

TEST(Program, EachOfSeveralViewsIsRenderedAndValidated) {
    const TemporaryDirectory directory;
    const Arguments views = {"--views", "2", "--method", "maps", "--size", "64x36", "--json"};
    const ProgramResult rendered = runShadowdag(
        directory, Arguments{"render", kScene, "-o", directory / "a.exr", "--frames", "3"} + views);
    ASSERT_EQ(rendered.status, 0) << rendered.err;
    const Json frames = rendered.json()["frames"];
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[1]["camera"], "auto-2");
    EXPECT_NE(frames[0]["pair_count"], frames[1]["pair_count"]);
    EXPECT_TRUE(std::filesystem::exists(directory / "a.auto.0003.exr"));
    EXPECT_TRUE(std::filesystem::exists(directory / "a.auto-2.0003.exr"));

    const ProgramResult validated =
        runShadowdag(directory, Arguments{"validate", kScene, "-o", directory / "maps"} + views);
    ASSERT_EQ(validated.status, 0) << validated.err;
    const Json all = validated.json();
    ASSERT_EQ(all["views"].size(), 2u);
    for (size_t i = 0; i < 2; ++i)
        EXPECT_EQ(all["views"][i]["pair_count"], frames[i]["pair_count"]);
    EXPECT_EQ(all["pair_count"].get<uint64_t>(),
              frames[0]["pair_count"].get<uint64_t>() + frames[1]["pair_count"].get<uint64_t>());
    EXPECT_TRUE(std::filesystem::exists(directory / "maps/auto-2/error.png"));
    const ProgramResult alone =
        runShadowdag(directory, {"validate", kScene, "--camera", "auto-2", "--method", "maps",
                                 "--size", "64x36", "--json"});
    EXPECT_EQ(alone.json()["lights"], all["views"][1]["lights"]);
}

// The range of the only light ends before any surface; a view of 8 x 8 samples has too few pairs.
TEST(Program, ViewsWithoutPairsAreErrorsAndWithFewOnesWarned) {
    const TemporaryDirectory directory;
    const std::string dark = directory / "dark.glb";
    Scene scene = makeBuiltin("fail-contact");
    for (LightSource& light : scene.lights)
        light.rangeWorld = 1e-3f;
    writeGlb(scene, dark);
    const Arguments tiny = {"--size", "32x18", "--resolution", "64"};
    expectRefused(directory,
                  {{Arguments{"validate", dark} + tiny, 2, "nothing to compare; give another"},
                   {Arguments{"compare", dark, "-o", directory / "report", "--no-charts",
                              "--methods", "embree,dag"} +
                        tiny,
                    2, "dark.glb, frame 0: no light reaches what the camera sees"},
                   {{"bench", "voxel", dark, "--resolution", "64"}, 2, "no light reaches a view"},
                   {{"bench", "raster", dark}, 2, "no light reaches a visible surface"},
                   {{"bench", "shading", dark}, 2, "no light reaches a visible surface"}});
    const ProgramResult unfit =
        runShadowdag(directory, {"calibrate", dark, "-o", directory / "c.json", "--quick",
                                 "--observations", directory / "o.json"});
    EXPECT_EQ(unfit.status, 2);
    EXPECT_THAT(unfit.err, HasSubstr("dark.glb: no light reaches what the camera sees, so no map "
                                     "was measured"));
    EXPECT_FALSE(std::filesystem::exists(directory / "o.json"));
    EXPECT_FALSE(std::filesystem::exists(directory / "c.json"));
    const ProgramResult few =
        runShadowdag(directory, Arguments{"validate", "builtin:fail-contact", "--json"} + tiny);
    ASSERT_EQ(few.status, 0) << few.err;
    ASSERT_LT(few.json()["pair_count"].get<uint64_t>(), kFewPairCount);
    EXPECT_THAT(few.err, HasSubstr("warning: builtin:fail-contact: has only "));
    EXPECT_THAT(few.json()["warning"].get<std::string>(), HasSubstr("fewer than 1000"));
    // A picture of what no light reaches is black, and a fit compares errors.
    const ProgramResult black = runShadowdag(
        directory, Arguments{"render", dark, "-o", directory / "b.png", "--json"} + tiny);
    EXPECT_EQ(black.status, 0) << black.err;
    EXPECT_THAT(black.err, HasSubstr("b.png: no light reaches what the camera sees, so the"));
    EXPECT_THAT(black.json()["frames"][0]["warning"].get<std::string>(), HasSubstr("is black"));
    EXPECT_THAT(black.err, HasSubstr("or place more lights with --lights"));
    // Where lights were placed, the remedy is not the option that was given.
    const Arguments into{"--camera", "0,100,0,0,200,0.01", "--lights", "32"}; // the sky
    const std::string remedy = "; give another --camera, as in --camera auto\n";
    expectRefused(directory, {{Arguments{"validate", dark} + into + tiny, 2,
                               "so there is nothing to compare" + remedy},
                              {Arguments{"compare", dark, "-o", directory / "report", "--no-charts",
                                         "--methods", "embree,dag"} +
                                   into + tiny,
                               2, "so there is nothing to compare" + remedy}});
    const ProgramResult sky = runShadowdag(
        directory, Arguments{"render", dark, "-o", directory / "b.png", "--json"} + into + tiny);
    EXPECT_THAT(sky.err, HasSubstr("so the picture is black" + remedy));
    // An automatic camera would see no more.
    expectRefused(directory, {{Arguments{"validate", dark, "--camera", "auto"} + tiny, 2,
                               "or give a place that a light reaches and a point to look at, "
                               "as in --camera px,py,pz,tx,ty,tz\n"}});
    const Arguments fit = {"fit",         "-o",       directory / "f.json",
                           "--no-charts", "--max",    "1",
                           "--methods",   "dag",      "--minimise",
                           "bytes",       "--json",   "--believe",
                           "all",         "--frames", "0"};
    expectRefused(directory, {{fit + Arguments{dark} + tiny, 2, "no light reaches"}});
    const ProgramResult fitted =
        runShadowdag(directory, fit + Arguments{"builtin:fail-contact"} + tiny);
    EXPECT_EQ(fitted.status, 0) << fitted.err;
    EXPECT_THAT(fitted.err, HasSubstr("warning: builtin:fail-contact, frame 0: has only "));
    const ProgramResult study =
        runShadowdag(directory, {"study", "failures", dark, "--only", "contact", "-o",
                                 directory / "study", "--json"});
    EXPECT_THAT(study.err, HasSubstr("has no pair of a visible point and a light"));
    EXPECT_EQ(study.status, 5) << "nothing was judged";
}

TEST(Program, AnInterruptEndsLongWorkSoonAndNothingIsWritten) {
    const TemporaryDirectory directory;
    const std::string exr = directory / "a.exr", json = directory / "f.json";
    const Arguments large{"--size", "3840x2160"};
    for (const Arguments& arguments :
         {Arguments{"render", "builtin:atrium", "-o", exr, "--method", "maps"} + large,
          Arguments{"validate", "builtin:atrium", "--method", "maps"} + large,
          Arguments{"fit", "builtin:atrium", "-o", json, "--no-charts", "--methods", "maps"} +
              large}) {
        const pid_t child =
            startProgram(directory, arguments, directory / "out", directory / "err");
        std::this_thread::sleep_for(std::chrono::seconds(2));
        const int signal = arguments[0] == "render" ? SIGXCPU : SIGTERM;
        const test::EndBySignal end = test::endBySignal(child, signal);
        EXPECT_EQ(end.status, 128 + signal) << arguments[0];
        EXPECT_LT(end.seconds, 0.5) << arguments[0] << ": " << end;
        EXPECT_THAT(readText(directory / "err"), HasSubstr("interrupted")) << arguments[0];
        EXPECT_FALSE(std::filesystem::exists(exr) || std::filesystem::exists(json));
    }
}

TEST(Program, MoreThreadsThanCoresAreAWarning) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"info", "builtin:fail-acne", "--threads", "4096"});
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("warning: --threads '4096': this machine has "));
    EXPECT_THAT(runShadowdag(directory, {"info", "builtin:fail-acne", "--threads", "1"}).err,
                testing::Not(HasSubstr("warning")));
}

TEST(Program, ResultsNameWhatReproducesThem) {
    const TemporaryDirectory directory;
    const Arguments small{"builtin:fail-acne", "--size", "48x27", "--method", "maps", "--json"};
    const Json validated = runShadowdag(directory, Arguments{"validate"} + small).json(),
               rendered =
                   runShadowdag(directory, Arguments{"render", "-o", directory / "a.exr"} + small)
                       .json();
    for (const Json& json : {validated, rendered}) {
        for (const char* key : {"scene", "scene_hash", "method", "parameters", "light_count"})
            EXPECT_TRUE(json.contains(key)) << key;
        EXPECT_EQ(json["experiment"]["size"], "48x27");
        for (const char* key : {"thread_count", "system", "processor_count", "memory_bytes"})
            EXPECT_TRUE(json["provenance"].contains(key)) << key;
    }
    EXPECT_EQ(rendered["frames"][0]["camera_numbers"], validated["camera_numbers"]);
    const std::string exr = readText(directory / "a.exr");
    for (const char* key : {"scene_hash", "camera_numbers", "experiment", "provenance"})
        EXPECT_THAT(exr, HasSubstr(std::string(key) + '\0' + "string"));
    // The camera's numbers give the same frame.
    const ProgramResult again = runShadowdag(
        directory, Arguments{"validate"} + small +
                       Arguments{"--camera", validated["camera_numbers"].get<std::string>()});
    ASSERT_EQ(again.status, 0) << again.err;
    EXPECT_NEAR(again.json()["pair_count"].get<double>(), validated["pair_count"].get<double>(),
                0.01 * validated["pair_count"].get<double>());
}

TEST(Program, TheExperimentOfAFrameNamesWhatRan) {
    const TemporaryDirectory directory;
    const Arguments small{"builtin:fail-acne", "--size", "48x27", "--json"};
    const Json none = Json::array();
    struct Case {
        Arguments method;
        Json methods, models, variants;
    };
    for (const Case& of : {Case{{"--method", "maps"}, {"maps"}, none, none},
                           Case{{}, {"hybrid"}, {"texels:96"}, none},
                           Case{{"--model", "oracle"}, {"hybrid"}, {"oracle"}, none},
                           Case{{"--method", "truth"}, none, none, none},
                           Case{{"--variant", "CFM"}, none, none, {"CFM"}}}) {
        SCOPED_TRACE(Json(of.method).dump());
        const ProgramResult result = runShadowdag(
            directory, Arguments{"render", "-o", directory / "a.exr"} + small + of.method);
        ASSERT_EQ(result.status, 0) << result.err;
        const Json experiment = result.json()["experiment"];
        EXPECT_EQ(experiment["methods"], of.methods);
        EXPECT_EQ(experiment["thresholds"], none);
        EXPECT_EQ(experiment["models"], of.models);
        EXPECT_EQ(experiment["variants"], of.variants);
        EXPECT_THAT(readText(directory / "a.exr"),
                    HasSubstr("\"methods\":" + of.methods.dump() + ","));
    }
    // Compare runs it again.
    const Json validated =
        runShadowdag(directory, Arguments{"validate", "--method", "maps"} + small).json();
    EXPECT_EQ(validated["experiment"]["methods"], Json{"maps"});
    writeText(directory / "e.json", validated["experiment"].dump());
    const ProgramResult compared =
        runShadowdag(directory, {"compare", "--experiment", directory / "e.json", "-o",
                                 directory / "report", "--no-charts"});
    ASSERT_EQ(compared.status, 0) << compared.err;
    const Json runs = Json::parse(readText(directory / "report/results.json"))["runs"];
    ASSERT_EQ(runs.size(), 1u);
    for (const char* key : {"method", "pair_count", "false_shadow_count", "false_light_count"})
        EXPECT_EQ(runs[0][key], validated[key]) << key;
}

TEST(Program, AFullPoolIsReportedByRenderAndValidate) {
    const TemporaryDirectory directory;
    for (const Arguments& command :
         {Arguments{"render", kScene, "-o", directory / "a.png"}, Arguments{"validate", kScene}}) {
        const Arguments view = command + Arguments{"--method", "maps", "--size", "160x90"};
        const ProgramResult full = runShadowdag(directory, view + Arguments{"--pool", "1M"});
        ASSERT_EQ(full.status, 0) << full.err;
        EXPECT_THAT(full.out, HasSubstr("pool full: resolutions divided by ")) << command[0];
        EXPECT_THAT(full.out, HasSubstr("; enlarge it with --pool")) << command[0];
        const ProgramResult roomy = runShadowdag(directory, view + Arguments{"--pool", "1G"});
        ASSERT_EQ(roomy.status, 0) << roomy.err;
        EXPECT_THAT(roomy.out, testing::Not(HasSubstr("pool full"))) << command[0];
    }
}

TEST(Program, AnAssetOfAnotherSceneIsRefusedUnlessAllowed) {
    const TemporaryDirectory directory;
    const std::string dag = directory / "a.svdag";
    const Json scenes = runShadowdag(directory, {"scene", "--list", "--json"}).json()["scenes"];
    std::string other;
    for (const Json& scene : scenes)
        if (other.empty() && scene["name"].get<std::string>().starts_with("fail-"))
            other = "builtin:" + scene["name"].get<std::string>();
    if (other.empty())
        GTEST_SKIP() << "no failure scene in this build";
    ASSERT_EQ(runShadowdag(directory, {"voxelize", other, "-o", dag, "--resolution", "16"}).status,
              0);
    const Arguments render = {"render", kScene,     "-o", directory / "a.png", "--size",
                              "8x8",    "--voxels", dag,  "--believe",         "all"};
    const ProgramResult refused = runShadowdag(directory, render);
    EXPECT_EQ(refused.status, 2);
    EXPECT_THAT(refused.err, HasSubstr("--allow-stale"));
    const ProgramResult allowed = runShadowdag(directory, render + Arguments{"--allow-stale"});
    EXPECT_EQ(allowed.status, 0) << allowed.err;
    EXPECT_THAT(allowed.err, HasSubstr("used nevertheless"));
}

} // namespace shadowdag
