// SPDX-License-Identifier: Apache-2.0
// Scenes of other kinds than glTF: the same cube in each, what files say of units, lights, cameras,
// materials and masks in closed form, and files that are hostile.
#include "scenes/scene_file.h"

#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/png_alpha.h"
#include "scenes/scene_folder.h"
#include "scenes/scene_kind.h"
#include "scenes/world.h"
#include "tests/scenes/cube_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stb_image_write.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

namespace shadowdag {
namespace {

using test::cubeCollada;
using test::cubeFbx;
using test::cubeObj;
using test::TemporaryFolder;
using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

class OtherScenes : public testing::Test {
protected:
    void SetUp() override {
        if (!readsOtherScenes())
            GTEST_SKIP() << "built without Assimp";
    }

    Scene read(const std::string& name, const std::string& content) const {
        Scene scene = readSceneFile(folder.write(name, content));
        test::expectSound(scene, name);
        return scene;
    }
    std::string messageOf(const std::string& name, const std::string& content) const {
        try {
            readSceneFile(folder.write(name, content));
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(), HasSubstr(name)) << "the file is not named";
            return error.what();
        }
        return "no error";
    }

    TemporaryFolder folder;
};

/// Returns the corners of all triangles in their order.
std::vector<glm::vec3> cornersOf(const Scene& scene) {
    const World world(scene, {});
    std::vector<glm::vec3> corners;
    for (size_t t = 0; t < world.triangles().count(); ++t)
        for (int c = 0; c < 3; ++c)
            corners.push_back(world.triangles().vertex(t, c));
    return corners;
}

void expectNear(const glm::vec3& found, const glm::vec3& expected, const std::string& what) {
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(found[axis], expected[axis], 1e-5f) << what << ", axis " << axis;
}

TEST_F(OtherScenes, ACubeOfEachKindHasTheTrianglesAndTheHashOfGltf) {
    const Scene expected = read("cube.glb", test::cubeGltf().glb());
    for (const test::CubeFile& file : test::cubeFiles()) {
        SCOPED_TRACE(file.extension);
        const Scene scene = read("cube" + file.extension, file.content);
        EXPECT_EQ(cornersOf(scene), cornersOf(expected));
        EXPECT_EQ(World(scene, {}).geometryHash(), World(expected, {}).geometryHash());
        ASSERT_EQ(scene.meshes.size(), 1u);
        EXPECT_EQ(scene.meshes[0].positions.size(), 8u) << "equal vertices are kept once";
        EXPECT_EQ(scene.name, "cube");
    }
}

// The kind is what the content says, if it says one.
TEST_F(OtherScenes, AKindIsKnownByItsContent) {
    for (const test::CubeFile& file : test::cubeFiles()) {
        const bool isNamed = file.content.starts_with("ply") || file.content.starts_with("; FBX") ||
                             file.content.starts_with("solid");
        EXPECT_TRUE(!isNamed || cornersOf(read("cube.bin", file.content)).size() == 36u)
            << file.extension;
    }
    EXPECT_EQ(cornersOf(read("CUBE.OBJ", cubeObj())).size(), 36u);
    EXPECT_TRUE(isSceneName("a/b.OBJ") && isSceneName("b.3ds") && isSceneName("b.glb"));
    EXPECT_FALSE(isSceneName("b.svdag") || isSceneName("b.txt") || isSceneName("b.mtl"));
}

TEST_F(OtherScenes, AFolderHasTheScenesOfEveryKindThatIsRead) {
    EXPECT_TRUE(scenesIn(folder.path("")).empty());
    for (const char* name : {"b.obj", "c.PLY", "a.fbx", "d.glb", "e.gltf", "f.dae", "g.stl"})
        folder.write(name, "");
    // What lies beside scenes, and a kind that is known but not read.
    for (const char* name : {"b.mtl", "e.bin", "a.png", "f.json", "f.html", "f.svg", "x.svdag",
                             "readme.txt", "x.usda", "x.zip", "glb", "x.xml", "x.raw"})
        folder.write(name, "");
    std::filesystem::create_directory(folder.path("h.glb"));
    std::vector<std::string> expected;
    for (const char* name : {"a.fbx", "b.obj", "c.PLY", "d.glb", "e.gltf", "f.dae", "g.stl"})
        expected.push_back(folder.path(name));
    EXPECT_EQ(scenesIn(folder.path("")), expected);
    EXPECT_THROW(scenesIn(folder.path("absent")), Error);
}

TEST_F(OtherScenes, PolygonsAreDividedIntoTriangles) {
    const Scene square = read("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
    EXPECT_EQ(cornersOf(square).size(), 6u);
    // An L: six corners, one of them reflex; the area of its triangles is its own.
    const Scene bent =
        read("a.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n");
    const std::vector<glm::vec3> corners = cornersOf(bent);
    float area = 0.0f;
    for (size_t i = 0; i < corners.size(); i += 3)
        area += 0.5f * glm::cross(corners[i + 1] - corners[i], corners[i + 2] - corners[i]).z;
    EXPECT_EQ(corners.size(), 12u);
    EXPECT_FLOAT_EQ(area, 3.0f);
    EXPECT_THAT(read("a.obj", cubeObj() + "l 1 2\n").warnings,
                Contains(HasSubstr("1 points or lines ignored")));
}

TEST_F(OtherScenes, UnitsAndAxesOfFbxBecomeMetresAndYUp) {
    EXPECT_EQ(World(read("a.fbx", cubeFbx("200", "1")), {}).boundsWorld().max, glm::vec3(2.0f));
    // y up is z there: (x, y, z) becomes (x, z, -y).
    const Box box = World(read("a.fbx", cubeFbx("1", "100", 2)), {}).boundsWorld();
    EXPECT_EQ(box.min, glm::vec3(0, 0, -1));
    EXPECT_EQ(box.max, glm::vec3(1, 1, 0));
    EXPECT_THAT(messageOf("a.fbx", cubeFbx("1", "100", 0)),
                HasSubstr("two of its axes are the same"));
}

std::string attribute(int id, const std::string& kind, const std::string& properties) {
    const std::string number = std::to_string(id), node = std::to_string(id + 1);
    return "  NodeAttribute: " + number + ", \"NodeAttribute::n" + number + "\", \"" + kind +
           "\" {\n    Properties70:  {\n" + properties + "    }\n    TypeFlags: \"" + kind +
           "\"\n  }\n  Model: " + node + ", \"Model::n" + number + "\", \"" + kind +
           "\" {\n    Version: 232\n    Properties70:  {\n"
           "      P: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",100,200,300\n    }\n  "
           "}\n";
}

std::string connected(int id) {
    const std::string number = std::to_string(id), node = std::to_string(id + 1);
    return "  C: \"OO\"," + node + ",0\n  C: \"OO\"," + number + "," + node + "\n";
}

// At (100, 200, 300) cm; lights of FBX shine along -y, cameras look along x.
TEST_F(OtherScenes, LightsAndCamerasOfFbxAreRead) {
    const auto number = [](const std::string& name, const std::string& value) {
        return "      P: \"" + name + "\", \"Number\", \"\", \"A\"," + value + "\n";
    };
    const std::string color = "      P: \"Color\", \"Color\", \"\", \"A\",1,0.5,0.25\n";
    std::string objects, connections;
    for (int kind = 0; kind < 3; ++kind) {
        objects += attribute(3000 + 10 * kind, "Light",
                             "      P: \"LightType\", \"enum\", \"\", \"\"," +
                                 std::to_string(kind) + "\n" + color + number("Intensity", "200") +
                                 number("InnerAngle", "30") + number("OuterAngle", "60"));
        connections += connected(3000 + 10 * kind);
    }
    objects += attribute(4000, "Camera",
                         number("FieldOfView", "90") + number("AspectWidth", "200") +
                             number("AspectHeight", "100") + number("NearPlane", "10") +
                             number("FarPlane", "5000"));
    connections += connected(4000);
    const Scene scene = read("a.fbx", cubeFbx("100", "1", 1, objects, connections));
    EXPECT_THAT(scene.warnings, Contains(HasSubstr("taken as candela")));
    const World world(scene, {});
    ASSERT_EQ(world.lights().size(), 3u);
    const Light::Kind kinds[] = {Light::kPoint, Light::kSun, Light::kSpot};
    for (size_t i = 0; i < 3; ++i) {
        SCOPED_TRACE(i);
        const Light& light = world.lights()[i];
        EXPECT_EQ(light.kind, kinds[i]);
        expectNear(light.intensity, {2, 1, 0.5}, "intensity");
        if (i != 1)
            expectNear(light.positionWorld, {1, 2, 3}, "position");
        if (i != 0)
            expectNear(light.directionWorld, {0, -1, 0}, "direction");
    }
    EXPECT_NEAR(world.lights()[2].cosInner, std::cos(glm::radians(15.0f)), 1e-5f);
    EXPECT_NEAR(world.lights()[2].cosOuter, std::cos(glm::radians(30.0f)), 1e-5f);
    ASSERT_EQ(world.cameras().size(), 1u);
    const Camera& camera = world.cameras()[0];
    expectNear(camera.positionWorld, {1, 2, 3}, "position");
    expectNear(camera.forward, {1, 0, 0}, "forward");
    expectNear(camera.up, {0, 1, 0}, "up");
    EXPECT_NEAR(camera.yfov, 2.0f * std::atan(0.5f), 1e-5f);
    EXPECT_NEAR(camera.znear, 0.1f, 1e-6f);
    EXPECT_NEAR(camera.zfar, 50.0f, 1e-4f);
}

// Units of half a metre, z up, one geometry in two nodes; lights of COLLADA shine along -z.
TEST_F(OtherScenes, NodesOfColladaShareTheirMeshAndPlaceLights) {
    const std::string nodes =
        R"(<node><translate>2 0 0</translate><instance_geometry url="#cube"/></node>
<node><translate>0 4 0</translate><node><scale>1 1 3</scale><instance_geometry url="#cube"/></node></node>
<node name="lamp"><translate>2 4 6</translate><instance_light url="#lamp"/></node>
<node name="sun"><instance_light url="#sun"/></node>)";
    const std::string lights = R"(<library_lights>
<light id="lamp"><technique_common><point><color>10 20 30</color></point></technique_common></light>
<light id="sun"><technique_common><directional><color>1 2 3</color></directional></technique_common></light>
</library_lights>)";
    const Scene scene = read(
        "a.dae", cubeCollada("1", R"(<unit meter="0.5"/><up_axis>Z_UP</up_axis>)", nodes, lights));
    EXPECT_EQ(scene.meshes.size(), 1u);
    const World world(scene, {});
    EXPECT_EQ(world.triangles().count(), 24u);
    EXPECT_EQ(world.instances().size(), 2u);
    expectNear(world.boundsWorld().min, {0, 0, -2.5}, "min");
    expectNear(world.boundsWorld().max, {1.5, 1.5, 0}, "max");
    ASSERT_EQ(world.lights().size(), 2u);
    expectNear(world.lights()[0].positionWorld, {1, 3, -2}, "position");
    expectNear(world.lights()[0].intensity, {10, 20, 30}, "intensity");
    EXPECT_EQ(world.lights()[1].kind, Light::kSun);
    expectNear(world.lights()[1].directionWorld, {0, -1, 0}, "direction");
}

