// SPDX-License-Identifier: Apache-2.0
// A failure scene as meshes, and its correct visibilities in closed form.
#include "scenes/fail_scenes.h"

#include "scenes/builtin_stage.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

using glm::dvec3;

namespace {

/// Returns whether a segment that crosses a board comes through a hole; nothing when it passes
/// within `border` of a square's edge.
std::optional<bool> passesHole(const FailBox& b, double timeSeconds, const dvec3& from,
                               const dvec3& to, double border) {
    const dvec3 center = b.center + b.velocity * timeSeconds;
    const glm::dmat3 worldFromBox(placement(dvec3(0.0), b.yawTurns, b.pitchTurns));
    const dvec3 o = glm::transpose(worldFromBox) * (from - center);
    const dvec3 d = glm::transpose(worldFromBox) * (to - from);
    const dvec3 at = o - d * (o.y / d.y);
    int square = 0;
    for (const int axis : {0, 2}) {
        const double side = 2.0 * b.half[axis] / b.chequerCount;
        const double position = (at[axis] + b.half[axis]) / side;
        if (!(std::abs(position - std::round(position)) * side > border))
            return std::nullopt;
        square += int(std::floor(position));
    }
    return square % 2 != 0;
}

/// Returns where the segment from a to b enters and leaves the box, grown by `grow`; empty if it
/// misses.
bool segmentMeetsBox(const FailBox& b, double timeSeconds, const dvec3& from, const dvec3& to,
                     double grow) {
    const dvec3 center = b.center + b.velocity * timeSeconds;
    const glm::dmat3 worldFromBox(placement(dvec3(0.0), b.yawTurns, b.pitchTurns));
    const dvec3 o = glm::transpose(worldFromBox) * (from - center);
    const dvec3 d = glm::transpose(worldFromBox) * (to - from);
    double enter = 0.0, leave = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        // A flat side is never shrunk away: the ray crosses it or not.
        const double half = b.half[axis] > 0.0 ? b.half[axis] + grow : std::max(grow, 0.0);
        if (half < 0.0)
            return false;
        if (d[axis] == 0.0) {
            if (std::abs(o[axis]) > half)
                return false;
            continue;
        }
        const double t0 = (-half - o[axis]) / d[axis], t1 = (half - o[axis]) / d[axis];
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
    }
    return enter <= leave;
}

