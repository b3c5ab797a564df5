// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene_file.h"

#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/scene_folder.h"
#include "scenes/scene_kind.h"

#if SDAG_WITH_ASSIMP
#include "scenes/assimp_reader.h"
#endif

#include <algorithm>
#include <filesystem>

namespace shadowdag {

bool readsOtherScenes() {
    return SDAG_WITH_ASSIMP != 0;
}

bool isReadSceneName(const std::string& path) {
    const std::string extension = lowerCaseExtension(path);
#if SDAG_WITH_ASSIMP
    if (isReadByAssimp(extension))
        return true;
#endif
    return extension == ".glb" || extension == ".gltf";
}

bool isSceneName(const std::string& path) {
    return isReadSceneName(path) || isKnownScene(lowerCaseExtension(path));
}

std::vector<std::string> scenesIn(const std::string& folder) {
    std::vector<std::string> found;
    std::error_code error;
    namespace fs = std::filesystem;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        std::error_code ignored; // a broken link is no file
        const std::string path = entry->path().string();
        // Assimp also reads kinds that are seldom scenes, as .xml.
        if (entry->is_regular_file(ignored) && isReadSceneName(path) &&
            isKnownScene(lowerCaseExtension(path)))
            found.push_back(path);
    }
    if (error)
        throw Error(ErrorKind::kInput,
                    folder + ": cannot be read: " + error.message() + "; check its permissions");
    std::sort(found.begin(), found.end());
    return found;
}

Scene readSceneFile(const std::string& path) {
    std::vector<uint8_t> bytes = readSceneBytes(path);
    const std::optional<SceneKind> other = otherKindOf(path, bytes);
    if (!other)
        return readGltf(path, {std::move(bytes), {}, {}});
#if SDAG_WITH_ASSIMP
    if (isReadByAssimp(other->extension))
        return readByAssimp(path, bytes, other->extension);
    refuseKind(path, *other, bytes);
#else
    refuseKind(path, *other, bytes,
               other->isScene ? ", which this build does not read, because it is without Assimp"
                              : "");
#endif
}

} // namespace shadowdag