/// A square with texture coordinates from (0, 0), below on the left, to (1, 1).
std::string board(const std::string& before = "mtllib a.mtl\nusemtl m\n") {
    return before + "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                    "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
}

std::string pngOf(int channelCount, const std::vector<uint8_t>& texels) {
    std::string bytes;
    stbi_write_png_to_func(
        [](void* out, void* data, int count) {
            static_cast<std::string*>(out)->append(static_cast<const char*>(data), size_t(count));
        },
        &bytes, 2, 2, channelCount, texels.data(), 2 * channelCount);
    return bytes;
}

std::string maskOf(const Scene& scene) {
    return test::maskOf(scene, scene.materials.size() - 1);
}

TEST_F(OtherScenes, MaterialsOfObjHaveTheirColours) {
    folder.write("a.mtl", "newmtl m\nKd 0.25 0.5 1\nKe 2 0 0\n");
    const Material& m = read("a.obj", board()).materials.back();
    EXPECT_EQ(m.name, "m");
    EXPECT_EQ(m.baseColor, glm::vec3(0.25f, 0.5f, 1.0f));
    EXPECT_EQ(m.emission, glm::vec3(2, 0, 0));
    folder.write("a b.png", pngOf(3, {0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 255}));
    folder.write("a.mtl", "newmtl m\nKe 3e38 0 0\n");
    EXPECT_THAT(messageOf("a.obj", board()), HasSubstr("a.obj: materials/1/extensions/"));
    folder.write("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd a b.png\n");
    const Scene shown = read("a.obj", board());
    EXPECT_EQ(shown.materials.back().baseColorTexture, 0);
    ASSERT_EQ(shown.meshes.at(0).uv.size(), 4u);
    EXPECT_EQ(shown.meshes[0].uv[0], glm::vec2(0, 1)) << "v points down here";
    EXPECT_EQ(shown.meshes[0].uv[2], glm::vec2(1, 0));
    folder.write("a.mtl", "newmtl m\nmap_Kd none.png\n");
    EXPECT_THAT(read("a.obj", board()).warnings, Contains(HasSubstr("no such file")));
    folder.write("a.mtl", "newmtl m\nmap_Kd \n");
    EXPECT_TRUE(read("a.obj", board()).warnings.empty()) << "a map without a name is none";
    std::filesystem::remove(folder.path("a.mtl"));
    EXPECT_THAT(read("a.obj", board()).warnings,
                Contains(StartsWith("Files that it names are missing: 'a.mtl'")));
    EXPECT_THAT(read("a.obj", board("mtllib none.mtl\nusemtl m\n")).warnings,
                Contains("Files that it names are missing: 'none.mtl' (no such file; put it beside "
                         "the file that names it)."));
}

