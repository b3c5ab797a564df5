// SPDX-License-Identifier: Apache-2.0
// Sources of the failures: Dou et al., Adaptive Depth Bias for Shadow Maps, I3D 2014 (bias); Kaempe
// et al., High Resolution Sparse Voxel DAGs, SIGGRAPH 2013 (voxel rays); Olsson et al., TVCG 2015
// (the rest).
#include "scenes/fail_scenes.h"

#include "scenes/builtin_stage.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

using glm::dvec3;

namespace {

FailBox box(dvec3 min, dvec3 max, uint32_t material = 2) {
    return {(min + max) * 0.5, (max - min) * 0.5, 0.0, 0.0, material, dvec3(0.0)};
}

/// A floor with its top at y = 0.
FailBox floorBox(double halfX, double halfZ) {
    return box({-halfX, -0.5, -halfZ}, {halfX, 0.0, halfZ}, 1);
}

FailScene acne() {
    return {"fail-acne",
            "row 1: depths quantised at texel centres shadow a floor under a grazing light; all of "
            "it is lit",
            {floorBox(10, 10)},
            {{{-9.5, 0.4, 0.3}, 30.0, 6.0}},
            {0, 5, 12},
            {0, 0, 0}};
}

FailScene detachedShadow() {
    return {
        "fail-detached-shadow",
        "row 2: a bias in world units detaches shadows from a wall's foot (Dou et al., I3D 2014)",
        {floorBox(5, 5), box({-2, 0, -0.05}, {2, 1, 0.05}), box({2.5, 0, -1}, {2.54, 0.5, 1}, 3)},
        {{{0.5, 3.0, -2.5}, 12.0, 8.0}, {{-3.5, 2.0, 0.8}, 12.0, 5.0}},
        {2, 3, 5},
        {0, 0.2, 0}};
}

FailScene filterAcne() {
    FailScene s{"fail-filter-acne",
                "row 3: filter taps on slopes of 30 to 80 degrees compare with the wrong plane",
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
    FailScene s{"fail-oblique-undersampling",
                "row 4: equation 1 asks for too few texels where light grazes the receiver (Olsson "
                "2015, fig. 3b)",
                {floorBox(20, 3)},
                {{{-19.0, 0.6, 0.0}, 45.0, 20.0}},
                {10, 2.5, 6},
                {6, 0, 0}};
    for (int i = 0; i < 24; ++i)
        s.boxes.push_back(box({-17.5, 0.0, -2.9 + 0.24 * i}, {-17.4, 0.5, -2.78 + 0.24 * i}));
    return s;
}

FailScene missingTap() {
    FailScene s{"fail-missing-tap",
                "row 5: filter taps fall on pages that no cluster asked for; small shadows on a "
                "large floor",
                {floorBox(12, 12)},
                {{{0.0, 6.0, 0.0}, 25.0, 25.0}},
                {0, 2.0, 5},
                {0, 0, 0}};
    for (int i = 0; i < 7; ++i)
        for (int j = 0; j < 7; ++j)
            s.boxes.push_back(box({-6 + 2.0 * i - 0.15, 2.0, -6 + 2.0 * j - 0.15},
                                  {-6 + 2.0 * i + 0.15, 2.1, -6 + 2.0 * j + 0.15}));
    return s;
}

FailScene cubeSeam() {
    FailScene s{
        "fail-cube-seam",
        "row 8: bars across the edges and corners of the cube map's faces, as seen from the light",
        {box({-4, -0.5, -4}, {4, 0, 4}, 1), box({-4, 6, -4}, {4, 6.5, 4}, 1),
         box({-4.5, -0.5, -4}, {-4, 6.5, 4}, 1), box({-4, -0.5, -4.5}, {4, 6.5, -4}, 1)},
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
            "row 9: lights on a face, a centimetre off it and in a narrow gap; the near plane must "
            "not cut",
            {floorBox(4, 4), box({-4, 0, -4.3}, {4, 3, -4}, 1), box({-0.3, 0, -0.3}, {0.3, 1, 0.3}),
             box({1.5, 0, -1}, {1.7, 1.5, 1}, 3), box({1.8, 0, -1}, {2.0, 1.5, 1}, 3)},
            {{{0.0, 1.0, 0.0}, 10.0, 4.0},
             {{-2.0, 1.5, -3.99}, 10.0, 4.0},
             {{1.75, 0.75, 0.0}, 8.0, 3.0}},
            {3, 3, 5},
            {0, 0.5, 0}};
}

FailScene thinWall() {
    return {"fail-thin-wall",
            "row 10: light leaks through a wall of 2 cm when texels or offsets are larger than it",
            {floorBox(5, 4), box({-0.01, 0, -4}, {0.01, 3, 4}), box({-5, 3, -4}, {5, 3.2, 4}, 1),
             box({-5.2, -0.5, -4}, {-5, 3.2, 4}, 1), box({5, -0.5, -4}, {5.2, 3.2, 4}, 1),
             box({-5, -0.5, -4.2}, {5, 3.2, -4}, 1)},
            {{{-2.0, 2.0, 0.5}, 9.0, 5.0}, {{2.5, 1.2, -1.0}, 3.0, 1.0}},
            {0.6, 2.2, 3.8},
            {1.5, 1.0, -1}};
}

FailScene wires() {
    FailScene s{"fail-wires",
                "row 11: conservative voxels thicken wires of 12 mm until a grate stops every ray "
                "(Kaempe 2013)",
                {floorBox(4, 4)},
                {{{0.3, 3.5, 0.2}, 12.0, 9.0}},
                {0, 2.5, 5},
                {0, 0.5, 0}};
    for (int i = 0; i < 40; ++i) {
        const double t = -1.95 + 0.1 * i;
        s.boxes.push_back(box({t - 0.006, 1.2, -2}, {t + 0.006, 1.212, 2}));
        s.boxes.push_back(box({-2, 1.22, t - 0.006}, {2, 1.232, t + 0.006}));
    }
    return s;
}

FailScene selfShadow() {
    FailScene s{
        "fail-self-shadow", "row 12: voxels as thick as a tile shadow the tile they were made from",
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
    FailScene s{"fail-contact",
                "row 13: shadows of steps of 2 mm to 128 mm are lost within the ray's offset",
                {floorBox(4, 2)},
                {{{-4.5, 1.2, 0.0}, 14.0, 6.0}},
                {0, 1.5, 2.8},
                {0, 0, 0}};
    for (int i = 0; i < 7; ++i)
        s.boxes.push_back(box({-3 + 0.9 * i, 0.0, -1.0}, {-2.8 + 0.9 * i, 0.002 * (1 << i), 1.0}));
    return s;
}

FailScene silhouette() {
    FailScene s{"fail-silhouette",
                "rows 14, 15: outlines grow by up to a voxel; cubes of 0.5 m to 8 mm over a floor",
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
    FailScene s{
        "fail-far-origin",
        "row 18: the same wall and floor 100 km from the origin, where a float's last bit is 8 mm",
        {},
        {{o + dvec3(0.5, 3.0, -2.5), 12.0, 8.0}},
        o + dvec3(2, 3, 5),
        o};
    for (FailBox b : {floorBox(5, 5), box({-2, 0, -0.125}, {2, 1, 0.125}),
                      box({2.5, 0, -1}, {2.75, 0.5, 1}, 3)}) {
        b.center += o;
        s.boxes.push_back(b);
    }
    return s;
}

FailScene axisAligned() {
    FailScene s{
        "fail-axis-aligned",
        "rows 17, 19: rays with zero components and at 45 degrees, along faces and edges of cubes",
        {floorBox(4, 4)},
        {{{0.0, 3.0, 0.0}, 10.0, 7.0}, {{-3.0, 0.5, 0.0}, 10.0, 4.0}, {{3.0, 3.0, 3.0}, 10.0, 7.0}},
        {2.5, 4, 5},
        {0, 0.5, 0}};
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            if (i != 0 || j != 0)
                s.boxes.push_back(
                    box({2.0 * i - 0.5, 0.0, 2.0 * j - 0.5}, {2.0 * i + 0.5, 1.0, 2.0 * j + 0.5}));
    return s;
}

FailScene mover() {
    FailScene s{"fail-mover",
                "row 25: a box that moves is missing from the voxels; its shadow must move with it",
                {floorBox(5, 3)},
                {{{0.0, 4.0, 0.0}, 12.0, 12.0}},
                {0, 3.5, 5},
                {0, 0.3, 0}};
    FailBox b = box({-2.5, 0.8, -0.5}, {-1.5, 1.3, 0.5});
    b.velocity = {1.0, 0.0, 0.0};
    s.boxes.push_back(b);
    s.boxes.push_back(box({-0.2, 0.0, -2.0}, {0.2, 0.6, -1.6}, 3));
    return s;
}

FailScene unequalRanges() {
    FailScene s{
        "fail-unequal-ranges",
        "row 26: one light over everything among many small ones takes the resolution of all",
        {floorBox(30, 30)},
        {{{-25.0, 14.0, -25.0}, 200.0, 180.0}},
        {6, 5, 12},
        {0, 0, 0}};
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 5; ++j) {
            const double x = -25.0 + 10.0 * i, z = -20.0 + 10.0 * j;
            s.boxes.push_back(box({x - 0.15, 0.0, z - 0.15}, {x + 0.15, 1.5, z + 0.15}));
            s.lights.push_back({{x + 0.5, 0.8, z + 0.4}, 2.0, 0.6});
        }
    return s;
}

FailScene coplanar() {
    FailScene s{"fail-coplanar",
                "row 27: doubled, degenerate and flipped triangles, an open sheet with a hole",
                {floorBox(4, 4), box({-1.5, 0, -0.5}, {-0.5, 1, 0.5})},
                {{{0.0, 3.0, 1.0}, 10.0, 8.0}},
                {2, 3, 5},
                {0, 0.5, 0}};
    // The sheet: four flat boxes around a hole of 0.4 m.
    for (const FailBox& b :
         {box({0.5, 1, -0.8}, {2.1, 1, -0.2}, 3), box({0.5, 1, 0.2}, {2.1, 1, 0.8}, 3),
          box({0.5, 1, -0.2}, {1.1, 1, 0.2}, 3), box({1.5, 1, -0.2}, {2.1, 1, 0.2}, 3)})
        s.boxes.push_back(b);
    s.isMessy = true;
    return s;
}

FailScene borderLight() {
    FailScene s{"fail-border-light",
                "row 28: lights at the borders of pages and clusters, a range that ends on a wall",
                {floorBox(4, 4), box({4, -0.5, -4}, {4.5, 4, 4}, 1)},
                {{{0.0, 2.0, 0.0}, 4.0, 5.0}, {{-2.0, 1.0, 2.0}, 6.0, 4.0}},
                {-2, 3, 5},
                {1, 0.5, 0}};
    for (int i = -3; i <= 3; ++i) // seen from light 0, edges at quarters of the lower cube face
        s.boxes.push_back(box({0.25 * i, 1.0, -0.75}, {0.25 * i + 0.125, 1.0625, 0.75}));
    return s;
}

FailScene alphaMask() {
    FailScene s{"fail-alpha",
                "holes cut by a texture's alpha: a board that lies, one that leans, one that moves "
                "(Olsson 2015, sec. VI: no alpha masks)",
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

/// Of a post of height h at elevation e (tan e = 0.48 / sqrt(0.6^2 + 0.64^2)) the shadow is h / tan
/// e long. A bridge blocks from high above, a box moves through the sun.
FailScene sun() {
    FailScene s{"fail-sun",
                "beyond the paper (weakness 11): a sun has no place and no range; parallel shadows "
                "of posts, of a bridge high above and of what moves",
                {floorBox(12, 12), box({-0.1, 0, -0.1}, {0.1, 2.0, 0.1}),
                 box({-4.15, 0, 1.9}, {-4.05, 3.0, 2.0}, 3), box({-9, 8, -6}, {-5, 8.4, 6})},
                {{dvec3(0.0), 0.0, 3.0, {0.6, -0.48, 0.64}}},
                {3.0, 4.5, 10.0},
                {0.5, 0.5, 0}};
    s.boxes.push_back({{-2.0, 1.2, -2.5}, dvec3(0.3), 0.1, 0.05, 3, {0.8, 0.0, 0.3}});
    return s;
}

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

/// Returns where the segment from a to b enters and leaves the box, grown by `grow`, lies empty or
/// not.
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

} // namespace

std::vector<FailScene> failScenes() {
    return {acne(),       detachedShadow(), filterAcne(),    obliqueUndersampling(),
            missingTap(), cubeSeam(),       lightTouching(), thinWall(),
            wires(),      selfShadow(),     contact(),       silhouette(),
            farOrigin(),  axisAligned(),    mover(),         unequalRanges(),
            coplanar(),   borderLight(),    alphaMask(),     sun()};
}

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
    for (size_t i = 0; i < f.lights.size(); ++i) {
        const FailLight& light = f.lights[i];
        const std::string name = "light " + std::to_string(i);
        if (light.sunDirection != dvec3(0.0))
            s.sunLight(name, light.sunDirection, {1.0f, 0.97f, 0.9f}, light.intensity);
        else
            s.pointLight(name, light.position, light.range, {1.0f, 0.94f, 0.84f}, light.intensity);
    }
    s.camera(f.eye, f.target, 0.9, 0.05, 500.0);
    return s.take();
}

dvec3 lightPointOf(const FailScene& scene, const dvec3& pointWorld, int light, double timeSeconds) {
    const FailLight& source = scene.lights[size_t(light)];
    if (source.sunDirection == dvec3(0.0))
        return source.position;
    double reach = 0.0; // twice as far as anything is from the point
    for (const FailBox& b : scene.boxes) {
        const dvec3 now = b.center + b.velocity * timeSeconds;
        reach = std::max(reach, 2.0 * (glm::length(now - pointWorld) + glm::length(b.half)));
    }
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
    return mayHit ? std::nullopt : std::optional<bool>(true);
}

} // namespace shadowdag