/// Returns the least distance from the segment from a to b to a point.
double distanceTo(const dvec3& point, const dvec3& a, const dvec3& b) {
    const double share = glm::clamp(glm::dot(point - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
    return glm::length(a + (b - a) * share - point);
}

/// Returns the radius of a sphere that lies within a ball's facets: a facet's farthest points
/// inside are the middles of its sides, within half a step along both angles.
double innerRadius(const FailBall& ball) {
    return ball.radius * cosTurns(0.5 / ball.segments) * cosTurns(0.25 / ball.rings);
}

} // namespace

Scene makeFailScene(const FailScene& f) {
    Stage s(f.name);
    const uint32_t materials[4] = {0, s.material("floor", {0.66f, 0.60f, 0.50f}),
                                   s.material("occluder", {0.30f, 0.42f, 0.62f}),
                                   s.material("second occluder", {0.72f, 0.42f, 0.22f})};
    // Two by two texels, repeated: a board's material is the solid one's, cut out.
    const auto chequered = [&](uint32_t material) {
        Scene& scene = s.scene();
        if (scene.alphaMasks.empty()) {
            scene.alphaMasks.push_back(makeAlphaMask(2, 2));
            setOpaque(scene.alphaMasks[0], 0, 0);
            setOpaque(scene.alphaMasks[0], 1, 1);
        }
        const Material solid = scene.materials[material];
        const uint32_t cut = s.material(solid.name + ", chequered", solid.baseColor);
        scene.materials[cut].alphaMask = 0;
        return cut;
    };
    for (const FailBox& b : f.boxes) {
        const uint32_t material = materials[b.material];
        MeshBuilder m("flat_box", b.chequerCount ? chequered(material) : material);
        const bool isMoving = b.velocity != dvec3(0.0);
        m.setTransform(placement(isMoving ? dvec3(0.0) : b.center, b.yawTurns, b.pitchTurns));
        const dvec3 h = b.half;
        const auto add = [&] {
            const float n = float(b.chequerCount) / 2.0f;
            if (b.chequerCount)
                m.quad(m.vertex({-h.x, 0, h.z}, {0, n}), m.vertex({h.x, 0, h.z}, {n, n}),
                       m.vertex({h.x, 0, -h.z}, {n, 0}), m.vertex({-h.x, 0, -h.z}, {0, 0}));
            else if (h.y == 0.0)
                m.quad({-h.x, 0, h.z}, {h.x, 0, h.z}, {h.x, 0, -h.z}, {-h.x, 0, -h.z});
            else
                addBox(m, -h, h);
        };
        add();
        if (f.isMessy) {
            add(); // everything twice
            const uint32_t p = m.vertex(h), q = m.vertex(-h);
            m.triangle(p, q, p);
            m.triangle(q, q, q);
            const uint32_t a = m.vertex({-h.x, h.y, -h.z}), c = m.vertex({h.x, h.y, -h.z}),
                           d = m.vertex(h);
            m.triangle(a, c, d); // and once the other way round
        }
        const int node = s.place(s.mesh(m), isMoving ? b.center : dvec3(0.0));
        if (isMoving)
            s.animateTranslation(node, {0.0f, 4.0f}, {b.center, b.center + b.velocity * 4.0});
    }
    for (const FailBall& b : f.balls) {
        MeshBuilder m("ball", materials[2]);
        addBall(m, dvec3(0.0), b.radius, b.segments, b.rings);
        s.place(s.mesh(m), b.center);
    }
    for (size_t i = 0; i < f.lights.size(); ++i) {
        const FailLight& light = f.lights[i];
        const std::string name = "light " + std::to_string(i);
        if (light.sunDirection != dvec3(0.0)) {
            s.directionalLight(name, light.sunDirection, {1.0f, 0.97f, 0.9f}, light.intensity);
            continue;
        }
        const int node =
            s.pointLight(name, light.position, light.range, {1.0f, 0.94f, 0.84f}, light.intensity);
        if (light.velocity != dvec3(0.0))
            s.animateTranslation(node, {0.0f, 4.0f},
                                 {light.position, light.position + light.velocity * 4.0});
    }
    if (f.eyeSway == dvec3(0.0)) {
        s.camera(f.eye, f.target, 0.9, 0.05, 500.0);
    } else {
        std::vector<Stage::Waypoint> path;
        for (int quarter = 0; quarter <= 8; ++quarter) {
            const dvec3 off = f.eyeSway * sinTurns(0.25 * quarter);
            path.push_back({0.5 * quarter, f.eye + off, f.target + off});
        }
        s.cameraPath(path, 0.9, 0.05, 500.0);
    }
    return s.take();
}

dvec3 lightPointOf(const FailScene& scene, const dvec3& pointWorld, int light, double timeSeconds) {
    const FailLight& source = scene.lights[size_t(light)];
    if (source.sunDirection == dvec3(0.0))
        return source.position + source.velocity * timeSeconds;
    double reach = 0.0; // twice the distance of the farthest object from the point
    for (const FailBox& b : scene.boxes) {
        const dvec3 now = b.center + b.velocity * timeSeconds;
        reach = std::max(reach, 2.0 * (glm::length(now - pointWorld) + glm::length(b.half)));
    }
    for (const FailBall& b : scene.balls)
        reach = std::max(reach, 2.0 * (glm::length(b.center - pointWorld) + b.radius));
    return pointWorld - glm::normalize(source.sunDirection) * reach;
}

std::optional<bool> expectedLit(const FailScene& scene, const dvec3& pointWorld, int light,
                                double timeSeconds) {
    double extent = 0.0;
    for (const FailBox& b : scene.boxes)
        extent = std::max({extent, 2.0 * b.half.x, 2.0 * b.half.y, 2.0 * b.half.z});
    const dvec3 to = lightPointOf(scene, pointWorld, light, timeSeconds);
    const dvec3 along = (to - pointWorld) / glm::length(to - pointWorld) * (1e-4 * extent);
    const dvec3 a = pointWorld + along, b = to - along;
    bool mayHit = false;
    for (const FailBox& occluder : scene.boxes) {
        if (segmentMeetsBox(occluder, timeSeconds, a, a, 0.0))
            return std::nullopt;
        if (occluder.chequerCount && segmentMeetsBox(occluder, timeSeconds, a, b, 1e-6 * extent)) {
            const std::optional<bool> isThrough =
                passesHole(occluder, timeSeconds, a, b, 2e-6 * extent);
            if (isThrough && *isThrough)
                continue;
            if (!isThrough) {
                mayHit = true;
                continue;
            }
        }
        if (segmentMeetsBox(occluder, timeSeconds, a, b, -1e-6 * extent))
            return false;
        mayHit |= segmentMeetsBox(occluder, timeSeconds, a, b, 1e-6 * extent);
    }
    for (const FailBall& ball : scene.balls) {
        const double distance = distanceTo(ball.center, a, b);
        if (glm::length(a - ball.center) < ball.radius + 2e-4 * extent)
            return std::nullopt;
        if (distance < innerRadius(ball) - 1e-6 * extent)
            return false;
        mayHit |= distance < ball.radius + 1e-6 * extent;
    }
    return mayHit ? std::nullopt : std::optional<bool>(true);
}

} // namespace shadowdag
