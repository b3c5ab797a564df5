// SPDX-License-Identifier: Apache-2.0
#include "python/scene_object.h"

#include "cuda/parallel_for.h"
#include "python/arrays.h"
#include "python/dag_object.h"
#include "python/errors.h"
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"

#include <bit>

namespace shadowdag::python {

namespace {

WorkspaceOptions optionsOf(Backend backend, const std::string& cache) {
    WorkspaceOptions options;
    options.backend = backend;
    options.console = &pythonConsole();
    if (!cache.empty())
        options.voxels = VoxelSource{{}, cache, false};
    return options;
}

std::shared_ptr<SceneObject> load(const py::object& file, int64_t lights, uint64_t lightSeed,
                                  const std::string& backend, const py::object& cacheDirectory,
                                  const py::object& progress) {
    const std::string scene = pathOf(file), cache = pathOf(cacheDirectory);
    const int lightCount = placedLightCount("lights", lights);
    Call call("read " + scene, progress);
    return call.run([&] {
        const Backend chosen = backendOf(backend);
        auto object = std::make_shared<SceneObject>(
            loadSceneAndWorld(scene, lightCount, lightSeed, false, pythonConsole()), chosen, cache);
        object->lightCount = lightCount;
        object->lightSeed = lightSeed;
        return object;
    });
}

std::shared_ptr<DagObject> voxelizeScene(const std::shared_ptr<SceneObject>& self,
                                         uint32_t resolution, const py::object& progress) {
    const uint32_t log2 = parsePowerOfTwo("resolution", std::to_string(resolution), 4, 131072);
    Call call("voxelize " + self->scene().name, progress);
    return runAlone(*self, call, [&] {
        const Dag& dag = self->workspace.dag(log2);
        return std::make_shared<DagObject>(std::shared_ptr<const Dag>(self, &dag),
                                           assetProvenance(self->scene()));
    });
}

py::array_t<bool> occludedByTriangles(SceneObject& self, const py::array& start,
                                      const py::array& end, const py::object& out,
                                      const py::object& progress) {
    const PointsOf from(start, "start"), to(end, "end");
    const size_t count = segmentCount(from, to);
    py::array_t<bool> result = resultOf(out, count);
    bool* const blocked = result.mutable_data();
    Call call("trace segments", progress);
    runAlone(self, call, [&] {
        for (size_t i = 0; i < from.count(); ++i) // others may end the process: Embree asserts
            requireWithinReach(glm::dvec3(from[i]), "start", i);
        for (size_t i = 0; i < to.count(); ++i)
            requireWithinReach(glm::dvec3(to[i]), "end", i);
        const Truth& truth = self.workspace.truth();
        cpuParallelRanges(count, 256, [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i)
                blocked[i] = truth.isBlocked(from[i], to[i]);
        });
    });
    return result;
}

/// Returns what read() copies from a scene, while no call of another thread works with it.
template <class F> auto readAlone(SceneObject& self, const char* what, F&& read) {
    if (self.worker.load() == std::this_thread::get_id()) // a cost model or a progress function
        return read();
    Call call(what, py::none());
    return runAlone(self, call, read);
}

py::dict lightsOf(SceneObject& self) {
    const std::vector<Light> lights =
        readAlone(self, "read lights", [&] { return self.world().lights(); });
    const auto count = py::ssize_t(lights.size());
    py::array_t<float> position({count, py::ssize_t(3)}), direction({count, py::ssize_t(3)}),
        intensity({count, py::ssize_t(3)}), range(count), inner(count), outer(count);
    py::array_t<uint32_t> kind(count);
    for (py::ssize_t i = 0; i < count; ++i) {
        const Light& light = lights[size_t(i)];
        for (int a = 0; a < 3; ++a) {
            position.mutable_at(i, a) = light.positionWorld[a];
            direction.mutable_at(i, a) = light.directionWorld[a];
            intensity.mutable_at(i, a) = light.intensity[a];
        }
        range.mutable_at(i) = light.rangeWorld;
        inner.mutable_at(i) = light.cosInner;
        outer.mutable_at(i) = light.cosOuter;
        kind.mutable_at(i) = uint32_t(light.kind);
    }
    py::dict dict;
    dict["position"] = position;
    dict["direction"] = direction;
    dict["intensity"] = intensity;
    dict["range"] = range;
    dict["kind"] = kind;
    dict["cos_inner"] = inner;
    dict["cos_outer"] = outer;
    return dict;
}

py::dict camerasOf(SceneObject& self) {
    std::vector<Camera> cameras;
    const std::vector<std::string> names = readAlone(self, "read cameras", [&] {
        cameras = self.world().cameras();
        return cameraNames(self.world());
    });
    py::dict dict;
    for (size_t i = 0; i < names.size(); ++i)
        dict[textObject(names[i])] = cameraText(cameras[i]);
    return dict;
}

py::tuple boundsOf(SceneObject& self) {
    const Box box = readAlone(self, "read bounds", [&] { return self.world().boundsWorld(); });
    return py::make_tuple(py::make_tuple(box.min.x, box.min.y, box.min.z),
                          py::make_tuple(box.max.x, box.max.y, box.max.z));
}

} // namespace

