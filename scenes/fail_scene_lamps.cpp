// SPDX-License-Identifier: Apache-2.0
// The failure scenes of lights in lamps: voxels near a light are magnified in the shadows that they
// cast. A voxel of side h that is hit t_L from the light and t_P from the sample moves the edge of
// a shadow by up to about h (t_L + t_P) / t_L: a centimetre at a lantern's bars is a metre on the
// wall across the street.
#include "scenes/fail_scenes.h"

#include "scenes/mesh_shapes.h"

#include <algorithm>

namespace shadowdag {

using glm::dvec3;

namespace {

/// A floor whose top lies at y = 0 and a wall whose face lies at z = -halfZ.
void addRoom(FailScene& s, double halfX, double halfZ, double height) {
    s.boxes.push_back(boxBetween({-halfX, -0.2, -halfZ}, {halfX, 0.0, halfZ}, 1));
    s.boxes.push_back(boxBetween({-halfX, -0.2, -halfZ - 0.2}, {halfX, height, -halfZ}, 1));
}

/// Adds a bulb above the light, eight bars around both, a ring below and above them, and a roof.
/// The near faces of the middle bars are `barDistance` from the light.
void addLantern(FailScene& s, const dvec3& light, double barDistance) {
    const double d = barDistance, half = kLanternBarHalf * d, depth = 2.0 * half;
    const auto add = [&](dvec3 min, dvec3 max, uint32_t material = 2) {
        s.boxes.push_back(boxBetween(light + min * d, light + max * d, material));
    };
    add({-0.2, 0.05, -0.2}, {0.2, 0.45, 0.2}, 3); // the bulb
    add({-1.2, 1.0, -1.2}, {1.2, 1.1, 1.2}, 3);   // the roof
    const double w = half / d, far = 1.0 + depth / d;
    for (const double f : {-1.0, 1.0}) {
        const double near = f < 0 ? -far : 1.0, beyond = f < 0 ? -1.0 : far;
        add({near, -1.2, -w}, {beyond, 1.0, w}); // middle bars
        add({-w, -1.2, near}, {w, 1.0, beyond});
        for (const double g : {-1.0, 1.0}) { // corner posts
            const double nearZ = g < 0 ? -far : 1.0, beyondZ = g < 0 ? -1.0 : far;
            add({near, -1.2, nearZ}, {beyond, 1.0, beyondZ});
        }
        const double y = f < 0 ? -1.2 : 0.95; // rings, within the bars
        for (const double g : {-1.0, 1.0}) {
            const double at = g * (1.0 + w);
            add({-1.0, y, at - 0.5 * w}, {1.0, y + w, at + 0.5 * w});
            add({at - 0.5 * w, y, -1.0}, {at + 0.5 * w, y + w, 1.0});
        }
    }
}

/// Adds an octagonal shade without top and bottom around a light, `radius` from it to the inner
/// side of a panel.
void addShade(FailScene& s, const dvec3& light, double radius, double halfHeight,
              double thickness) {
    const double halfWidth = 0.4143 * (radius + thickness); // tan(22.5 degrees), rounded up
    for (int i = 0; i < 8; ++i) {
        const double yaw = i / 8.0;
        const double out = radius + 0.5 * thickness;
        s.boxes.push_back({light + dvec3(out * sinTurns(yaw), 0.0, out * cosTurns(yaw)),
                           {halfWidth, halfHeight, 0.5 * thickness},
                           yaw,
                           0.0,
                           uint32_t(2 + i % 2),
                           dvec3(0.0)});
    }
}

FailScene lantern() {
    FailScene s{"fail-lantern",
                "bars around a light, thrown as bands over a wall: voxels thicken the bars, and "
                "what is a centimetre at the lantern is a metre on the wall (ours)",
                {},
                {},
                {0.6, 2.3, 5.4},
                {0, 1.0, -1.5}};
    addRoom(s, 4.0, 2.5, 3.0);
    const dvec3 positions[3] = {{-2.4, 1.5, -0.4}, {0.9, 1.3, -0.6}, {2.9, 1.0, -0.9}};
    const double distances[3] = {1.0, 0.1, 0.01};
    for (int i = 0; i < 3; ++i) {
        addLantern(s, positions[i], distances[i]);
        s.lights.push_back({positions[i], 6.0, 4.0});
    }
    return s;
}

FailScene shade() {
    FailScene s{"fail-shade",
                "lamp shades of 4, 20 and 60 cm, open above and below: voxels thicken the rims "
                "until no light leaves the small ones (ours)",
                {},
                {},
                {0.4, 2.4, 5.6},
                {0, 1.0, -1.2}};
    addRoom(s, 4.0, 2.5, 3.0);
    const dvec3 positions[3] = {{-2.3, 1.6, -1.0}, {0.4, 1.2, -1.2}, {2.6, 0.8, -1.4}};
    const double radii[3] = {0.6, 0.2, 0.04};
    for (int i = 0; i < 3; ++i) {
        const double r = radii[i];
        addShade(s, positions[i], r, 0.6 * r, 0.03 * r);
        // What carries it: a socket under the light.
        s.boxes.push_back(boxBetween(positions[i] + dvec3(-0.08, -0.5, -0.08) * r,
                                     positions[i] + dvec3(0.08, -0.1, 0.08) * r, 3));
        s.lights.push_back({positions[i], 6.0, 4.0});
    }
    return s;
}

FailScene sconce() {
    FailScene s{"fail-sconce",
                "lights 5, 10 and 20 cm from a wall, over cups on brackets: shadows of a frame and "
                "of a ledge are long on the wall, and so are those of voxels (ours)",
                {},
                {},
                {0.3, 1.7, 4.2},
                {0, 1.3, -2.0}};
    addRoom(s, 4.0, 2.5, 3.0);
    const double wall = -2.5;
    const double distances[3] = {0.05, 0.10, 0.20};
    for (int i = 0; i < 3; ++i) {
        const double g = distances[i], x = -2.4 + 2.4 * i, y = 1.5;
        const dvec3 at(x, y, wall + g);
        s.boxes.push_back(
            boxBetween({x - 0.8 * g, y - 2.0 * g, wall}, {x + 0.8 * g, y, wall + 0.1 * g}));
        s.boxes.push_back(boxBetween({x - 0.06 * g, y - 0.9 * g, wall}, // the bracket
                                     {x + 0.06 * g, y - 0.8 * g, wall + 1.0 * g}));
        const double half = 0.4 * g, wallOfCup = 0.05 * g, foot = y - 0.8 * g, rim = y - 0.2 * g;
        const dvec3 c(x, 0.0, wall + g);
        s.boxes.push_back(
            boxBetween(c + dvec3(-half, foot, -half), c + dvec3(half, foot + wallOfCup, half), 3));
        for (const double f : {-1.0, 1.0}) {
            const double a = f * half, b = f * (half - wallOfCup);
            s.boxes.push_back(boxBetween(c + dvec3(std::min(a, b), foot, -half),
                                         c + dvec3(std::max(a, b), rim, half), 3));
            s.boxes.push_back(boxBetween(c + dvec3(-half, foot, std::min(a, b)),
                                         c + dvec3(half, rim, std::max(a, b)), 3));
        }
        s.lights.push_back({at, 5.0, 2.0});
    }
    for (const double x : {-1.2, 1.2}) // frames of 2 cm
        for (const double f : {-1.0, 1.0}) {
            s.boxes.push_back(boxBetween({x + f * 0.30 - 0.03, 1.2, wall}, // upright
                                         {x + f * 0.30 + 0.03, 1.9, wall + 0.02}));
            s.boxes.push_back(boxBetween({x - 0.33, 1.55 + f * 0.35 - 0.03, wall},
                                         {x + 0.33, 1.55 + f * 0.35 + 0.03, wall + 0.02}));
        }
    s.boxes.push_back(boxBetween({-3.8, 0.9, wall}, {3.8, 0.94, wall + 0.03})); // a ledge
    return s;
}

FailScene inside() {
    FailScene s{"fail-inside",
                "lights in a closed crate, in one of slats with gaps of 15 mm, and in one without "
                "lid and front: no light may leave the first, stripes leave the second (ours)",
                {},
                {},
                {0.8, 3.0, 5.2},
                {0, 0.4, -0.4}};
    addRoom(s, 4.0, 2.5, 2.5);
    const double half = 0.5, board = 0.01, z = -0.6;
    const double xs[3] = {-2.4, 0.0, 2.4};
    for (int i = 0; i < 3; ++i)
        s.lights.push_back({{xs[i] + 0.03, 0.55, z + 0.02}, 5.0, 3.0});

    // Closed: six boards that overlap at the edges.
    const dvec3 a(xs[0], 0.5, z);
    for (int axis = 0; axis < 3; ++axis)
        for (const double f : {-1.0, 1.0}) {
            dvec3 center(0.0), size(half);
            center[axis] = f * (half - 0.5 * board);
            size[axis] = 0.5 * board;
            // It stands above the floor by more than rays from there are lifted.
            s.boxes.push_back({a + center + dvec3(0, 0.05, 0), size, 0.0, 0.0, 2});
        }

    // Leaking: four sides of slats, 15 mm apart, under a lid.
    const dvec3 b(xs[1], 0.0, z);
    const int slatCount = 8;
    const double pitch = 2.0 * half / slatCount, slat = 0.5 * (pitch - 0.015);
    for (int k = 0; k < slatCount; ++k) {
        const double along = -half + (k + 0.5) * pitch;
        for (const double f : {-1.0, 1.0}) {
            const double out = f * (half - 0.5 * board);
            s.boxes.push_back(
                {b + dvec3(along, half, out), {slat, half, 0.5 * board}, 0.0, 0.0, 2});
            s.boxes.push_back(
                {b + dvec3(out, half, along), {0.5 * board, half, slat}, 0.0, 0.0, 3});
        }
    }
    s.boxes.push_back(boxBetween(b + dvec3(-half, 1.0, -half), b + dvec3(half, 1.0 + board, half)));

    // Open: three sheets without thickness stand on the floor.
    const dvec3 c(xs[2], 0.0, z);
    s.boxes.push_back({c + dvec3(0, half, -half), {half, 0.0, half}, 0.0, 0.25, 3});
    for (const double f : {-1.0, 1.0})
        s.boxes.push_back({c + dvec3(f * half, half, 0), {half, 0.0, half}, 0.25, 0.25, 3});
    return s;
}

} // namespace

FailScene makeLanternStage(double barDistance, double wallDistance) {
    FailScene s{"lantern-stage",
                "one lantern at the origin before a wall",
                {},
                {{dvec3(0.0), 20.0 * wallDistance, 1.0}},
                {0.9 * wallDistance, 0.6 * wallDistance, 1.4 * wallDistance},
                {0, 0, -wallDistance}};
    const double d = wallDistance;
    s.boxes.push_back(boxBetween({-d, -d, -1.05 * d}, {d, d, -d}, 1));
    addLantern(s, dvec3(0.0), barDistance);
    return s;
}

std::vector<FailScene> lampFailScenes() {
    return {lantern(), shade(), sconce(), inside()};
}

} // namespace shadowdag
