// SPDX-License-Identifier: Apache-2.0
// Scenes of other kinds than glTF, read by Assimp where this build has it. Assimp checks little of
// what a file says and may crash, so it runs in a process of its own, which makes a binary glTF
// file in memory of what Assimp finds; that is read as any other, with every check.
#pragma once

#include "scenes/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// Returns whether Assimp has a reader for files of an extension, in lower case with its dot; false
/// for glTF, which is not its task here.
bool isReadByAssimp(const std::string& extension);

/// Reads a scene by Assimp. Its names, materials, lights and cameras, and how they are understood,
/// are in docs/scene_formats.md. The same file gives the same scene. Throws Error kInput naming the file,
/// the place and the value for anything broken or for what crashes Assimp or takes more than the
/// limits of a file of its size; kResource where no process can be started.
/// @param bytes the file's content @param extension of its kind, of which Assimp has a reader
Scene readByAssimp(const std::string& path, const std::vector<uint8_t>& bytes,
                   const std::string& extension);

} // namespace shadowdag