TEST_F(OtherScenes, OpacityMapsCutMaterialsOut) {
    const std::string grey = pngOf(1, {255, 128, 127, 0}),
                      alpha = pngOf(4, {9, 9, 9, 255, 9, 9, 9, 0, 9, 9, 9, 128, 9, 9, 9, 127});
    folder.write("grey.png", grey);
    folder.write("alpha.png", alpha);
    folder.write("a.mtl", "newmtl m\nmap_d grey.png\n");
    EXPECT_EQ(maskOf(read("a.obj", board())), "##/..") << "luminance";
    folder.write("a.mtl", "newmtl m\nmap_d alpha.png\n");
    const Scene cut = read("a.obj", board());
    EXPECT_EQ(maskOf(cut), "#./#.") << "alpha";
    EXPECT_EQ(cut.meshes.at(0).uv.size(), 4u);
    EXPECT_TRUE(cut.warnings.empty()) << cut.warnings.front();
    folder.write("a.mtl", "newmtl m\nmap_Kd alpha.png\nmap_d alpha.png\n");
    EXPECT_EQ(maskOf(read("a.obj", board())), "#./#.");
    folder.write("a.mtl", "newmtl m\nmap_Kd grey.png\nmap_d grey.png\n");
    EXPECT_EQ(maskOf(read("a.obj", board())), "opaque") << "the colours are no opacity";
    folder.write("a.mtl", "newmtl m\nmap_Kd alpha.png\n");
    const Scene colours = read("a.obj", board());
    EXPECT_EQ(maskOf(colours), "opaque");
    EXPECT_THAT(colours.warnings, Contains(StartsWith("1 materials taken as opaque although")));
    folder.write("a.mtl", "newmtl m\nd 0.5\n");
    EXPECT_THAT(read("a.obj", board()).warnings, Contains(StartsWith("1 translucent materials")));
    folder.write("a.mtl", "newmtl m\nmap_d none.png\n");
    EXPECT_THAT(messageOf("a.obj", board()), HasSubstr("images/0 ('none.png'): no such file"));
}

