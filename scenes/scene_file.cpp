// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene_file.h"

#include "scenes/gltf.h"
#include "scenes/scene_folder.h"
#include "scenes/scene_kind.h"

#if SDAG_WITH_ASSIMP
#include "scenes/assimp_reader.h"
#endif

namespace shadowdag {

bool readsOtherScenes() {
    return SDAG_WITH_ASSIMP != 0;
}

bool isSceneName(const std::string& path) {
    const std::string extension = lowerCaseExtension(path);
#if SDAG_WITH_ASSIMP
    if (isReadByAssimp(extension))
        return true;
#endif
    return isKnownScene(extension);
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
