// SPDX-License-Identifier: Apache-2.0
#include "scenes/builtin_stage.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

using glm::dvec3;

namespace {

/// Returns the rotation that turns -Z towards `target` with +Y as far up as can be; xyzw.
glm::dvec4 lookRotation(const dvec3& eye, const dvec3& target) {
    const dvec3 back = glm::normalize(eye - target);
    const dvec3 right = glm::normalize(glm::cross(dvec3(0, 1, 0), back));
    const dvec3 up = glm::cross(back, right);
    // Matrix to quaternion by its largest component, which keeps the root away from zero.
    const double m[3][3] = {
        {right.x, up.x, back.x}, {right.y, up.y, back.y}, {right.z, up.z, back.z}};
    const double trace[4] = {m[0][0] - m[1][1] - m[2][2], m[1][1] - m[0][0] - m[2][2],
                             m[2][2] - m[0][0] - m[1][1], m[0][0] + m[1][1] + m[2][2]};
    int largest = 3;
    for (int i = 0; i < 3; ++i)
        if (trace[i] > trace[largest])
            largest = i;
    const double root = 0.5 * std::sqrt(1.0 + trace[largest]);
    const double scale = 0.25 / root;
    glm::dvec4 q;
    if (largest == 3) {
        q = {(m[2][1] - m[1][2]) * scale, (m[0][2] - m[2][0]) * scale, (m[1][0] - m[0][1]) * scale,
             root};
    } else {
        const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
        q[i] = root;
        q[j] = (m[j][i] + m[i][j]) * scale;
        q[k] = (m[k][i] + m[i][k]) * scale;
        q[3] = (m[k][j] - m[j][k]) * scale;
    }
    return q;
}

glm::quat toQuat(const glm::dvec4& q) {
    return glm::quat(float(q.w), float(q.x), float(q.y), float(q.z));
}

dvec3 catmullRom(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d, double t) {
    return b +
           0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)));
}

} // namespace

Stage::Stage(std::string name) {
    scene_.name = std::move(name);
    material("default", glm::vec3(0.8f));
}

uint32_t Stage::material(const std::string& name, glm::vec3 baseColor, glm::vec3 emission) {
    scene_.materials.push_back({name, baseColor, emission});
    return uint32_t(scene_.materials.size() - 1);
}

int Stage::mesh(MeshBuilder& builder) {
    scene_.meshes.push_back(builder.take());
    return int(scene_.meshes.size()) - 1;
}

int Stage::addNode(Node node) {
    const int index = int(scene_.nodes.size());
    if (node.parent == kNone)
        scene_.roots.push_back(index);
    else
        scene_.nodes[size_t(node.parent)].children.push_back(index);
    scene_.nodes.push_back(std::move(node));
    return index;
}

int Stage::place(int mesh, dvec3 offset, double yawTurns, double scale, int parent) {
    Node node;
    node.name = scene_.meshes[size_t(mesh)].name;
    node.mesh = mesh;
    node.parent = parent;
    node.local.translation = glm::vec3(offset);
    node.local.rotation =
        glm::quat(float(cosTurns(yawTurns / 2)), 0.0f, float(sinTurns(yawTurns / 2)), 0.0f);
    node.local.scale = glm::vec3(float(scale));
    return addNode(std::move(node));
}

void Stage::placeOnce(MeshBuilder& builder) {
    if (builder.triangleCount() > 0)
        place(mesh(builder));
}

int Stage::group(const std::string& name, dvec3 offset, int parent) {
    Node node;
    node.name = name;
    node.parent = parent;
    node.local.translation = glm::vec3(offset);
    return addNode(std::move(node));
}

int Stage::pointLight(const std::string& name, dvec3 position, double range, glm::vec3 color,
                      double intensity, int parent) {
    LightSource light;
    light.name = name;
    light.color = color;
    light.intensity = float(intensity);
    light.rangeWorld = float(range);
    scene_.lights.push_back(light);
    Node node;
    node.name = name;
    node.parent = parent;
    node.light = int(scene_.lights.size()) - 1;
    node.local.translation = glm::vec3(position);
    return addNode(std::move(node));
}

