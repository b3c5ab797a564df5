// SPDX-License-Identifier: Apache-2.0
// Shared by the generators of built-in scenes: placing meshes, lights and a camera path in a Scene,
// and the table of generators. Not used outside scenes/builtin*.cpp.
#pragma once

#include "scenes/mesh_shapes.h"
#include "scenes/scene.h"

#include <string>
#include <vector>

namespace shadowdag {

/// A Scene under construction. Meshes are stored once and placed by nodes.
class Stage {
public:
    explicit Stage(std::string name);
    /// Continues a scene.
    explicit Stage(Scene scene) : scene_(std::move(scene)) {}

    uint32_t material(const std::string& name, glm::vec3 baseColor,
                      glm::vec3 emission = glm::vec3(0));
    /// Stores the builder's mesh and returns its index; see place.
    int mesh(MeshBuilder& builder);
    /// Adds a node that carries a mesh; returns the node's index.
    int place(int mesh, glm::dvec3 offset = glm::dvec3(0), double yawTurns = 0.0,
              double scale = 1.0, int parent = kNone);
    /// Stores and places at the origin; does nothing for an empty builder.
    void placeOnce(MeshBuilder& builder);
    /// Adds a node without contents.
    int group(const std::string& name, glm::dvec3 offset = glm::dvec3(0), int parent = kNone);
    /// Adds a point light. `intensity` in candela.
    int pointLight(const std::string& name, glm::dvec3 position, double range, glm::vec3 color,
                   double intensity, int parent = kNone);
    /// Adds a directional light along `direction`, of any length; `illuminance` in lux.
    int directionalLight(const std::string& name, glm::dvec3 direction, glm::vec3 color,
                         double illuminance, int parent = kNone);
    /// Adds the camera node "camera"; without a path it stays there.
    void camera(glm::dvec3 eye, glm::dvec3 target, double yfov = 0.9, double znear = 0.05,
                double zfar = 500.0);

    /// A place on a camera path.
    struct Waypoint {
        double timeSeconds;
        glm::dvec3 eye, target;
    };
    /// Adds the camera "camera" and flies it along a Catmull-Rom curve through the waypoints (times
    /// ascending, first 0), sampled every quarter second as linear keys.
    void cameraPath(const std::vector<Waypoint>& waypoints, double yfov = 0.9, double znear = 0.05,
                    double zfar = 500.0);
    /// Adds a translation channel with linear keys to a node.
    void animateTranslation(int node, const std::vector<float>& times,
                            const std::vector<glm::dvec3>& keys);
    /// Adds a channel that turns a node about +Y once in `periodSeconds`, from time 0 to
    /// `untilSeconds`.
    void animateYaw(int node, double periodSeconds, double untilSeconds, double startTurns = 0.0);

    Scene& scene() { return scene_; }
    Scene take() { return std::move(scene_); }

private:
    int addNode(Node node);
    void addMover(AnimationChannel channel);

    Scene scene_;
};

Scene makeAtrium();
Scene makeHouses();
Scene makeHousesByDay();
Scene makeNecropolis();

} // namespace shadowdag
