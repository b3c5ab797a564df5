// SPDX-License-Identifier: Apache-2.0
// The same cube as a file of each kind that the tests read: corners 0 and 1, twelve triangles in
// one order.
#pragma once

#include "tests/scenes/gltf_files.h"

#include <string>
#include <vector>

namespace shadowdag::test {

struct CubeFile {
    std::string extension;
    std::string content;
};

/// Returns the cube as glTF.
GltfParts cubeGltf();

/// Returns the cube as OBJ, PLY (text and binary), STL (text and binary), FBX and COLLADA.
/// @param scale of its corners
std::vector<CubeFile> cubeFiles(const std::string& scale = "1");

/// Returns lines of an OBJ file: its vertices and faces.
std::string cubeObj(const std::string& scale = "1");

/// Returns an FBX file of text.
/// @param unit in centimetres @param upAxis 1: y, 2: z
/// @param objects, connections further ones; 2000 is the node of the cube
std::string cubeFbx(const std::string& scale = "1", const std::string& unit = "100", int upAxis = 1,
                    const std::string& objects = "", const std::string& connections = "");

/// Returns a COLLADA file.
/// @param asset content of its element, such as the unit
/// @param nodes of the scene; "#cube" is the geometry
/// @param libraries further ones
std::string
cubeCollada(const std::string& scale = "1", const std::string& asset = "<up_axis>Y_UP</up_axis>",
            const std::string& nodes = R"(<node><instance_geometry url="#cube"/></node>)",
            const std::string& libraries = "");

} // namespace shadowdag::test