TEST_F(OtherScenes, FilesOutsideTheFolderAreRefused) {
    const TemporaryFolder elsewhere;
    elsewhere.write("b.mtl", "newmtl m\nKd 0.25 0.5 1\n");
    std::filesystem::create_symlink(elsewhere.path("b.mtl"), folder.path("link.mtl"));
    const std::string relative =
        "../" + std::filesystem::path(elsewhere.path("")).parent_path().filename().string() +
        "/b.mtl";
    for (const std::string& name : {elsewhere.path("b.mtl"), relative, std::string("link.mtl")}) {
        const std::string text = board("mtllib " + name + "\nusemtl m\n");
        EXPECT_THAT(messageOf("a.obj", text), HasSubstr("is outside the file's folder")) << name;
        allowOutsideFiles(true);
        EXPECT_EQ(read("a.obj", text).materials.back().baseColor, glm::vec3(0.25f, 0.5f, 1.0f));
        allowOutsideFiles(false);
    }
    folder.write("a.mtl", "newmtl m\nmap_d ../leaf.png\n");
    EXPECT_THAT(messageOf("a.obj", board()), HasSubstr("is outside the file's folder"));
}

TEST_F(OtherScenes, CoordinatesAreWithinTheirLimit) {
    for (const char* coordinate : {"1e30", "-2e9"})
        for (const test::CubeFile& file : test::cubeFiles(coordinate)) {
            const std::string message = messageOf("cube" + file.extension, file.content);
            EXPECT_THAT(message, HasSubstr("not within 1e9 of the origin")) << file.extension;
            EXPECT_THAT(message, HasSubstr("mesh 0"));
        }
    EXPECT_THAT(messageOf("a.obj", "o wall\nv nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                HasSubstr("mesh 0 ('wall')"));
    EXPECT_EQ(cornersOf(read("a.obj", cubeObj("1e9"))).size(), 36u);
    const Scene far = read("a.fbx", cubeFbx("1", "1e30"));
    EXPECT_THROW(World(far, {}), Error);
}

// Refused, or read as a scene that is sound.
void expectRefusedOrSound(const TemporaryFolder& folder, const std::string& name,
                          const std::string& content) {
    try {
        const Scene scene = readSceneFile(folder.write(name, content));
        test::expectSound(scene, name);
        World(scene, {});
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
    }
}

TEST_F(OtherScenes, TruncatedAndDamagedFilesAreRefusedOrSound) {
    for (const test::CubeFile& file : test::cubeFiles()) {
        const size_t size = file.content.size();
        for (size_t length = 1; length < size; length += 1 + size / 10)
            expectRefusedOrSound(folder, "cube" + file.extension, file.content.substr(0, length));
        for (size_t at = 0; at < size; at += 1 + size / 10) {
            std::string damaged = file.content;
            damaged[at] = char(damaged[at] ^ (1 << at % 8));
            expectRefusedOrSound(folder, "cube" + file.extension, damaged);
        }
    }
}

TEST_F(OtherScenes, CountsThatNoFileHasAreRefusedInLittleMemoryAndTime) {
    const std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n"
                            "property float x\nproperty float y\nproperty float z\n"
                            "element face 4000000000\nproperty list uint int vertex_indices\n"
                            "end_header\n";
    EXPECT_NE(messageOf("a.ply", ply), "no error");
    EXPECT_THAT(messageOf("a.ply", ply.substr(0, 100)), HasSubstr("has no end_header"));
    EXPECT_NE(messageOf("a.ply", ply + std::string(100, '\xff')), "no error");
    std::string stl(80, ' ');
    stl += "\xff\xff\xff\x7f";
    EXPECT_NE(messageOf("a.stl", stl), "no error");
    EXPECT_NE(messageOf("a.obj", "f 1 2 3\n"), "no error");
    EXPECT_NE(messageOf("a.obj", "v 0 0 0\nf 1 2 4000000000\n"), "no error");
}

// Bones of other kinds than glTF pose nothing, which is said of each mesh by its name.
TEST_F(OtherScenes, MeshesWithBonesAreNamedInAWarning) {
    const std::string skin = R"(<library_controllers><controller id="c"><skin source="#cube">
<source id="j"><Name_array id="ja" count="1">bone</Name_array><technique_common>
<accessor source="#ja" count="1"><param name="JOINT" type="name"/></accessor></technique_common></source>
<source id="m"><float_array id="ma" count="16">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</float_array><technique_common>
<accessor source="#ma" count="1" stride="16"><param name="TRANSFORM" type="float4x4"/></accessor>
</technique_common></source>
<source id="w"><float_array id="wa" count="1">1</float_array><technique_common>
<accessor source="#wa" count="1"><param name="WEIGHT" type="float"/></accessor></technique_common></source>
<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#m"/></joints>
<vertex_weights count="8"><input semantic="JOINT" source="#j" offset="0"/>
<input semantic="WEIGHT" source="#w" offset="1"/><vcount>1 1 1 1 1 1 1 1</vcount>
<v>0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0</v></vertex_weights></skin></controller></library_controllers>)";
    const std::string nodes = R"(<node id="bone" sid="bone" name="bone" type="JOINT"/>
<node><instance_controller url="#c"><skeleton>#bone</skeleton></instance_controller></node>)";
    const Scene scene = read("a.dae", cubeCollada("1", "<up_axis>Y_UP</up_axis>", nodes, skin));
    EXPECT_EQ(cornersOf(scene).size(), 36u);
    EXPECT_THAT(scene.warnings, Contains(testing::AllOf(
                                    StartsWith("1 meshes with bones or morph targets stay in rest"),
                                    HasSubstr("mesh 0 ('cube"))));
}

TEST_F(OtherScenes, LoopsOfNodesAreRefused) {
    const std::string nodes =
        R"(<node id="n"><instance_geometry url="#cube"/><instance_node url="#n"/></node>)";
    EXPECT_NE(messageOf("a.dae", cubeCollada("1", "", nodes)), "no error");
    expectRefusedOrSound(folder, "a.fbx", cubeFbx("1", "100", 1, "", "  C: \"OO\",2000,2000\n"));
}

// A crash of Assimp ends the process that reads, and is a message here.
TEST_F(OtherScenes, ACrashOfAssimpIsAMessage) {
    constexpr int kDepth = 200'000; // of recursion, which takes more than the stack
    std::string nodes;
    for (int i = 0; i < 2 * kDepth; ++i)
        nodes += i < kDepth ? "<node>" : "</node>";
    EXPECT_THAT(messageOf("a.dae", cubeCollada("1", "", nodes)),
                HasSubstr("reading it by Assimp crashed"));
}

// In the process that reads, where the first free file is the last that the limit allows.
TEST_F(OtherScenes, ALimitOfOpenFilesIsNotBlamedOnTheFile) {
    folder.write("a.mtl", "newmtl m\n");
    const std::string path = folder.write("a.obj", board());
    const pid_t child = fork();
    if (child == 0) {
        constexpr struct rlimit kFour = {4, 4}; // files: the standard ones, of which one is free
        close_range(STDERR_FILENO + 1, ~0u, 0);
        close(STDIN_FILENO);
        setrlimit(RLIMIT_NOFILE, &kFour);
        try {
            readSceneFile(path);
        } catch (const Error& error) {
            std::fprintf(stderr, "%s\n", error.what());
            const std::string message = error.what();
            _exit(message.find("Too many open files") == std::string::npos ? 0 : int(error.kind()));
        }
        _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), int(ErrorKind::kResource));
}