int Stage::directionalLight(const std::string& name, dvec3 direction, glm::vec3 color,
                            double illuminance, int parent) {
    LightSource light;
    light.name = name;
    light.kind = Light::kSun;
    light.color = color;
    light.intensity = float(illuminance);
    scene_.lights.push_back(light);
    // The shortest turn of -Z onto the direction; half a turn about Y for +Z.
    const dvec3 d = glm::normalize(direction);
    Node node;
    node.name = name;
    node.parent = parent;
    node.light = int(scene_.lights.size()) - 1;
    node.local.rotation = d.z > 1.0 - 1e-9
                              ? glm::quat(0, 0, 1, 0)
                              : glm::quat(glm::normalize(glm::dquat(1.0 - d.z, d.y, -d.x, 0.0)));
    return addNode(std::move(node));
}

void Stage::camera(dvec3 eye, dvec3 target, double yfov, double znear, double zfar) {
    scene_.cameras.push_back({"camera", float(yfov), float(znear), float(zfar)});
    Node node;
    node.name = "camera";
    node.camera = int(scene_.cameras.size()) - 1;
    node.local.translation = glm::vec3(eye);
    node.local.rotation = toQuat(lookRotation(eye, target));
    addNode(std::move(node));
}

void Stage::cameraPath(const std::vector<Waypoint>& waypoints, double yfov, double znear,
                       double zfar) {
    camera(waypoints.front().eye, waypoints.front().target, yfov, znear, zfar);
    AnimationChannel move, turn;
    move.node = turn.node = int(scene_.nodes.size()) - 1;
    move.path = AnimationChannel::Path::kTranslation;
    turn.path = AnimationChannel::Path::kRotation;
    const int keyCount = int(waypoints.back().timeSeconds * 4.0 + 0.5) + 1;
    glm::dvec4 before(0);
    size_t segment = 0;
    for (int key = 0; key < keyCount; ++key) {
        const double time = key * 0.25;
        while (segment + 2 < waypoints.size() && time >= waypoints[segment + 1].timeSeconds)
            ++segment;
        const auto at = [&](int offset) -> const Waypoint& {
            return waypoints[size_t(
                std::clamp(int(segment) + offset, 0, int(waypoints.size()) - 1))];
        };
        const double span = at(1).timeSeconds - at(0).timeSeconds;
        const double t = std::clamp((time - at(0).timeSeconds) / span, 0.0, 1.0);
        const dvec3 eye = catmullRom(at(-1).eye, at(0).eye, at(1).eye, at(2).eye, t);
        const dvec3 target = catmullRom(at(-1).target, at(0).target, at(1).target, at(2).target, t);
        glm::dvec4 q = lookRotation(eye, target);
        if (glm::dot(q, before) < 0.0) // the nearer of the two quaternions of this rotation
            q = -q;
        before = q;
        move.times.push_back(float(time));
        turn.times.push_back(float(time));
        move.values.emplace_back(glm::vec3(eye), 0.0f);
        turn.values.emplace_back(q);
    }
    scene_.animations.push_back({"camera path", {move, turn}});
}

void Stage::addMover(AnimationChannel channel) {
    for (Animation& animation : scene_.animations)
        if (animation.name == "movers") {
            animation.channels.push_back(std::move(channel));
            return;
        }
    scene_.animations.push_back({"movers", {std::move(channel)}});
}

void Stage::animateTranslation(int node, const std::vector<float>& times,
                               const std::vector<dvec3>& keys) {
    AnimationChannel channel;
    channel.node = node;
    channel.times = times;
    for (const dvec3& key : keys)
        channel.values.emplace_back(glm::vec3(key), 0.0f);
    addMover(std::move(channel));
}

void Stage::animateYaw(int node, double periodSeconds, double untilSeconds, double startTurns) {
    AnimationChannel channel;
    channel.node = node;
    channel.path = AnimationChannel::Path::kRotation;
    const int keyCount = int(untilSeconds * 2.0 + 0.5) + 1;
    for (int key = 0; key < keyCount; ++key) {
        const double turns = startTurns + key * 0.5 / periodSeconds;
        channel.times.push_back(float(key * 0.5));
        channel.values.emplace_back(0.0f, float(sinTurns(turns / 2)), 0.0f,
                                    float(cosTurns(turns / 2)));
    }
    addMover(std::move(channel));
}

} // namespace shadowdag
