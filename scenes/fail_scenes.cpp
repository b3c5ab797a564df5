// SPDX-License-Identifier: Apache-2.0
// The list of the failure scenes. Sources of the failures: Dou et al., Adaptive Depth Bias for
// Shadow Maps, I3D 2014 (bias); Kaempe et al., High Resolution Sparse Voxel DAGs, SIGGRAPH 2013
// (voxel rays); Olsson et al., TVCG 2015 (the rest); found in this program, where a description
// says so.
#include "scenes/fail_scenes.h"

#include "scenes/mesh_shapes.h"

#include <utility>

namespace shadowdag {

using glm::dvec3;

namespace {

/// A floor with its top at y = 0.
FailBox floorBox(double halfX, double halfZ) {
    return boxBetween({-halfX, -0.5, -halfZ}, {halfX, 0.0, halfZ}, 1);
}

FailScene acne() {
    return {"fail-acne",
            "acne: depths sampled at texel centres shadow a floor under grazing light, although "
            "all of it is lit",
            {floorBox(10, 10)},
            {{{-9.5, 0.4, 0.3}, 30.0, 6.0}},
            {0, 5, 12},
            {0, 0, 0}};
}

FailScene detachedShadow() {
    return {"fail-detached-shadow",
            "a bias in world units detaches shadows from the foot of a wall (Dou et al., I3D 2014)",
            {floorBox(5, 5), boxBetween({-2, 0, -0.05}, {2, 1, 0.05}),
             boxBetween({2.5, 0, -1}, {2.54, 0.5, 1}, 3)},
            {{{0.5, 3.0, -2.5}, 12.0, 8.0}, {{-3.5, 2.0, 0.8}, 12.0, 5.0}},
            {2, 3, 5},
            {0, 0.2, 0}};
}

FailScene filterAcne() {
    FailScene s{"fail-filter-acne",
                "filter taps on slopes of 30 to 80 degrees compare with the wrong plane",
                {floorBox(8, 4)},
                {{{0.0, 5.0, 3.0}, 15.0, 14.0}},
                {0, 4, 9},
                {0, 0.8, 0}};
    const double pitch[5] = {30 / 360.0, 45 / 360.0, 60 / 360.0, 70 / 360.0, 80 / 360.0};
    for (int i = 0; i < 5; ++i)
        s.boxes.push_back(
            {{-5.0 + 2.5 * i, 1.3, -0.5}, {0.9, 0.1, 1.2}, 0.0, pitch[i], 2, dvec3(0.0)});
    return s;
}

FailScene obliqueUndersampling() {
    FailScene s{
        "fail-oblique-undersampling",
        "equation 1 requests too few texels where light grazes the receiver (Olsson 2015, fig. 3b)",
        {floorBox(20, 3)},
        {{{-19.0, 0.6, 0.0}, 45.0, 20.0}},
        {10, 2.5, 6},
        {6, 0, 0}};
    for (int i = 0; i < 24; ++i)
        s.boxes.push_back(
            boxBetween({-17.5, 0.0, -2.9 + 0.24 * i}, {-17.4, 0.5, -2.78 + 0.24 * i}));
    return s;
}

FailScene missingTap() {
    FailScene s{
        "fail-missing-tap",
        "filter taps fall on pages that no cluster requested; small shadows on a large floor",
        {floorBox(12, 12)},
        {{{0.0, 6.0, 0.0}, 25.0, 25.0}},
        {0, 2.0, 5},
        {0, 0, 0}};
    for (int i = 0; i < 7; ++i)
        for (int j = 0; j < 7; ++j)
            s.boxes.push_back(boxBetween({-6 + 2.0 * i - 0.15, 2.0, -6 + 2.0 * j - 0.15},
                                         {-6 + 2.0 * i + 0.15, 2.1, -6 + 2.0 * j + 0.15}));
    return s;
}

FailScene cubeSeam() {
    FailScene s{"fail-cube-seam",
                "bars across the edges and corners of the cube map's faces, as seen from the light",
                {boxBetween({-4, -0.5, -4}, {4, 0, 4}, 1), boxBetween({-4, 6, -4}, {4, 6.5, 4}, 1),
                 boxBetween({-4.5, -0.5, -4}, {-4, 6.5, 4}, 1),
                 boxBetween({-4, -0.5, -4.5}, {4, 6.5, -4}, 1)},
                {{{0.0, 3.0, 0.0}, 12.0, 8.0}},
                {3.5, 4.5, 3.5},
                {-2, 2, -2}};
    for (int a = 0; a < 3; ++a)
        for (int k = 0; k < 4; ++k) { // a bar of four across each of the 12 face edges
            dvec3 c(0.0), h(0.35);
            c[(a + 1) % 3] = k & 1 ? 1.0 : -1.0;
            c[(a + 2) % 3] = k & 2 ? 1.0 : -1.0;
            h[(a + 1) % 3] = h[(a + 2) % 3] = 0.06;
            s.boxes.push_back({dvec3(0, 3, 0) + c, h, 0.0, 0.0, 2, dvec3(0.0)});
        }
    for (int k = 0; k < 8; ++k) // and a cube on each corner
        s.boxes.push_back({{k & 1 ? 1.2 : -1.2, k & 2 ? 4.2 : 1.8, k & 4 ? 1.2 : -1.2},
                           dvec3(0.08),
                           0.0,
                           0.0,
                           3,
                           dvec3(0.0)});
    return s;
}

FailScene lightTouching() {
    return {"fail-light-touching",
            "lights on a face, a centimetre off it and in a narrow gap; the near plane must not "
            "cut blockers off",
            {floorBox(4, 4), boxBetween({-4, 0, -4.3}, {4, 3, -4}, 1),
             boxBetween({-0.3, 0, -0.3}, {0.3, 1, 0.3}), boxBetween({1.5, 0, -1}, {1.7, 1.5, 1}, 3),
             boxBetween({1.8, 0, -1}, {2.0, 1.5, 1}, 3)},
            {{{0.0, 1.0, 0.0}, 10.0, 4.0},
             {{-2.0, 1.5, -3.99}, 10.0, 4.0},
             {{1.75, 0.75, 0.0}, 8.0, 3.0}},
            {3, 3, 5},
            {0, 0.5, 0}};
}

FailScene thinWall() {
    return {"fail-thin-wall",
            "light leaks through a wall of 2 cm when texels or offsets are larger than it",
            {floorBox(5, 4), boxBetween({-0.01, 0, -4}, {0.01, 3, 4}),
             boxBetween({-5, 3, -4}, {5, 3.2, 4}, 1), boxBetween({-5.2, -0.5, -4}, {-5, 3.2, 4}, 1),
             boxBetween({5, -0.5, -4}, {5.2, 3.2, 4}, 1),
             boxBetween({-5, -0.5, -4.2}, {5, 3.2, -4}, 1)},
            {{{-2.0, 2.0, 0.5}, 9.0, 5.0}, {{2.5, 1.2, -1.0}, 3.0, 1.0}},
            {0.6, 2.2, 3.8},
            {1.5, 1.0, -1}};
}

FailScene wires() {
    FailScene s{
        "fail-wires",
        "conservative voxels thicken wires of 12 mm until a grate stops every ray (Kaempe 2013)",
        {floorBox(4, 4)},
        {{{0.3, 3.5, 0.2}, 12.0, 9.0}},
        {0, 2.5, 5},
        {0, 0.5, 0}};
    for (int i = 0; i < 40; ++i) {
        const double t = -1.95 + 0.1 * i;
        s.boxes.push_back(boxBetween({t - 0.006, 1.2, -2}, {t + 0.006, 1.212, 2}));
        s.boxes.push_back(boxBetween({-2, 1.22, t - 0.006}, {2, 1.232, t + 0.006}));
    }
    return s;
}

FailScene selfShadow() {
    FailScene s{
        "fail-self-shadow", "voxels as thick as a tile shadow the tile from which they were made",
        {floorBox(6, 6)},   {{{0.0, 4.0, 0.0}, 14.0, 12.0}},
        {0, 6, 8},          {0, 0.5, 0}};
    for (int i = 0; i < 24; ++i) {
        const double t = i / 24.0, r = 2.2 + 1.6 * (i % 3) / 2.0;
        s.boxes.push_back({{r * cosTurns(t), 0.55, r * sinTurns(t)},
                           {0.3, 0.02, 0.3},
                           0.25 - t,
                           0.01 + 0.008 * i,
                           uint32_t(2 + i % 2),
                           dvec3(0.0)});
    }
    return s;
}

FailScene contact() {
    FailScene s{
        "fail-contact",   "shadows of steps of 2 mm to 128 mm are lost within the ray's offset",
        {floorBox(4, 2)}, {{{-4.5, 1.2, 0.0}, 14.0, 6.0}},
        {0, 1.5, 2.8},    {0, 0, 0}};
    for (int i = 0; i < 7; ++i)
        s.boxes.push_back(
            boxBetween({-3 + 0.9 * i, 0.0, -1.0}, {-2.8 + 0.9 * i, 0.002 * (1 << i), 1.0}));
    return s;
}

FailScene silhouette() {
    FailScene s{"fail-silhouette",
                "silhouettes grow by up to a voxel; cubes of 0.5 m to 8 mm over a floor",
                {floorBox(5, 2.5)},
                {{{0.0, 5.0, 0.0}, 14.0, 16.0}},
                {0, 3.2, 4.5},
                {0, 0.2, 0}};
    double x = -3.6;
    for (int i = 0; i < 7; ++i) {
        const double size = 0.5 / (1 << i);
        s.boxes.push_back({{x, 1.0, 0.0}, dvec3(size / 2), 0.03 * i, 0.04 * i, 2, dvec3(0.0)});
        x += 1.2;
    }
    return s;
}

FailScene farOrigin() {
    // Every coordinate is a multiple of 1/64, which floats still hold at 1e5.
    const dvec3 o(100000.0, 0.0, -100000.0);
    FailScene s{"fail-far-origin",
                "a wall and a floor 100 km from the origin, where the last bit of a float is 8 mm",
                {},
                {{o + dvec3(0.5, 3.0, -2.5), 12.0, 8.0}},
                o + dvec3(2, 3, 5),
                o};
    for (FailBox b : {floorBox(5, 5), boxBetween({-2, 0, -0.125}, {2, 1, 0.125}),
                      boxBetween({2.5, 0, -1}, {2.75, 0.5, 1}, 3)}) {
        b.center += o;
        s.boxes.push_back(b);
    }
    return s;
}

FailScene axisAligned() {
    FailScene s{
        "fail-axis-aligned",
        "rays with zero components and at 45 degrees, along faces and edges of cubes",
        {floorBox(4, 4)},
        {{{0.0, 3.0, 0.0}, 10.0, 7.0}, {{-3.0, 0.5, 0.0}, 10.0, 4.0}, {{3.0, 3.0, 3.0}, 10.0, 7.0}},
        {2.5, 4, 5},
        {0, 0.5, 0}};
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            if (i != 0 || j != 0)
                s.boxes.push_back(boxBetween({2.0 * i - 0.5, 0.0, 2.0 * j - 0.5},
                                             {2.0 * i + 0.5, 1.0, 2.0 * j + 0.5}));
    return s;
}

FailScene mover() {
    FailScene s{"fail-mover",     "a moving box is not in the voxels; its shadow must move with it",
                {floorBox(5, 3)}, {{{0.0, 4.0, 0.0}, 12.0, 12.0}},
                {0, 3.5, 5},      {0, 0.3, 0}};
    FailBox b = boxBetween({-2.5, 0.8, -0.5}, {-1.5, 1.3, 0.5});
    b.velocity = {1.0, 0.0, 0.0};
    s.boxes.push_back(b);
    s.boxes.push_back(boxBetween({-0.2, 0.0, -2.0}, {0.2, 0.6, -1.6}, 3));
    return s;
}

FailScene unequalRanges() {
    FailScene s{
        "fail-unequal-ranges",
        "one light over the whole scene among many small ones takes the resolution from all others",
        {floorBox(30, 30)},
        {{{-25.0, 14.0, -25.0}, 200.0, 180.0}},
        {6, 5, 12},
        {0, 0, 0}};
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 5; ++j) {
            const double x = -25.0 + 10.0 * i, z = -20.0 + 10.0 * j;
            s.boxes.push_back(boxBetween({x - 0.15, 0.0, z - 0.15}, {x + 0.15, 1.5, z + 0.15}));
            s.lights.push_back({{x + 0.5, 0.8, z + 0.4}, 2.0, 0.6});
        }
    return s;
}

FailScene coplanar() {
    FailScene s{"fail-coplanar",
                "duplicate, degenerate and flipped triangles, and an open sheet with a hole",
                {floorBox(4, 4), boxBetween({-1.5, 0, -0.5}, {-0.5, 1, 0.5})},
                {{{0.0, 3.0, 1.0}, 10.0, 8.0}},
                {2, 3, 5},
                {0, 0.5, 0}};
    // The sheet: four flat boxes around a hole of 0.4 m.
    for (const FailBox& b :
         {boxBetween({0.5, 1, -0.8}, {2.1, 1, -0.2}, 3),
          boxBetween({0.5, 1, 0.2}, {2.1, 1, 0.8}, 3), boxBetween({0.5, 1, -0.2}, {1.1, 1, 0.2}, 3),
          boxBetween({1.5, 1, -0.2}, {2.1, 1, 0.2}, 3)})
        s.boxes.push_back(b);
    s.isMessy = true;
    return s;
}

FailScene borderLight() {
    FailScene s{"fail-border-light",
                "lights at the borders of pages and clusters, and a range that ends on a wall",
                {floorBox(4, 4), boxBetween({4, -0.5, -4}, {4.5, 4, 4}, 1)},
                {{{0.0, 2.0, 0.0}, 4.0, 5.0}, {{-2.0, 1.0, 2.0}, 6.0, 4.0}},
                {-2, 3, 5},
                {1, 0.5, 0}};
    for (int i = -3; i <= 3; ++i) // seen from light 0, edges at quarters of the lower cube face
        s.boxes.push_back(boxBetween({0.25 * i, 1.0, -0.75}, {0.25 * i + 0.125, 1.0625, 0.75}));
    return s;
}

FailScene alphaMask() {
    FailScene s{"fail-alpha",
                "holes cut by the alpha channel of a texture, in a lying, a leaning and a moving "
                "board (Olsson 2015, sec. VI: no alpha masks)",
                {floorBox(5, 3)},
                {{{0.3, 4.0, 0.2}, 14.0, 12.0}, {{-3.5, 2.2, 1.5}, 10.0, 5.0}},
                {0.4, 3.4, 6},
                {0, 0.5, 0}};
    FailBox lying{{-1.6, 1.4, 0.0}, {1.2, 0.0, 1.2}};
    lying.chequerCount = 8;
    FailBox leaning{{1.8, 1.0, -0.6}, {1.1, 0.0, 0.9}, 0.06, 0.17, 3};
    leaning.chequerCount = 6;
    FailBox moving{{-1.0, 0.5, 1.7}, {0.6, 0.0, 0.6}};
    moving.chequerCount = 4;
    moving.velocity = {0.7, 0.0, 0.0};
    s.boxes.insert(s.boxes.end(), {lying, leaning, moving});
    return s;
}

/// A post of height h at elevation e (tan e = 0.48 / sqrt(0.6^2 + 0.64^2)) has a shadow of length h
/// / tan e. A bridge blocks from high above, and a box moves through the light.
FailScene sun() {
    FailScene s{"fail-sun",
                "a directional light, which the paper does not have: no position, no range; "
                "parallel shadows "
                "of posts, of a high bridge and of moving objects",
                {floorBox(12, 12), boxBetween({-0.1, 0, -0.1}, {0.1, 2.0, 0.1}),
                 boxBetween({-4.15, 0, 1.9}, {-4.05, 3.0, 2.0}, 3),
                 boxBetween({-9, 8, -6}, {-5, 8.4, 6})},
                {{dvec3(0.0), 0.0, 3.0, {0.6, -0.48, 0.64}}},
                {3.0, 4.5, 10.0},
                {0.5, 0.5, 0}};
    s.boxes.push_back({{-2.0, 1.2, -2.5}, dvec3(0.3), 0.1, 0.05, 3, {0.8, 0.0, 0.3}});
    return s;
}

FailScene stalePages() {
    FailScene s{
        "fail-stale-pages",
        "shadow maps that are kept from frame to frame still show the state before a box and a "
        "light moved",
        {floorBox(5, 3), boxBetween({1.4, 0.0, -1.2}, {1.7, 0.8, -0.9}, 3)},
        {{{0.0, 4.0, 0.0}, 12.0, 12.0}, {{-3.0, 2.0, 1.5}, 9.0, 6.0, dvec3(0.0), {0.4, 0, 0}}},
        {0, 3.5, 5},
        {0, 0.3, 0}};
    FailBox b = boxBetween({-2.5, 0.6, -0.4}, {-1.7, 1.1, 0.4});
    b.velocity = {1.0, 0.0, 0.0};
    s.boxes.push_back(b);
    return s;
}

/// Posts of 6 to 24 cm between lights at many distances: some light's request is always near a
/// step.
FailScene popping() {
    FailScene s{"fail-popping",
                "resolutions alternate between two steps as the camera sways, and shadows pop",
                {floorBox(6, 6)},
                {},
                {0.5, 2.4, 6.5},
                {0, 0.3, 0}};
    for (int i = 0; i < 9; ++i) {
        const double t = i / 9.0, r = 1.0 + 0.45 * i;
        s.lights.push_back({{r * cosTurns(t), 1.1 + 0.2 * (i % 4), r * sinTurns(t)}, 5.0, 1.6});
    }
    for (int i = 0; i < 14; ++i) {
        const double t = 0.04 + i * 0.38, r = 0.6 + 0.33 * i, half = 0.03 + 0.015 * (i % 7);
        const dvec3 foot(r * cosTurns(t), 0.0, r * sinTurns(t));
        s.boxes.push_back(
            boxBetween(foot - dvec3(half, 0, half), foot + dvec3(half, 0.9, half), 2 + i % 2));
    }
    s.eyeSway = {0.12, 0.0, 0.25};
    return s;
}

/// Contact shadows of steps and thin plates: the offset of rays and the bias of maps lose different
/// ones.
FailScene methodSwitch() {
    FailScene s = popping();
    s.name = "fail-method-switch";
    s.description = "rays and maps have different errors at contacts and silhouettes, which is "
                    "visible when a map near the threshold changes its method";
    s.boxes.resize(1);
    for (int i = 0; i < 14; ++i) {
        const double t = 0.04 + i * 0.38, r = 0.6 + 0.33 * i;
        const dvec3 foot(r * cosTurns(t), 0.0, r * sinTurns(t));
        s.boxes.push_back(boxBetween(foot - dvec3(0.25, 0, 0.04),
                                     foot + dvec3(0.25, 0.02 + 0.02 * (i % 5), 0.04), 2 + i % 2));
    }
    return s;
}

FailScene severalMaps() {
    FailScene s{"fail-several-maps",
                "several maps per light, each at the resolution that its clusters request: the "
                "coarse ones are used where a single map would be finer",
                {floorBox(3, 16)},
                {{{0.4, 3.2, 2.0}, 24.0, 14.0}},
                {0.6, 1.5, 8.0},
                {0, 0.4, -2}};
    for (int i = 0; i < 26; ++i) {
        const double x = i % 2 ? 1.2 : -1.2, z = 6.0 - 0.8 * i;
        s.boxes.push_back(
            boxBetween({x - 0.04, 0.0, z - 0.04}, {x + 0.04, 1.0, z + 0.04}, 2 + i % 2));
    }
    return s;
}

FailScene sunSteps() {
    FailScene s{"fail-sun-steps",
                "the windows of a low directional light are two octaves apart: shadows of posts "
                "become coarser "
                "where the next window begins, and on ground at grazing light",
                {floorBox(8, 24)},
                {{dvec3(0.0), 0.0, 3.0, {0.85, -0.25, -0.2}}},
                {0.5, 1.8, 10.0},
                {0, 0.2, 2}};
    for (int i = 0; i < 18; ++i) {
        const double x = -2.5 + 1.7 * (i % 3), z = 7.5 - 1.5 * i;
        s.boxes.push_back(
            boxBetween({x - 0.06, 0.0, z - 0.06}, {x + 0.06, 0.7, z + 0.06}, 2 + i % 2));
    }
    s.eyeSway = {0.1, 0.0, 0.3};
    return s;
}

FailScene polygonLod() {
    FailScene s{"fail-polygon-lod",
                "the simplified triangles in a map shadow the full-detail surface that is seen, or "
                "shrink its silhouette",
                {floorBox(4, 3)},
                {{{-1.5, 3.0, 1.5}, 12.0, 9.0}},
                {0, 2.2, 4.6},
                {0, 0.5, 0}};
    for (int i = 0; i < 4; ++i)
        s.balls.push_back({{-1.8 + 1.2 * i, 0.6, 0.3 * (i % 2)}, 0.22 + 0.06 * i});
    return s;
}

} // namespace

std::vector<FailScene> failScenes() {
    std::vector<FailScene> scenes = {
        acne(),       detachedShadow(), filterAcne(),    obliqueUndersampling(),
        missingTap(), cubeSeam(),       lightTouching(), thinWall(),
        wires(),      selfShadow(),     contact(),       silhouette(),
        farOrigin(),  axisAligned(),    mover(),         unequalRanges(),
        coplanar(),   borderLight(),    alphaMask(),     sun(),
        stalePages(), popping(),        methodSwitch(),  severalMaps(),
        sunSteps(),   polygonLod()};
    for (FailScene& scene : lampFailScenes())
        scenes.push_back(std::move(scene));
    return scenes;
}

} // namespace shadowdag
