// SPDX-License-Identifier: Apache-2.0
// A scene from numpy arrays: one mesh, lights, cameras. shadowdag.scene (Python) brings arguments
// into the arrays that are read here.
#include "python/arrays.h"
#include "python/scene_object.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"

#include <algorithm>

namespace shadowdag::python {

namespace {

/// Returns an array of the dict as doubles, (count, columns).
py::array_t<double> table(const py::dict& arrays, const char* key, py::ssize_t columns) {
    const auto array =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(arrays[key]);
    if (!array) {
        PyErr_Clear();
        throw Error(ErrorKind::kUsage, std::string(key) + ": is not an array of numbers");
    }
    if (array.ndim() != 2 || array.shape(1) != columns)
        throw Error(ErrorKind::kUsage, std::string(key) + " has the shape " +
                                           std::string(py::str(array.attr("shape"))) +
                                           "; it must be (n, " + std::to_string(columns) + ")");
    return array;
}

/// Returns a node's matrix from its position and its axes, of unit length.
LocalTransform placed(const glm::vec3& position, const glm::vec3& right, const glm::vec3& up,
                      const glm::vec3& forward) {
    LocalTransform local;
    local.hasMatrix = true;
    local.matrix = glm::mat4(glm::vec4(right, 0), glm::vec4(up, 0), glm::vec4(-forward, 0),
                             glm::vec4(position, 1));
    return local;
}

void addNode(Scene& scene, Node node) {
    scene.roots.push_back(int(scene.nodes.size()));
    scene.nodes.push_back(std::move(node));
}

Mesh meshOf(const py::dict& arrays) {
    const auto vertices = table(arrays, "vertices", 3);
    const auto triangles = table(arrays, "triangles", 3);
    Mesh mesh;
    mesh.name = "mesh";
    mesh.positions.resize(size_t(vertices.shape(0)));
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        glm::dvec3 p;
        for (int a = 0; a < 3; ++a)
            p[a] = vertices.at(py::ssize_t(v), a);
        requireWithinReach(p, "vertices", v);
        mesh.positions[v] = glm::vec3(p);
    }
    mesh.triangles.resize(size_t(triangles.shape(0)));
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int corner = 0; corner < 3; ++corner) {
            const double index = triangles.at(py::ssize_t(t), corner);
            if (!(index >= 0 && index < double(mesh.positions.size())))
                throw Error(ErrorKind::kUsage,
                            "triangles: row " + std::to_string(t) + " names vertex " +
                                std::to_string(int64_t(index)) + ", but there are " +
                                std::to_string(mesh.positions.size()));
            mesh.triangles[t][corner] = uint32_t(index);
        }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    return mesh;
}

constexpr double kMaxIntensity = 1e30, kMaxRangeWorld = 1e18; ///< as in files

/// Adds lights: rows of position, direction, intensity, range, kind, inner and outer cone angle.
void addLights(Scene& scene, const py::dict& arrays) {
    const auto rows = table(arrays, "lights", 13);
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
        glm::dvec3 position, direction;
        LightSource light;
        light.name = "light " + std::to_string(i);
        const auto refuse = [&](const std::string& what) {
            throw Error(ErrorKind::kUsage, "lights: row " + std::to_string(i) + " has " + what);
        };
        for (int a = 0; a < 3; ++a) {
            position[a] = rows.at(i, a);
            direction[a] = rows.at(i, 3 + a);
            const double intensity = rows.at(i, 6 + a);
            if (!(intensity >= 0 && intensity <= kMaxIntensity))
                refuse("the intensity " + numberText(intensity) + "; it must be from 0 to 1e30");
            light.color[a] = float(intensity);
        }
        const double range = rows.at(i, 9), kind = rows.at(i, 10);
        if (!(range >= 0 && range <= kMaxRangeWorld))
            refuse("the range " + numberText(range) +
                   "; it must be from 0, for the default, to 1e18");
        if (!(kind == double(Light::kPoint) || kind == double(Light::kSpot) ||
              kind == double(Light::kSun)))
            refuse("the kind " + numberText(kind) +
                   "; it must be 0, a point light, 1, a spot, or 2, a directional one");
        light.rangeWorld = float(range);
        light.kind = Light::Kind(uint32_t(kind));
        const double inner = rows.at(i, 11), outer = rows.at(i, 12);
        if (light.kind == Light::kSpot &&
            !(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= 1.5708))
            refuse("cone angles " + numberText(inner) + " and " + numberText(outer) +
                   "; needed, in radians: 0 <= inner < outer <= pi / 2");
        light.innerConeAngle = float(inner);
        light.outerConeAngle = float(outer);
        const double length = glm::length(direction);
        if (!isWithinReach(position) || !(length > 0) || !std::isfinite(length))
            throw Error(ErrorKind::kUsage, "lights: row " + std::to_string(i) + " stands at " +
                                               pointText(position) + " and shines along " +
                                               pointText(direction) +
                                               "; both must be finite, and the direction not zero");
        const glm::vec3 forward(direction / length);
        const glm::vec3 aside =
            std::abs(forward.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
        const glm::vec3 right = glm::normalize(glm::cross(forward, aside));
        Node node;
        node.name = light.name;
        node.local = placed(glm::vec3(position), right, glm::cross(right, forward), forward);
        node.light = int(scene.lights.size());
        scene.lights.push_back(light);
        addNode(scene, std::move(node));
    }
}

void addCameras(Scene& scene, const py::dict& arrays) {
    for (const auto& [name, text] : py::dict(arrays["cameras"])) {
        const Camera camera = cameraFromText(py::str(text));
        CameraSource source;
        source.name = py::str(name);
        source.yfov = camera.yfov;
        source.znear = camera.znear;
        source.zfar = camera.zfar;
        Node node;
        node.name = source.name;
        node.local = placed(camera.positionWorld, camera.right(), camera.up, camera.forward);
        node.camera = int(scene.cameras.size());
        scene.cameras.push_back(source);
        addNode(scene, std::move(node));
    }
}

} // namespace

std::shared_ptr<SceneObject> sceneOfArrays(const py::dict& arrays, const std::string& name,
                                           int64_t placedLights, uint64_t lightSeed,
                                           const std::string& backend, const std::string& cache) {
    const int lightCount = placedLightCount("placed_lights", placedLights);
    Scene scene;
    scene.name = name;
    Material material;
    const auto color = table(arrays, "color", 3);
    for (int a = 0; a < 3; ++a) {
        if (!(color.at(0, a) >= 0 && color.at(0, a) <= 1))
            throw Error(ErrorKind::kUsage, "color holds " + numberText(color.at(0, a)) +
                                               "; it must be from 0 to 1, linear");
        material.baseColor[a] = float(color.at(0, a));
    }
    scene.materials.push_back(material);
    scene.meshes.push_back(meshOf(arrays));
    Node node;
    node.name = "mesh";
    node.mesh = 0;
    addNode(scene, std::move(node));
    addLights(scene, arrays);
    addCameras(scene, arrays);
    WorldOptions options;
    options.placedLightCount = lightCount;
    options.seed = lightSeed;
    Call call("place lights of " + name, py::none());
    return call.run([&] {
        auto object = std::make_shared<SceneObject>(loadedScene(std::move(scene), options),
                                                    backendOf(backend), cache);
        object->lightCount = lightCount;
        object->lightSeed = lightSeed;
        return object;
    });
}

} // namespace shadowdag::python
