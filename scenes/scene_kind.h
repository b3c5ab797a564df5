// SPDX-License-Identifier: Apache-2.0
// What kind of scene a file is, by how it begins or, if that says nothing, by its extension.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// The kind of a file that is not glTF.
struct SceneKind {
    std::string name;      ///< "an OBJ file"; "" where it is not known
    std::string extension; ///< by which other programs know the kind, in lower case
    bool isScene = false;  ///< other programs convert it to glTF
};

/// Returns the extension of a path in lower case, with its dot.
std::string lowerCaseExtension(const std::string& path);

/// Returns whether files of an extension are scenes of a kind that is known here.
bool isKnownScene(const std::string& extension);

/// Returns the kind of a file, or nothing where it begins as binary glTF or JSON does.
std::optional<SceneKind> otherKindOf(const std::string& path, const std::vector<uint8_t>& bytes);

/// Throws Error kInput for a kind that is not read: what it is, and how to convert it.
/// @param bytes the file's content @param why stands between the two
[[noreturn]] void refuseKind(const std::string& path, const SceneKind& kind,
                             const std::vector<uint8_t>& bytes, const std::string& why = "");

/// How a scene of another kind becomes glTF, for messages.
constexpr const char* kHowToConvert = "convert it: import it into Blender and export glTF 2.0, or "
                                      "assimp export FILE OUT.glb";

} // namespace shadowdag
