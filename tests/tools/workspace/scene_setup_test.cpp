// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/scene_setup.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/camera_placement.h"
#include "tests/tools/temporary_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace shadowdag {

namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const Console kConsole(false);

LoadedScene moverScene() {
    return loadSceneAndWorld("builtin:fail-mover", -1, 1, true, kConsole);
}

/// Writes the scene's asset with a grid that is a voxel off.
void writeOtherGrid(const LoadedScene& scene, Dag dag, const std::string& path) {
    Asset asset;
    asset.provenance = assetProvenance(scene);
    asset.dag = std::move(dag);
    asset.dag.grid.originWorld.x += asset.dag.grid.voxelSizeWorld;
    writeAsset(asset, path);
}

ErrorKind kindOf(const std::function<void()>& call, std::string& message) {
    try {
        call();
    } catch (const Error& error) {
        message = error.what();
        return error.kind();
    }
    ADD_FAILURE() << "no error";
    return ErrorKind::kUsage;
}

} // namespace

TEST(CachedDag, ACacheThatCannotBeMadeIsReportedWithItsReason) {
    const TemporaryDirectory directory;
    const LoadedScene scene = moverScene();
    std::vector<std::string> notes;
    const Console console(
        Console::Listener{[&](const std::string& text) { notes.push_back(text); }, {}});
    std::filesystem::create_symlink("nowhere", directory / "link");
    std::filesystem::create_symlink("loop", directory / "loop");
    writeText(directory / "file", "");
    for (const auto& [cache, reason] :
         {std::pair{"link", "link: is a symbolic link that leads nowhere; "},
          std::pair{"loop", "loop: is a loop of symbolic links; "},
          std::pair{"file", "file: is not a directory; "},
          std::pair{"file/cache", "file' is a file, not a folder; "}}) {
        VoxelSource source;
        source.cacheDirectory = directory / cache;
        EXPECT_FALSE(cachedDag(scene, 5, source, console).empty());
        EXPECT_THAT(notes.back(), HasSubstr(reason));
        EXPECT_THAT(notes.back(), testing::EndsWith("; the asset is not stored"));
        EXPECT_THAT(notes.back(), testing::Not(HasSubstr("No such file")));
    }
}

TEST(SceneNames, DistinguishScenesOfOneFileName) {
    EXPECT_THAT(sceneNames({"a/x.gltf", "./b/x.gltf", "a/y.gltf", "builtin:atrium"}),
                ElementsAre("a/x.gltf", "b/x.gltf", "y.gltf", "builtin:atrium"));
    std::string message;
    EXPECT_EQ(kindOf([] { sceneNames({"a/x.gltf", "./a/x.gltf"}); }, message), ErrorKind::kUsage);
    EXPECT_THAT(message, HasSubstr("'./a/x.gltf' is given twice"));
}

TEST(FrameCamera, APlacedCameraStaysWhileObjectsMove) {
    const LoadedScene scene = moverScene();
    World& world = *scene.world;
    FrameCamera camera("auto");
    const Camera first = camera.at(world);
    bool wouldJump = false;
    for (const float time : {1.0f, 2.0f, 3.0f, 4.0f}) {
        world.setTime(time);
        EXPECT_EQ(camera.at(world).positionWorld, first.positionWorld);
        EXPECT_EQ(camera.at(world).forward, first.forward);
        const Camera anew = chooseCamera(world, "auto");
        wouldJump |= anew.positionWorld != first.positionWorld || anew.forward != first.forward;
    }
    EXPECT_TRUE(wouldJump) << "the scene shows nothing";
}

// A step of its own, which is shown once: named cameras and those that are placed take no time.
TEST(FrameCamera, ShowsHowFarTheViewIsPlaced) {
    const LoadedScene scene = moverScene();
    std::vector<std::string> steps;
    double last = 0;
    const Console console(Console::Listener{{}, [&](const std::string& what, double fraction) {
                                                if (steps.empty() || steps.back() != what)
                                                    steps.push_back(what);
                                                EXPECT_GE(fraction, last);
                                                last = fraction;
                                            }});
    FrameCamera camera("0,1,2,0,1,0");
    camera.at(*scene.world, &console);
    EXPECT_THAT(steps, ElementsAre());
    camera.use("auto");
    camera.at(*scene.world, &console);
    EXPECT_THAT(steps, ElementsAre("place the view in fail-mover"));
    EXPECT_EQ(last, 1.0);
    steps.clear();
    camera.at(*scene.world, &console);
    EXPECT_THAT(steps, ElementsAre());
}

TEST(FrameCamera, AutomaticOnesHaveNames) {
    const LoadedScene scene = loadSceneAndWorld("builtin:houses", -1, 1, true, kConsole);
    const World& world = *scene.world;
    const std::vector<Camera> placed = placeCameras(world, 3);
    ASSERT_EQ(placed.size(), 3u);
    FrameCamera camera("auto", 3);
    const char* const names[] = {"auto", "auto-2", "auto-3"};
    for (size_t i = 0; i < 3; ++i) {
        camera.use(names[i]);
        EXPECT_EQ(camera.at(world).positionWorld, placed[i].positionWorld) << names[i];
        EXPECT_EQ(camera.at(world).forward, placed[i].forward) << names[i];
        EXPECT_EQ(chooseCamera(world, names[i]).positionWorld, placed[i].positionWorld);
        EXPECT_NO_THROW(checkCamera(world, names[i]));
    }
    std::string message;
    for (const char* name : {"auto-0", "auto-17", "auto-x"}) {
        EXPECT_EQ(kindOf([&] { checkCamera(world, name); }, message), ErrorKind::kUsage) << name;
        EXPECT_THAT(message, HasSubstr("up to auto-16")) << name;
    }
}