TEST_F(OtherScenes, NamesThatAreNotTextDoNoHarm) {
    const Scene scene = read("a.obj", "o \xff\x1b[31m\"\\x\n" + cubeObj());
    EXPECT_EQ(cornersOf(scene).size(), 36u);
    EXPECT_THAT(messageOf("a.obj", "o \x1b[31m\nv nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                HasSubstr("\\x1b[31m"));
}

TEST_F(OtherScenes, WhatIsNoSceneIsRefused) {
    EXPECT_THAT(messageOf("a.obj", "a poem\n"), HasSubstr("assimp export FILE OUT.glb"));
    EXPECT_THAT(messageOf("a.txt", "a poem\n"), HasSubstr("neither JSON nor binary glTF"));
    EXPECT_THAT(messageOf("a.glb", "a poem\n"), HasSubstr("neither JSON nor binary glTF"));
    EXPECT_THAT(messageOf("a.mtl", "newmtl m\n"), HasSubstr("a material library"));
    EXPECT_THAT(messageOf("a.zip", "PK\3\4"), HasSubstr("a ZIP archive"));
    EXPECT_THAT(messageOf("a.blend", "BLENDER-v300"), HasSubstr("Blender"));
}

// The header of a binary STL file may hold anything.
TEST(SceneFile, AZeroByteDoesNotMakeABinaryFileUtf16) {
    const auto kindOf = [](const std::string& name, std::string content) {
        return otherKindOf(name, {content.begin(), content.end()}).value().name;
    };
    EXPECT_EQ(kindOf("a.stl", "A" + std::string(83, '\0')), "an STL file");
    EXPECT_EQ(kindOf("a.obj", std::string("{\0}\0", 4)), "") << "UTF-16";
    const TemporaryFolder folder;
    for (const auto& [content, message] :
         {std::pair("A" + std::string(83, '\0'), "neither JSON nor binary glTF"),
          {std::string("\0{\0}", 4), "is UTF-16; save it as UTF-8"}}) {
        try {
            readSceneFile(folder.write("a.bin", content));
            ADD_FAILURE() << message;
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr(message));
        }
    }
}

TEST(SceneFile, GltfIsReadAsByItsReader) {
    const TemporaryFolder folder;
    const std::string path = folder.write("a.glb", test::cubeGltf().glb());
    EXPECT_EQ(readSceneFile(path).meshes.at(0).positions, readGltf(path).meshes.at(0).positions);
    EXPECT_THROW(readSceneFile(folder.path("none.obj")), Error);
    EXPECT_THROW(readSceneFile(folder.write("empty.obj", "")), Error);
}

TEST(SceneFile, WithoutAssimpTheRefusalSaysSoAndHowToConvert) {
    if (readsOtherScenes())
        GTEST_SKIP() << "built with Assimp";
    const TemporaryFolder folder;
    for (const test::CubeFile& file : test::cubeFiles()) {
        try {
            readSceneFile(folder.write("cube" + file.extension, file.content));
            ADD_FAILURE() << file.extension;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(), HasSubstr("because it is without Assimp; convert it"));
        }
        EXPECT_TRUE(isSceneName("cube" + file.extension));
        EXPECT_FALSE(isReadSceneName("cube" + file.extension));
    }
}

} // namespace
} // namespace shadowdag
