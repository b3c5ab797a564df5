// SPDX-License-Identifier: Apache-2.0
// Scenes in Python: class Scene.
#pragma once

#include "python/call.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/workspace.h"

#include <pybind11/pybind11.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace shadowdag::python {

/// A scene with its workspace. One call at a time works with it; others wait.
struct SceneObject {
    /// @param cache directory of built assets; "": voxels are built in memory
    SceneObject(LoadedScene scene, Backend backend, const std::string& cache);

    const LoadedScene& scene() const { return workspace.scene(); }
    const World& world() const { return workspace.world(); }

    Workspace workspace;
    Judge judge;
    int lightCount = -1;     ///< placed lights, or -1: the scene's own
    uint64_t lightSeed = 1;  ///< of placed lights
    uint64_t frameCount = 0; ///< frames rendered so far: the last one's views are valid
    std::string judgedView;  ///< what the judge's truth belongs to
    std::string view;        ///< the camera of the workspace, as the setting names it
    /// What model oracle measured, by view and settings: once, so that its frames are alike.
    std::map<std::string, FrameCosts> costs;
    std::mutex mutex; ///< of all above
    std::atomic<std::thread::id> worker{};
};

/// Runs work on a scene without the interpreter's lock, alone. Throws Error kUsage when a cost
/// model or a progress function of the same scene's call asks for more of it.
template <class F> auto runAlone(SceneObject& scene, Call& call, F&& work) {
    if (scene.worker.load() == std::this_thread::get_id())
        throw Error(ErrorKind::kUsage,
                    "a cost model or a progress function may not render or judge frames of the "
                    "scene that is being rendered; use another Scene");
    return call.run([&] {
        const std::lock_guard lock(scene.mutex);
        struct Mark {
            std::atomic<std::thread::id>& worker;
            ~Mark() { worker = std::thread::id(); }
        } const mark{scene.worker};
        scene.worker = std::this_thread::get_id();
        return work();
    });
}

/// Adds class Scene, load(), builtin_scenes() and scene_of_arrays() to the scope.
void addScene(pybind11::module_& scope);

/// Returns a count of placed lights, -1 for none. Throws Error kUsage naming the argument where the
/// program's --lights would be refused.
int placedLightCount(const char* argument, int64_t count);

/// Returns a scene of arrays (scene_of_arrays.cpp).
std::shared_ptr<SceneObject> sceneOfArrays(const pybind11::dict& arrays, const std::string& name,
                                           int64_t placedLights, uint64_t lightSeed,
                                           const std::string& backend, const std::string& cache);

/// Returns the backend of a name for frames of the scope. Throws as chooseBackend, and Error
/// kUsage for gl.
Backend backendOf(const std::string& name);

} // namespace shadowdag::python