// A light that reaches nothing leaves no view with light and shadow but the first.
TEST(FrameCamera, MoreViewsThanThereAreIsAnError) {
    Scene dark = makeBuiltin("fail-contact");
    for (LightSource& light : dark.lights)
        light.rangeWorld = 1e-3f;
    const LoadedScene scene = loadedScene(std::move(dark));
    EXPECT_NO_THROW(chooseCamera(*scene.world, "auto"));
    std::string message;
    EXPECT_EQ(kindOf([&] { chooseCamera(*scene.world, "auto-2"); }, message), ErrorKind::kUsage);
    EXPECT_THAT(message, HasSubstr("has only 1 automatic view"));
}

TEST(CameraAnimation, IsThatOfTheCamerasNodeOrOfOneAboveIt) {
    Scene scene = makeBuiltin("fail-contact");
    size_t node = 0;
    while (scene.nodes[node].camera == kNone)
        ++node;
    scene.animations.clear();
    const auto isAnimated = [&](const char* camera) {
        return isCameraAnimated(*loadedScene(Scene(scene)).world, camera);
    };
    EXPECT_FALSE(isAnimated(""));
    AnimationChannel channel;
    channel.times = {0, 1};
    channel.values = {{0, 0, 0, 0}, {1, 0, 0, 0}};
    channel.node = int(node == 0 ? 1 : 0); // something else
    scene.animations.push_back({"way", {channel}});
    EXPECT_FALSE(isAnimated(""));
    scene.animations[0].channels[0].node = int(node);
    EXPECT_TRUE(isAnimated(""));
    EXPECT_TRUE(isAnimated("camera"));
    EXPECT_FALSE(isAnimated("auto"));
    EXPECT_FALSE(isAnimated("0,0,5,0,0,0"));
    Node crane;
    crane.name = "crane";
    crane.children = {int(node)};
    scene.nodes.push_back(crane);
    scene.nodes[node].parent = int(scene.nodes.size()) - 1;
    std::replace(scene.roots.begin(), scene.roots.end(), int(node), int(scene.nodes.size()) - 1);
    scene.animations[0].channels[0].node = int(scene.nodes.size()) - 1;
    EXPECT_TRUE(isAnimated("")) << "a camera on a crane";
}

TEST(SceneGrid, IgnoresMovingGeometry) {
    const LoadedScene scene = moverScene();
    const VoxelGrid grid = sceneGrid(*scene.world, 5);
    scene.world->setTime(4);
    EXPECT_EQ(sceneGrid(*scene.world, 5), grid);
    EXPECT_EQ(grid, gridAround(scene.world->staticBoundsWorld(), 5));
}

TEST(CachedDag, AnotherGridIsRebuilt) {
    const TemporaryDirectory directory;
    const LoadedScene scene = moverScene();
    VoxelSource source;
    source.cacheDirectory = directory.path();
    Dag dag = cachedDag(scene, 5, source, kConsole);
    const VoxelGrid right = dag.grid;
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
        writeOtherGrid(scene, dag, entry.path().string());
    EXPECT_EQ(cachedDag(scene, 5, source, kConsole).grid, right);
}

TEST(GivenAsset, AnotherGridIsStale) {
    const TemporaryDirectory directory;
    const LoadedScene scene = moverScene();
    const std::string path = directory / "a.svdag";
    VoxelSource source;
    source.cacheDirectory = directory.path();
    writeOtherGrid(scene, cachedDag(scene, 5, source, kConsole), path);
    std::string message;
    EXPECT_EQ(kindOf([&] { readDagFor(scene, path, false, kConsole); }, message),
              ErrorKind::kInput);
    EXPECT_THAT(message, HasSubstr("--allow-stale"));
    EXPECT_NO_THROW(readDagFor(scene, path, true, kConsole));
}

TEST(GivenAsset, TwoOfOneResolutionAreRefused) {
    const TemporaryDirectory directory;
    const LoadedScene scene = moverScene();
    VoxelSource source;
    source.cacheDirectory = directory.path();
    Asset asset;
    asset.provenance = assetProvenance(scene);
    asset.dag = cachedDag(scene, 5, source, kConsole);
    source.assetPaths = {directory / "a.svdag", directory / "b.svdag"};
    for (const std::string& path : source.assetPaths)
        writeAsset(asset, path);
    std::string message;
    EXPECT_EQ(kindOf([&] { obtainDags(scene, {}, source, kConsole); }, message), ErrorKind::kUsage);
    EXPECT_THAT(message, HasSubstr("b.svdag"));
}

} // namespace shadowdag