SceneObject::SceneObject(LoadedScene loaded, Backend backend, const std::string& cache)
    : workspace(std::move(loaded), optionsOf(backend, cache)),
      judge(workspace, 1, ErrorOptions{}.nullSampleCount) {}

int placedLightCount(const char* argument, int64_t count) {
    return int(parseInteger(argument, std::to_string(count), -1, kMaxPlacedLightCount));
}

Backend backendOf(const std::string& name) {
    if (name == "gl")
        throw Error(ErrorKind::kUsage, "backend 'gl': frames by OpenGL are the program's; use "
                                       "auto, cpu or cuda");
    return chooseBackend(name);
}

void addScene(py::module_& scope) {
    using Object = std::shared_ptr<SceneObject>;
    py::class_<SceneObject, Object>(
        scope, "Scene",
        "A scene with its lights, voxels, renderers and truth, each made at first use. One call at "
        "a time works with a scene; calls of other threads wait.")
        .def_property_readonly(
            "name", [](const SceneObject& self) { return textObject(self.scene().name); },
            "Its name in results.")
        .def_property_readonly(
            "argument", [](const SceneObject& self) { return textObject(self.scene().argument); },
            "As it was loaded: what the program takes as SCENE.")
        .def_property_readonly(
            "hash", [](const SceneObject& self) { return self.scene().geometryHash; },
            "Hash of its static triangles, 32 hex digits.")
        .def_property_readonly(
            "duration",
            [](const SceneObject& self) { return self.world().scene().durationSeconds(); },
            "Seconds of its animations; 0 without.")
        .def_property_readonly(
            "vertices",
            [](const Object& self) {
                const View<const glm::vec3> positions = self->world().triangles().positions;
                return arrayOver3(positions.data, positions.count, self);
            },
            "World positions, float32, (n, 3), read-only, without a copy: those of the time of the "
            "last frame.")
        .def_property_readonly(
            "triangles",
            [](const Object& self) {
                const View<const glm::uvec3> triangles = self->world().triangles().triangles;
                return arrayOver3(triangles.data, triangles.count, self);
            },
            "Corners of the triangles, uint32, (m, 3), indices into vertices; read-only, without a "
            "copy.")
        .def_property_readonly(
            "lights", &lightsOf,
            "Copies of the lights' arrays: position and direction (n, 3), world "
            "units; intensity (n, 3), candela, lux of directional lights; range, "
            "world units; kind, 0 point, 1 spot, 2 directional; cos_inner, "
            "cos_outer of spots.")
        .def_property_readonly("cameras", &camerasOf,
                               "Names of the cameras and their numbers as the setting camera takes "
                               "them.")
        .def_property_readonly("bounds", &boundsOf,
                               "Least and greatest corner of all triangles, world units.")
        .def("voxelize", &voxelizeScene, py::arg("resolution") = 1024,
             py::arg("progress") = py::none(),
             "Returns the Dag of the static triangles in a cube of resolution^3 voxels, a power of "
             "two from 4 to 131072; kept by the scene, whose frames use it. Raises UsageError for "
             "another resolution, ResourceError where memory is short.")
        .def("occluded", &occludedByTriangles, py::arg("start"), py::arg("end"),
             py::arg("out") = py::none(), py::arg("progress") = py::none(),
             "Returns for each segment whether a triangle crosses it strictly between its ends, "
             "by Embree: bool, (n,). Arguments as Dag.occluded has them; UsageError names the row "
             "of a coordinate that is not finite or beyond 1e9.");
    scope.def("load", &load, py::arg("scene"), py::arg("lights") = -1, py::arg("light_seed") = 1,
              py::arg("backend") = "auto", py::arg("cache") = "", py::arg("progress") = py::none(),
              "Returns the Scene of a .glb or .gltf file, one that Assimp reads, or "
              "builtin:NAME.\n\nscene, cache: str or os.PathLike.\nlights: replaces "
              "all lights by this many, placed by light_seed; -1: its own.\nbackend: auto, cpu or "
              "cuda.\ncache: directory of built assets; '': voxels are kept in memory alone.\n"
              "Raises UsageError for an unknown built-in scene or backend, InputError for a file "
              "that is not a scene, DeviceError for cuda without a device.");
    scope.def("scene_of_arrays", &sceneOfArrays, py::arg("arrays"), py::arg("name"),
              py::arg("lights") = -1, py::arg("light_seed") = 1, py::arg("backend") = "auto",
              py::arg("cache") = "", "See shadowdag.scene.");
    scope.def(
        "builtin_scenes",
        [] {
            py::dict scenes;
            for (const BuiltinInfo& info : builtinScenes())
                scenes[py::str("builtin:" + info.name)] = info.description;
            return scenes;
        },
        "Returns the built-in scenes, each with a line of description.");
}

} // namespace shadowdag::python
