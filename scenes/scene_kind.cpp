// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene_kind.h"

#include "cuda/error.h"
#include "scenes/json_text.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <string_view>

namespace shadowdag {

namespace {

struct KnownKind {
    const char* name;
    const char* begin; // its first bytes; "": known by its extension
    const char* extension;
    bool isScene;
};

constexpr KnownKind kKnownKinds[] = {
    {"a PLY file", "ply\n", ".ply", true},
    {"a PLY file", "ply\r", ".ply", true},
    {"an FBX file", "Kaydara FBX Binary", ".fbx", true},
    {"an FBX file", "; FBX", ".fbx", true},
    {"an STL file", "solid ", ".stl", true},
    {"a Blender file", "BLENDER", ".blend", true},
    {"a USD file", "PXR-USDC", ".usdc", true},
    {"a USD file", "#usda", ".usda", true},
    {"an XML file, such as COLLADA", "<?xml", ".dae", true},
    {"an OBJ file", "", ".obj", true},
    {"an STL file", "", ".stl", true},
    {"a 3DS file", "", ".3ds", true},
    {"a material library; name the .obj file that uses it", "", ".mtl", false},
    {"a set of rays, which shadowdag rays reads", "SDAGRAYS", ".rays", false},
    {"a tracer's answers, which shadowdag rays --answer reads", "SDAGANSW", ".answers", false},
    {"a file of numpy arrays; shadowdag rays reads sets of rays and answers in such files", "",
     ".npz", false},
    {"a ZIP archive; unpack it and name the .glb or .gltf inside", "PK\3\4", ".zip", false},
    {"compressed by gzip; unpack it first", "\x1f\x8b", ".gz", false},
};

} // namespace

std::string lowerCaseExtension(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return extension;
}

bool isKnownScene(const std::string& extension) {
    return extension == ".glb" || extension == ".gltf" ||
           std::any_of(std::begin(kKnownKinds), std::end(kKnownKinds), [&](const KnownKind& kind) {
               return kind.isScene && extension == kind.extension;
           });
}

std::optional<SceneKind> otherKindOf(const std::string& path, const std::vector<uint8_t>& bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const size_t first = text.find_first_not_of("\xef\xbb\xbf \t\r\n"); // after a byte order mark
    const char begin = first == std::string_view::npos ? '\0' : text[first];
    if (!whyNoUtf8(text).empty())
        return SceneKind{"", lowerCaseExtension(path), false};
    if (text.starts_with("glTF") || begin == '{')
        return std::nullopt;
    if (begin == '[')
        return SceneKind{"a file that starts with a JSON list; a glTF file is a JSON object",
                         ".json", false};
    const std::string extension = lowerCaseExtension(path);
    for (const KnownKind& kind : kKnownKinds)
        if (*kind.begin != 0 ? text.starts_with(kind.begin) : extension == kind.extension) {
            // Several kinds are XML or ZIP, which the file's own extension tells apart.
            const std::string_view begins(kind.begin);
            const bool isShared = begins == "<?xml" || begins == "PK\3\4";
            return SceneKind{kind.name, isShared && !extension.empty() ? extension : kind.extension,
                             kind.isScene};
        }
    return SceneKind{"", extension, false};
}

void refuseKind(const std::string& path, const SceneKind& kind, const std::vector<uint8_t>& bytes,
                const std::string& why) {
    const std::string_view begin(reinterpret_cast<const char*>(bytes.data()),
                                 std::min<size_t>(bytes.size(), 4));
    if (const std::string utf = whyNoUtf8(begin); kind.name.empty() && !utf.empty())
        throw Error(ErrorKind::kInput, path + ": " + utf);
    if (kind.name.empty())
        throw Error(ErrorKind::kInput,
                    path + ": neither JSON nor binary glTF" + why +
                        "; name a .glb or .gltf file, or convert the scene to one in Blender");
    throw Error(ErrorKind::kInput, path + ": not glTF but " + kind.name + why +
                                       (kind.isScene ? std::string("; ") + kHowToConvert : ""));
}

} // namespace shadowdag
