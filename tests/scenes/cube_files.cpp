// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/cube_files.h"

namespace shadowdag::test {

namespace {

constexpr int kTriangles[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                   {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                   {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

/// Returns a coordinate of a corner: "0" or the scale.
std::string coordinate(int corner, int axis, const std::string& scale) {
    return (corner >> axis & 1) != 0 ? scale : "0";
}

/// Returns "x y z" of a corner.
std::string cornerText(int corner, const std::string& scale, const std::string& between = " ") {
    return coordinate(corner, 0, scale) + between + coordinate(corner, 1, scale) + between +
           coordinate(corner, 2, scale);
}

template <class T> std::string bytesOf(const T& value) {
    return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string cornerBytes(int corner, float scale) {
    std::string bytes;
    for (int axis = 0; axis < 3; ++axis)
        bytes += bytesOf((corner >> axis & 1) != 0 ? scale : 0.0f);
    return bytes;
}

std::string plyHeader(const std::string& format) {
    return "ply\nformat " + format +
           " 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string textPly(const std::string& scale) {
    std::string text = plyHeader("ascii");
    for (int c = 0; c < 8; ++c)
        text += cornerText(c, scale) + "\n";
    for (const auto& t : kTriangles)
        text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " +
                std::to_string(t[2]) + "\n";
    return text;
}

std::string binaryPly(float scale) {
    std::string bytes = plyHeader("binary_little_endian");
    for (int c = 0; c < 8; ++c)
        bytes += cornerBytes(c, scale);
    for (const auto& t : kTriangles)
        bytes += bytesOf(uint8_t(3)) + bytesOf(t);
    return bytes;
}

std::string textStl(const std::string& scale) {
    std::string text = "solid cube\n";
    for (const auto& t : kTriangles) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int corner : t)
            text += "vertex " + cornerText(corner, scale) + "\n";
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid cube\n";
}

std::string binaryStl(float scale) {
    std::string bytes(80, ' ');
    bytes += bytesOf(uint32_t(12));
    for (const auto& t : kTriangles) {
        bytes += std::string(12, '\0');
        for (const int corner : t)
            bytes += cornerBytes(corner, scale);
        bytes += std::string(2, '\0');
    }
    return bytes;
}

} // namespace

GltfParts cubeGltf() {
    GltfParts parts;
    for (int c = 0; c < 8; ++c)
        parts.binary += cornerBytes(c, 1.0f);
    for (const auto& t : kTriangles)
        parts.append<uint32_t>({uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
    parts.members = {
        {"asset", R"({"version":"2.0"})"},
        {"buffers", R"([{"byteLength":240}])"},
        {"bufferViews",
         R"([{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":144}])"},
        {"accessors", R"([{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"},)"
                      R"({"bufferView":1,"componentType":5125,"count":36,"type":"SCALAR"}])"},
        {"meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}])"},
        {"nodes", R"([{"mesh":0}])"},
        {"scenes", R"([{"nodes":[0]}])"},
    };
    return parts;
}

std::vector<CubeFile> cubeFiles(const std::string& scale) {
    const float number = std::stof(scale);
    return {{".obj", cubeObj(scale)},    {".ply", textPly(scale)},    {".ply", binaryPly(number)},
            {".stl", textStl(scale)},    {".stl", binaryStl(number)}, {".fbx", cubeFbx(scale)},
            {".dae", cubeCollada(scale)}};
}

std::string cubeObj(const std::string& scale) {
    std::string text;
    for (int c = 0; c < 8; ++c)
        text += "v " + cornerText(c, scale) + "\n";
    for (const auto& t : kTriangles)
        text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " +
                std::to_string(t[2] + 1) + "\n";
    return text;
}

std::string cubeFbx(const std::string& scale, const std::string& unit, int upAxis,
                    const std::string& objects, const std::string& connections) {
    std::string corners, indices;
    for (int c = 0; c < 8; ++c)
        corners += (c ? "," : "") + cornerText(c, scale, ",");
    for (const auto& t : kTriangles)
        indices += (indices.empty() ? "" : ",") + std::to_string(t[0]) + "," +
                   std::to_string(t[1]) + "," + std::to_string(-1 - t[2]); // ends a polygon
    const auto whole = [](const std::string& name, int value) {
        return "    P: \"" + name + "\", \"int\", \"Integer\", \"\"," + std::to_string(value) +
               "\n";
    };
    return "; FBX 7.3.0 project file\n"
           "FBXHeaderExtension:  {\n  FBXHeaderVersion: 1003\n  FBXVersion: 7300\n}\n"
           "GlobalSettings:  {\n  Version: 1000\n  Properties70:  {\n" +
           whole("UpAxis", upAxis) + whole("UpAxisSign", 1) + whole("FrontAxis", 3 - upAxis) +
           whole("FrontAxisSign", upAxis == 1 ? 1 : -1) + whole("CoordAxis", 0) +
           whole("CoordAxisSign", 1) + "    P: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," +
           unit +
           "\n  }\n}\n"
           "Objects:  {\n"
           "  Geometry: 1000, \"Geometry::cube\", \"Mesh\" {\n"
           "    Vertices: *24 {\n      a: " +
           corners + "\n    }\n    PolygonVertexIndex: *36 {\n      a: " + indices +
           "\n    }\n    GeometryVersion: 124\n  }\n"
           "  Model: 2000, \"Model::cube\", \"Mesh\" {\n    Version: 232\n  }\n" +
           objects +
           "}\n"
           "Connections:  {\n  C: \"OO\",2000,0\n  C: \"OO\",1000,2000\n" +
           connections + "}\n";
}

std::string cubeCollada(const std::string& scale, const std::string& asset,
                        const std::string& nodes, const std::string& libraries) {
    std::string corners, indices;
    for (int c = 0; c < 8; ++c)
        corners += cornerText(c, scale) + " ";
    for (const auto& t : kTriangles)
        for (const int corner : t)
            indices += std::to_string(corner) + " ";
    return R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>)" + asset +
           "</asset>" + libraries +
           R"(<library_geometries><geometry id="cube" name="cube"><mesh>
<source id="p"><float_array id="pa" count="24">)" +
           corners +
           R"(</float_array><technique_common><accessor source="#pa" count="8" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>)" +
           indices + R"(</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s">)" +
           nodes + R"(</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";
}

} // namespace shadowdag::test
