// SPDX-License-Identifier: Apache-2.0
// `necropolis`: a burial ground at night with 275 static lights of very unequal range, 101 moving
// ones and moving objects, after the scene NECROPOLIS of Olsson et al. 2015. Own geometry. More
// than 300 lines because it is one place.
#include "scenes/builtin_props.h"
#include "scenes/builtin_stage.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

using glm::dvec2;
using glm::dvec3;

namespace {

// Lanes part the ground into 6 x 6 cells; the four in the middle hold the temple.
constexpr int kCells = 6;
constexpr double kCellX = 17.0, kCellZ = 14.0, kLane = 3.0;
constexpr double kHalfX = kCells * kCellX / 2, kHalfZ = kCells * kCellZ / 2;
constexpr double kDuration = 20.0;

/// Height of the ground; level in the middle and along the lanes' crossings only roughly.
double ground(double x, double z) {
    const double r2 = x * x + z * z;
    const double away = r2 / (r2 + 400.0);
    return away *
           (0.7 * sinTurns(x / 43.0) * sinTurns(z / 37.0 + 0.2) + 0.35 * cosTurns((x - z) / 23.0));
}

dvec3 onGround(double x, double z) {
    return {x, ground(x, z), z};
}

struct Materials {
    uint32_t earth, path, stone, marble, dark, iron, bark, leaf, needle, roof, cloth, cloak, glow,
        wax;
};

Materials makeMaterials(Stage& s) {
    Materials m;
    m.earth = s.material("earth", {0.24f, 0.25f, 0.17f});
    m.path = s.material("path", {0.44f, 0.41f, 0.36f});
    m.stone = s.material("stone", {0.50f, 0.48f, 0.44f});
    m.marble = s.material("marble", {0.74f, 0.71f, 0.66f});
    m.dark = s.material("dark stone", {0.30f, 0.29f, 0.30f});
    m.iron = s.material("iron", {0.13f, 0.12f, 0.12f});
    m.bark = s.material("bark", {0.23f, 0.17f, 0.13f});
    m.leaf = s.material("leaf", {0.36f, 0.30f, 0.10f});
    m.needle = s.material("needle", {0.11f, 0.24f, 0.15f});
    m.roof = s.material("roof", {0.36f, 0.25f, 0.22f});
    m.cloth = s.material("red cloth", {0.48f, 0.08f, 0.08f});
    m.cloak = s.material("blue cloak", {0.13f, 0.18f, 0.36f});
    m.glow = s.material("glow", {0.8f, 0.6f, 0.4f}, {0.9f, 0.5f, 0.2f});
    m.wax = s.material("wax", {0.8f, 0.72f, 0.55f});
    return m;
}

/// A place for a light, in the frame of what carries it.
using Lamps = std::vector<dvec3>;

struct Kit { // meshes that are placed many times
    std::vector<int> graves, trees, cypresses;
    int mausoleum[2], mausoleumThin[2], panel, chain, bollard, column, candle, post, mast,
        sarcophagus, gate;
    Lamps mausoleumLamps[2];
    dvec3 postLight, mastLight;
};

/// A slab with a round head standing on y = 0, its face towards +Z.
void addHeadstone(MeshBuilder& m, double width, double height, double thickness, int segments) {
    const double r = width / 2, z = thickness / 2;
    std::vector<dvec2> outline = {{-r, 0}, {r, 0}};
    for (int i = 0; i <= segments; ++i)
        outline.emplace_back(r * cosTurns(0.5 * i / segments),
                             height - r + r * sinTurns(0.5 * i / segments));
    const size_t n = outline.size();
    for (size_t i = 0; i < n; ++i) {
        const dvec2 a = outline[i], b = outline[(i + 1) % n], c(0, height / 2);
        const uint32_t f0 = m.vertex(dvec3(a, z)), f1 = m.vertex(dvec3(b, z)),
                       fc = m.vertex(dvec3(c, z));
        const uint32_t b0 = m.vertex(dvec3(a, -z)), b1 = m.vertex(dvec3(b, -z)),
                       bc = m.vertex(dvec3(c, -z));
        m.triangle(fc, f0, f1);
        m.triangle(bc, b1, b0);
        m.quad(f0, b0, b1, f1);
    }
}

std::vector<int> makeGraves(Stage& s, const Materials& mat) {
    std::vector<int> graves;
    for (int kind = 0; kind < 6; ++kind) {
        MeshBuilder m("curved_grave_" + std::to_string(kind), kind & 1 ? mat.stone : mat.marble);
        addBox(m, {-0.5, -0.5, -0.22}, {0.5, 0.16, 0.22}, false);
        addBox(m, {-0.42, -0.5, 0.23}, {0.42, 0.1, 1.75}, false);
        if (kind == 0 || kind == 3) {
            m.moveTo({0, 0.16, 0});
            addHeadstone(m, 0.75, kind ? 1.2 : 0.9, 0.16, 24);
            m.moveTo({0, (kind ? 1.2 : 0.9) + 0.16 - 0.375, 0.08});
            addArchivolt(m, 0.27, 0.34, 0.035, 20);
        } else if (kind == 1) { // cross with a ring
            addBox(m, {-0.09, 0.16, -0.09}, {0.09, 1.7, 0.09});
            addBox(m, {-0.42, 1.15, -0.08}, {-0.091, 1.33, 0.08});
            addBox(m, {0.091, 1.15, -0.08}, {0.42, 1.33, 0.08});
            std::vector<dvec3> ring;
            for (int i = 0; i <= 28; ++i)
                ring.emplace_back(0.27 * cosTurns(i / 28.0), 1.24 + 0.27 * sinTurns(i / 28.0), 0);
            addTube(m, ring, 0.045, 8);
        } else if (kind == 2) { // obelisk
            const double a = 0.24, b = 0.15;
            const dvec3 c[8] = {{-a, 0.16, -a}, {a, 0.16, -a}, {a, 0.16, a}, {-a, 0.16, a},
                                {-b, 2.0, -b},  {b, 2.0, -b},  {b, 2.0, b},  {-b, 2.0, b}};
            addHexahedron(m, c);
            addLathe(m, {{0.21, 2.0}, {0.0, 2.25}}, 4);
            m.moveTo({0, 0.9, 0.17});
            addBall(m, {0, 0, 0}, 0.1, 14, 8);
        } else if (kind == 4) { // urn on a plinth
            addBox(m, {-0.25, 0.16, -0.2}, {0.25, 0.95, 0.2});
            m.moveTo({0, 0.95, 0});
            addLathe(m,
                     {{0.17, 0.0},
                      {0.17, 0.04},
                      {0.06, 0.09},
                      {0.05, 0.15},
                      {0.16, 0.28},
                      {0.22, 0.44},
                      {0.2, 0.58},
                      {0.12, 0.64},
                      {0.16, 0.7},
                      {0.17, 0.73},
                      {0.08, 0.8},
                      {0.03, 0.86},
                      {0.04, 0.9},
                      {0.0, 0.95}},
                     22, 0.05, 11);
        } else { // broken column
            addBox(m, {-0.3, 0.16, -0.3}, {0.3, 0.3, 0.3});
            m.moveTo({0, 0.3, 0});
            std::vector<dvec2> shaft;
            for (int i = 0; i <= 8; ++i)
                shaft.emplace_back(0.21 - 0.004 * i, 0.16 * i);
            addLathe(m, shaft, 24, 0.07, 12);
            addLathe(m, {{0.178, 1.28}, {0.08, 1.38}, {0.0, 1.3}}, 24, 0.1, 5);
        }
        graves.push_back(s.mesh(m));
    }
    return graves;
}

void makeMausolea(Stage& s, const Materials& mat, Kit& kit) {
    for (int kind = 0; kind < 2; ++kind) {
        const double w = kind ? 3.6 : 4.6, d = kind ? 4.4 : 5.6, h = kind ? 3.0 : 3.5;
        const std::string tag = std::to_string(kind);
        MeshBuilder m("curved_mausoleum_" + tag, mat.stone),
            thin("thin_mausoleum_" + tag, mat.iron);
        for (int step = 0; step < 3; ++step) {
            const double out = 0.75 - 0.25 * step;
            addBox(m, {-w / 2 - out, step ? 0.2 * step - 0.001 : -1.0, -d / 2 - out},
                   {w / 2 + out, 0.2 * (step + 1), d / 2 + out + 1.2}, false);
        }
        const double y0 = 0.6, back = -d / 2,
                     front = d / 2 - 1.0; // the cella; the porch stands before it
        const auto wall = [&](const dvec3& at, double yaw, double span, double radius,
                              double jamb) {
            m.setTransform(placement(at, yaw));
            addArchedWall(m, span, radius, jamb, h, 0.35, 20);
            m.setTransform(m.transform() * placement({span / 2, jamb, 0.175}));
            addArchivolt(m, radius + 0.015, radius + 0.18, 0.06, 20);
        };
        m.setMaterial(kind ? mat.dark : mat.marble);
        wall({-w / 2 + 0.2, y0, front - 0.175}, 0.0, w - 0.4, 0.65, 1.7);
        wall({w / 2 - 0.2, y0, back + 0.175}, 0.5, w - 0.4, 0.4, 1.9);
        for (int side = 0; side < 2; ++side) { // two windows a side
            const double f = side ? -1 : 1, length = (front - back - 0.4) / 2;
            for (int k = 0; k < 2; ++k)
                wall({f * (w / 2 - 0.175), y0,
                      side ? back + 0.2 + k * length : front - 0.2 - k * length},
                     side ? -0.25 : 0.25, length, 0.36, 1.8);
            m.setTransform(glm::dmat4(1.0));
            for (const double z : {back + 0.2, front - 0.2}) // corner posts
                addBox(m, {f * (w / 2 - 0.2) - 0.21, y0, z - 0.21},
                       {f * (w / 2 - 0.2) + 0.21, y0 + h, z + 0.21});
        }
        m.setMaterial(mat.marble);
        const int columns = kind ? 2 : 4;
        for (int c = 0; c < columns; ++c) {
            const double x = (-0.5 + double(c) / (columns - 1)) * (w - 0.5);
            m.moveTo({x, y0, d / 2 + 0.1});
            addColumn(m, h - 0.01, 0.21, 24);
        }
        m.moveTo({0, y0 + h, 0});
        m.setMaterial(mat.stone);
        addBox(m, {-w / 2 - 0.15, 0, back - 0.15}, {w / 2 + 0.15, 0.4, d / 2 + 0.45});
        addBox(m, {-w / 2 - 0.3, 0.4, back - 0.3}, {w / 2 + 0.3, 0.52, d / 2 + 0.6});
        const double z0 = back - 0.2, z1 = d / 2 + 0.5, rise = 0.32 * w, top = 0.52;
        for (const double z : {z0, z1}) {
            const uint32_t a = m.vertex({-w / 2 - 0.2, top, z}),
                           b = m.vertex({w / 2 + 0.2, top, z}), c = m.vertex({0, top + rise, z});
            if (z == z1)
                m.triangle(a, b, c);
            else
                m.triangle(a, c, b);
        }
        MeshBuilder tiles("curved_mausoleum_roof_" + tag, mat.roof);
        const double half = w / 2 + 0.2, slope = glm::sqrt(half * half + rise * rise),
                     length = z1 - z0 + 0.3;
        for (int side = 0; side < 2; ++side) {
            const double f = side ? -1 : 1;
            const dvec3 down(f * half / slope, -rise / slope, 0),
                up(f * rise / slope, half / slope, 0);
            const dvec3 along(0, 0, f * -1.0);
            const glm::dmat4 frame = frameOf(
                {0, y0 + h + top + rise + 0.15, side ? z0 - 0.15 : z1 + 0.15}, along, up, down);
            m.setTransform(frame);
            tiles.setTransform(frame);
            addTiledSlope(m, tiles, length, slope + 0.25);
        }
        m.setTransform(placement({0, y0 + h + top + rise + 0.12, z1 - 0.1}));
        m.setMaterial(mat.marble);
        addLathe(m,
                 {{0.2, 0.0},
                  {0.2, 0.15},
                  {0.08, 0.22},
                  {0.16, 0.4},
                  {0.2, 0.55},
                  {0.1, 0.68},
                  {0.0, 0.75}},
                 18);
        // Gate of bars in the door, half open; sarcophagus inside.
        for (int i = 0; i < 9; ++i) {
            thin.setTransform(placement({-0.64, y0, front}, 0.18));
            addTube(thin, {{0.14 * i, 0.05, 0}, {0.14 * i, 1.75, 0}}, 0.018, 6);
        }
        addTube(thin, {{0, 0.2, 0}, {1.14, 0.2, 0}}, 0.025, 6);
        addTube(thin, {{0, 1.5, 0}, {1.14, 1.5, 0}}, 0.025, 6);
        m.moveTo({0, y0, (back + front) / 2});
        addBox(m, {-0.5, 0, -1.0}, {0.5, 0.8, 1.0}, false);
        addBox(m, {-0.58, 0.8, -1.08}, {0.58, 0.95, 1.08});
        // Lamps: on both flanks of the porch and one hanging inside.
        for (const double f : {-1.0, 1.0}) {
            thin.setTransform(placement({f * (w / 2 + 0.0), y0 + 2.1, front - 0.3}, 0.25 * f));
            const dvec3 at = addWallLamp(thin);
            kit.mausoleumLamps[kind].push_back(dvec3(thin.transform() * glm::dvec4(at, 1.0)));
        }
        thin.setTransform(placement({0, y0 + h, (back + front) / 2}));
        addChain(thin, 0.8, 0.018, 6, 4);
        addLathe(thin, {{0.0, -0.86}, {0.14, -0.9}, {0.15, -0.88}, {0.05, -0.8}, {0.0, -0.78}}, 12);
        kit.mausoleumLamps[kind].push_back({0, y0 + h - 1.25, (back + front) / 2});
        kit.mausoleum[kind] = s.mesh(m);
        kit.mausoleumThin[kind] = s.mesh(thin);
        kit.trees.push_back(s.mesh(tiles)); // taken out again by makeKit
    }
}

Kit makeKit(Stage& s, const Materials& mat, int roofs[2]) {
    Kit kit;
    kit.graves = makeGraves(s, mat);
    makeMausolea(s, mat, kit);
    roofs[0] = kit.trees[0];
    roofs[1] = kit.trees[1];
    kit.trees.clear();
    for (int kind = 0; kind < 5; ++kind) {
        MeshBuilder t("thin_tree_" + std::to_string(kind));
        addTree(t, mat.bark, mat.leaf, 400 + uint64_t(kind), 6.0 + 0.6 * kind, 3200, 0.32);
        kit.trees.push_back(s.mesh(t));
        MeshBuilder c("thin_cypress_" + std::to_string(kind));
        addCypress(c, mat.bark, mat.needle, 500 + uint64_t(kind), 6.5 + 0.7 * kind, 2100);
        kit.cypresses.push_back(s.mesh(c));
    }
    MeshBuilder p("thin_fence_panel", mat.iron); // 2 m of iron railing along X
    for (const double y : {0.15, 1.0})
        addTube(p, {{-1, y, 0}, {1, y, 0}}, 0.024, 6);
    for (int i = 0; i < 12; ++i) {
        p.moveTo({-1 + (i + 0.5) / 6.0, 0, 0});
        addTube(p, {{0, -0.3, 0}, {0, 1.15, 0}}, i ? 0.018 : 0.03, 6);
        addLathe(p, {{0.018, 1.15}, {0.042, 1.2}, {0.03, 1.27}, {0.0, 1.36}}, 6);
    }
    kit.panel = s.mesh(p);
    MeshBuilder b("curved_bollard", mat.stone);
    addLathe(b,
             {{0.2, -0.4},
              {0.2, 0.12},
              {0.13, 0.18},
              {0.11, 0.7},
              {0.16, 0.76},
              {0.15, 0.84},
              {0.08, 0.92},
              {0.0, 0.95}},
             16);
    kit.bollard = s.mesh(b);
    MeshBuilder c("thin_chain", mat.iron); // between bollards 2.4 m apart along X
    addHangingChain(c, {0.13, 0.66, 0}, {2.27, 0.66, 0}, 0.32, 0.024);
    kit.chain = s.mesh(c);
    MeshBuilder k("curved_column", mat.marble);
    addColumn(k, 4.2, 0.32, 36);
    kit.column = s.mesh(k);
    // A candle in a niche that is open to the front; the light lies 0.55 above the ground.
    MeshBuilder w("curved_candle", mat.stone);
    for (const double x : {-0.21, 0.15})
        addBox(w, {x, -0.1, -0.16}, {x + 0.06, 0.74, 0.1});
    addBox(w, {-0.21, -0.1, -0.22}, {0.21, 0.74, -0.16});
    addBox(w, {-0.24, 0.74, -0.25}, {0.24, 0.8, 0.13});
    w.setMaterial(mat.wax);
    addLathe(w, {{0.07, 0.0}, {0.07, 0.2}, {0.055, 0.22}, {0.0, 0.21}}, 14);
    w.setMaterial(mat.glow);
    addLathe(w, {{0.012, 0.21}, {0.022, 0.24}, {0.0, 0.29}}, 8);
    kit.candle = s.mesh(w);
    MeshBuilder l("thin_lamp_post", mat.iron);
    kit.postLight = addLampPost(l, 3.6);
    kit.post = s.mesh(l);
    MeshBuilder t("thin_lamp_mast", mat.iron);
    kit.mastLight = addLampPost(t, 8.0);
    kit.mast = s.mesh(t);
    MeshBuilder g("curved_sarcophagus", mat.marble);
    addBox(g, {-0.7, -0.6, -1.3}, {0.7, 0.15, 1.3}, false);
    addBox(g, {-0.55, 0.15, -1.1}, {0.55, 0.9, 1.1}, false);
    addBox(g, {-0.65, 0.9, -1.2}, {0.65, 1.0, 1.2});
    addSheet(g, 16, 14, [](double u, double v) { // rounded lid
        return dvec3(-0.6 * cosTurns(0.5 * u), 1.0 + 0.28 * sinTurns(0.5 * u), 1.15 - 2.3 * v);
    });
    for (int i = 0; i < 6; ++i)
        for (const double f : {-1.0, 1.0}) {
            g.moveTo({f * 0.56, 0.15, -0.95 + 0.38 * i});
            addLathe(g, {{0.07, 0.0}, {0.05, 0.08}, {0.045, 0.65}, {0.07, 0.75}}, 8);
        }
    kit.sarcophagus = s.mesh(g);
    return kit;
}

/// Counts the static lights and keeps their ranges very unequal.
struct Lighting {
    Stage& s;
    int index = 0;
    void add(const dvec3& at, double range, glm::vec3 color, double intensity) {
        s.pointLight("light " + std::to_string(index++), at, range, color, intensity);
    }
};

const glm::vec3 kWarm(1.0f, 0.76f, 0.48f), kAmber(1.0f, 0.62f, 0.32f), kMoon(0.66f, 0.78f, 1.0f),
    kGreen(0.62f, 0.95f, 0.86f);

void addTerrain(Stage& s, const Materials& mat) {
    MeshBuilder m("flat_terrain", mat.earth);
    const int nx = 260, nz = 220;
    const double sx = kHalfX + 2, sz = kHalfZ + 2;
    std::vector<uint32_t> ids;
    for (int j = 0; j <= nz; ++j)
        for (int i = 0; i <= nx; ++i)
            ids.push_back(m.vertex(onGround(sx * (2.0 * i / nx - 1), sz * (2.0 * j / nz - 1))));
    for (int j = 0; j < nz; ++j)
        for (int i = 0; i < nx; ++i) {
            const double x = sx * (2.0 * (i + 0.5) / nx - 1), z = sz * (2.0 * (j + 0.5) / nz - 1);
            const double fx = x / kCellX, fz = z / kCellZ;
            const double dx = std::abs(fx - std::floor(fx + 0.5)) * kCellX;
            const double dz = std::abs(fz - std::floor(fz + 0.5)) * kCellZ;
            m.setMaterial(dx < kLane / 2 || dz < kLane / 2 ||
                                  (std::abs(x) < kCellX && std::abs(z) < kCellZ)
                              ? mat.path
                              : mat.earth);
            const size_t a = size_t(j * (nx + 1) + i), b = a + size_t(nx) + 1;
            m.quad(ids[a], ids[b], ids[b + 1], ids[a + 1]);
        }
    s.placeOnce(m);
}

/// The round temple in the middle: steps, 20 columns, entablature, dome with oculus lantern and
/// beacon.
void addTemple(Stage& s, const Materials& mat, Lighting& lights) {
    MeshBuilder m("curved_temple", mat.marble);
    std::vector<dvec2> steps = {{9.2, -1.0}};
    for (int i = 0; i < 5; ++i) {
        steps.emplace_back(9.2 - 0.4 * i, 0.2 * (i + 1));
        steps.emplace_back(8.8 - 0.4 * i, 0.2 * (i + 1));
    }
    steps.emplace_back(0.0, 1.0);
    addLathe(m, steps, 96);
    for (int i = 0; i < 20; ++i) {
        const double t = i / 20.0;
        m.moveTo({6.4 * cosTurns(t), 1.0, 6.4 * sinTurns(t)}, -t);
        addColumn(m, 5.2, 0.42, 40);
    }
    m.moveTo({0, 0, 0});
    addLathe(m,
             {{5.9, 6.2},
              {6.95, 6.2},
              {6.95, 6.7},
              {7.05, 6.75},
              {7.05, 7.1},
              {7.4, 7.3},
              {7.4, 7.5},
              {6.6, 7.8}},
             96);
    addLathe(m, {{5.6, 7.5}, {5.9, 6.2}}, 96);
    std::vector<dvec2> dome, inside;
    for (int i = 0; i <= 24; ++i) {
        const double t = 0.235 * i / 24;
        dome.emplace_back(6.6 * cosTurns(t), 7.8 + 5.6 * sinTurns(t));
        inside.emplace_back(5.6 * cosTurns(0.235 - t), 7.5 + 5.2 * sinTurns(0.235 - t));
    }
    m.setMaterial(mat.roof);
    addLathe(m, dome, 96, 0.02, 24);
    m.setMaterial(mat.stone);
    addLathe(m, inside, 96);
    // Lantern over the oculus: eight little columns, a cap, and the bowl of the beacon.
    m.setMaterial(mat.marble);
    addLathe(m, {{0.55, 12.7}, {0.6, 13.6}, {1.1, 13.6}, {1.1, 13.3}}, 32);
    for (int i = 0; i < 8; ++i) {
        const double t = i / 8.0;
        m.moveTo({0.9 * cosTurns(t), 13.6, 0.9 * sinTurns(t)});
        addColumn(m, 1.6, 0.1, 16);
    }
    m.moveTo({0, 0, 0});
    addLathe(m,
             {{0.0, 15.2},
              {1.1, 15.2},
              {1.2, 15.4},
              {0.9, 15.7},
              {0.3, 16.1},
              {0.15, 17.2},
              {0.55, 17.6},
              {0.7, 17.9},
              {0.6, 17.9},
              {0.0, 17.75}},
             32);
    s.placeOnce(m);
    lights.add({0, 18.6, 0}, 120.0, kWarm, 150.0); // the one that covers nearly everything
    // Altar with fire, curtains between some columns, a moving ring of lamps under the dome.
    MeshBuilder altar("curved_altar", mat.dark);
    altar.moveTo({0, 1.0, 0});
    addLathe(
        altar,
        {{0.9, 0.0}, {0.9, 0.2}, {0.5, 0.35}, {0.45, 0.9}, {0.8, 1.15}, {0.85, 1.25}, {0.0, 1.2}},
        32);
    s.placeOnce(altar);
    lights.add({0, 2.9, 0}, 22.0, kAmber, 9.0);
    MeshBuilder veil("thin_temple_veils", mat.cloth);
    for (int i = 0; i < 20; i += 2) {
        const double t = (i + 0.5) / 20.0;
        veil.setTransform(placement({6.4 * cosTurns(t), 1.0, 6.4 * sinTurns(t)}, 0.25 - t));
        addSheet(veil, 24, 28, [&](double u, double v) {
            const double gather = 1.0 - 0.5 * sinTurns(0.5 * std::min(1.0, v * 1.3));
            return dvec3((u - 0.5) * 1.15 * gather, 5.1 - 4.6 * v,
                         0.09 * sinTurns(4 * u + 0.2 * v));
        });
    }
    s.placeOnce(veil);
    MeshBuilder ring("thin_chandelier", mat.iron);
    std::vector<dvec3> hoop;
    for (int i = 0; i <= 48; ++i)
        hoop.emplace_back(2.2 * cosTurns(i / 48.0), 0, 2.2 * sinTurns(i / 48.0));
    addTube(ring, hoop, 0.05, 8);
    for (int i = 0; i < 8; ++i) {
        const double t = i / 8.0;
        addHangingChain(ring, {0.3 * cosTurns(t), 4.2, 0.3 * sinTurns(t)},
                        {2.2 * cosTurns(t), 0.0, 2.2 * sinTurns(t)}, 0.15, 0.03);
        ring.moveTo({2.2 * cosTurns(t), 0.05, 2.2 * sinTurns(t)});
        addLathe(ring, {{0.05, 0.0}, {0.16, 0.08}, {0.17, 0.12}, {0.0, 0.1}}, 12);
        ring.moveTo({0, 0, 0});
    }
    const int chandelier = s.place(s.mesh(ring), {0, 6.6, 0});
    s.animateYaw(chandelier, 12.0, kDuration);
    for (int i = 0; i < 8; ++i) {
        const double t = (i + 0.5) / 8.0; // between the columns, at rest
        lights.add({7.7 * cosTurns(t), 3.4, 7.7 * sinTurns(t)}, 9.0, kAmber, 2.2);
    }
}

void addEnclosure(Stage& s, const Kit& kit, double x0, double z0, double x1, double z1) {
    const int nx = int((x1 - x0) / 2), nz = int((z1 - z0) / 2);
    const double ox = ((x1 - x0) - 2.0 * nx) / 2, oz = ((z1 - z0) - 2.0 * nz) / 2;
    for (int i = 0; i < nx; ++i)
        for (const double z : {z0 + oz, z1 - oz}) {
            if (i == nx / 2 && z > (z0 + z1) / 2)
                continue; // the way in
            s.place(kit.panel, onGround(x0 + ox + 2.0 * i + 1, z), 0.0);
        }
    for (int i = 0; i < nz; ++i)
        for (const double x : {x0 + ox, x1 - ox})
            s.place(kit.panel, onGround(x, z0 + oz + 2.0 * i + 1), 0.25);
}

void addCells(Stage& s, const Kit& kit, const int (&roofs)[2], Lighting& lights) {
    HashRandom random(77);
    int candles = 0;
    const auto candle = [&](const dvec3& at) {
        s.place(kit.candle, at);
        const double first = random.unit();
        const double range = 2.5 + 3.5 * first * random.unit();
        lights.add(at + dvec3(0, 0.55, 0), range, candles++ % 5 == 4 ? kGreen : kAmber,
                   0.05 * range * range);
    };
    const auto mausoleum = [&](int kind, const dvec3& at, double yaw) {
        s.place(kit.mausoleum[kind], at, yaw);
        s.place(kit.mausoleumThin[kind], at, yaw);
        s.place(roofs[kind], at, yaw);
        for (size_t i = 0; i < kit.mausoleumLamps[kind].size(); ++i)
            lights.add(dvec3(placement(at, yaw) * glm::dvec4(kit.mausoleumLamps[kind][i], 1.0)),
                       i == 2 ? 6.0 : random.between(8.0, 11.0), kWarm, i == 2 ? 1.2 : 2.4);
    };
    int cell = 0;
    for (int j = 0; j < kCells; ++j)
        for (int i = 0; i < kCells; ++i) {
            if ((i == 2 || i == 3) && (j == 2 || j == 3))
                continue;
            const double x0 = -kHalfX + i * kCellX + kLane / 2 + 0.4,
                         x1 = x0 + kCellX - kLane - 0.8;
            const double z0 = -kHalfZ + j * kCellZ + kLane / 2 + 0.4,
                         z1 = z0 + kCellZ - kLane - 0.8;
            const double xm = (x0 + x1) / 2, zm = (z0 + z1) / 2;
            const int kind = (i * 2 + j * 3 + i * j) % 4;
            ++cell;
            if (kind == 0) { // mausolea among cypresses
                mausoleum(0, onGround(x0 + 3.4, zm - 0.4), 0.0);
                mausoleum(1, onGround(x1 - 3.0, zm - 0.6), 0.0);
                for (int k = 0; k < 5; ++k) {
                    const double scale = random.between(0.85, 1.05);
                    s.place(kit.cypresses[size_t(k + cell) % 5],
                            onGround(x0 + 0.6 + k * (x1 - x0 - 1.2) / 4, z0 + 0.5), random.unit(),
                            scale);
                }
                for (int k = 0; k < 5; ++k) { // bollards and chains in front
                    s.place(kit.bollard, onGround(x0 + 0.8 + 2.4 * k, z1 + 0.1));
                    if (k < 4)
                        s.place(kit.chain, onGround(x0 + 0.8 + 2.4 * k, z1 + 0.1));
                }
                candle(onGround(xm + 0.45, zm + 3.2));
                s.place(kit.trees[size_t(cell + 2) % 5], onGround(xm + 0.4, z0 + 2.0),
                        random.unit(), 0.8);
            } else if (kind == 1 || kind == 3) { // rows of graves in a railing
                const int rows = 3, columns = 8;
                for (int r = 0; r < rows; ++r)
                    for (int c = 0; c < columns; ++c) {
                        const double x = x0 + 1.2 + (x1 - x0 - 2.4) * c / (columns - 1);
                        const double z = z0 + 1.0 + r * 3.2;
                        const dvec3 at = onGround(x, z) - dvec3(0, 0.03, 0);
                        s.place(kit.graves[(size_t(r) * 5 + size_t(c) * 3 + size_t(cell)) % 6], at,
                                random.between(-0.012, 0.012));
                        if ((r + c + cell) % 3 == 0)
                            candle(at + dvec3(0.0, 0.1, 1.3));
                    }
                addEnclosure(s, kit, x0, z0, x1, z1);
                for (int k = 0; k < 3; ++k) {
                    const double scale = random.between(0.75, 1.0);
                    s.place(
                        kit.trees[size_t(k + cell) % 5],
                        onGround(x0 + 2.1 + k * (x1 - x0 - 3.0) / 2.4, z0 + 3.3 + 3.2 * (k & 1)),
                        random.unit(), scale);
                }
            } else { // a ruined colonnade around sarcophagi
                for (int k = 0; k < 6; ++k)
                    for (const double z : {z0 + 0.9, z1 - 0.9})
                        if ((k + cell) % 7 != 3)
                            s.place(kit.column, onGround(x0 + 0.8 + k * (x1 - x0 - 1.6) / 5, z) -
                                                    dvec3(0, 0.25, 0));
                for (int k = 0; k < 4; ++k) {
                    const dvec3 at = onGround(x0 + 2.2 + k * (x1 - x0 - 4.4) / 3, zm);
                    s.place(kit.sarcophagus, at, 0.0);
                    candle(at + dvec3(0, 0, 1.62));
                }
                s.place(kit.trees[size_t(cell) % 5], onGround(xm - 3.0, z0 + 2.8), random.unit(),
                        1.0);
                s.place(kit.trees[size_t(cell + 3) % 5], onGround(xm + 3.0, z1 - 2.8),
                        random.unit(), 0.9);
                for (int k = 0; k < 5; ++k) {
                    s.place(kit.bollard, onGround(x0 + 0.8 + 2.4 * k, z1 + 0.1));
                    if (k < 4)
                        s.place(kit.chain, onGround(x0 + 0.8 + 2.4 * k, z1 + 0.1));
                }
            }
        }
    // Masts on the crossings of the lanes, posts along them, railings around it all.
    const auto post = [&](int mesh, const dvec3& head, const dvec3& at, double yaw, double range,
                          double intensity) {
        s.place(mesh, at, yaw);
        lights.add(dvec3(placement(at, yaw) * glm::dvec4(head, 1.0)), range, kWarm, intensity);
    };
    int masts = 0;
    for (int j = 1; j < kCells; ++j)
        for (int i = 1; i < kCells; ++i)
            if ((i + j) % 2 == 0 && !(i == 3 && j == 3)) {
                post(kit.mast, kit.mastLight,
                     onGround(-kHalfX + i * kCellX + 1.2, -kHalfZ + j * kCellZ + 1.2),
                     0.125 * (i + j), 38.0, 30.0);
                ++masts;
            }
    for (int j = 1; j < kCells; ++j)
        for (int i = 0; i < kCells; ++i) {
            if (j == 3 && (i == 2 || i == 3))
                continue;
            post(kit.post, kit.postLight,
                 onGround(-kHalfX + (i + 0.5) * kCellX, -kHalfZ + j * kCellZ + 1.25), 0.25, 17.0,
                 5.5);
        }
    addEnclosure(s, kit, -kHalfX, -kHalfZ, kHalfX, kHalfZ);
    for (int k = 0; k < 12; ++k) { // cypresses around the temple
        const double turn = (k + 0.5) / 12.0;
        s.place(kit.cypresses[size_t(k) % 5],
                onGround(12.3 * cosTurns(turn), 11.2 * sinTurns(turn)), turn, 0.9);
    }
    // A tall moonlit mast in one corner: the second light that reaches over half of the place.
    const dvec3 corner = onGround(-kHalfX + 1.4, -kHalfZ + 1.4);
    s.place(kit.mast, corner, 0.0, 2.2);
    lights.add(corner + 2.2 * kit.mastLight, 75.0, kMoon, 110.0);
    // Candles on the temple's steps and along the lanes make up the number.
    for (int k = 0; lights.index < 275; ++k) {
        const double turn = k * 0.381966;
        const double r = k < 40 ? 8.2 : 10.5 + 1.2 * (k % 3);
        const double x = r * cosTurns(turn), z = r * sinTurns(turn);
        candle(k < 40 ? dvec3(x, 0.6, z) : onGround(x, z));
    }
}

void addMovers(Stage& s, const Materials& mat) {
    // 5 processions of 9 bearers walk the lanes; 56 wisps drift over the graves: 101 moving lights.
    MeshBuilder b("curved_bearer", mat.cloak);
    addLathe(b,
             {{0.36, 0.02},
              {0.33, 0.3},
              {0.27, 0.7},
              {0.25, 1.05},
              {0.28, 1.3},
              {0.2, 1.45},
              {0.1, 1.5}},
             40, 0.1, 8);
    addBall(b, {0, 1.6, 0}, 0.125, 20, 12);
    b.setMaterial(mat.bark);
    addTube(b, {{0.38, 0.1, 0}, {0.38, 2.3, 0}, {0.42, 2.42, 0}, {0.65, 2.45, 0}}, 0.025, 6);
    addTube(b, {{0.15, 1.3, 0}, {0.38, 1.2, 0}}, 0.05, 6);
    b.setMaterial(mat.iron);
    addLathe(b, {{0.0, 2.2}, {0.02, 2.2}}, 4);
    b.moveTo({0.65, 0, 0});
    addTube(b, {{0, 2.45, 0}, {0, 2.3, 0}}, 0.012, 5);
    addLathe(b, {{0.0, 2.22}, {0.13, 2.2}, {0.14, 2.215}, {0.05, 2.3}, {0.0, 2.31}}, 12);
    const int bearer = s.mesh(b);
    int index = 0;
    for (int group = 0; group < 5; ++group) {
        const bool alongX = group != 2;
        const double lane = alongX ? (group - 2) * kCellZ : -kCellX;
        const double from = alongX ? -34.0 : -28.0, to = from + (alongX ? 44.0 : 40.0);
        const double f = group & 1 ? -1 : 1;
        std::vector<float> times;
        std::vector<dvec3> keys;
        for (int k = 0; k <= 10; ++k) {
            times.push_back(float(kDuration * k / 10));
            const double along = f * (from + (to - from) * k / 10);
            keys.push_back(alongX ? dvec3(along, 0, lane) : dvec3(lane, 0, along));
        }
        for (auto& key : keys)
            key.y = ground(key.x, key.z) + 0.25; // stiff groups glide a little above the waves
        const int node = s.group("procession " + std::to_string(group), keys.front());
        s.animateTranslation(node, times, keys);
        for (int k = 0; k < 9; ++k) {
            const double back = -f * 1.7 * (k / 2), side = k & 1 ? 0.55 : -0.55;
            const dvec3 at = alongX ? dvec3(back, 0, side) : dvec3(side, 0, back);
            const double yaw = (k & 1 ? 0.75 : 0.25) + (alongX ? 0.0 : 0.25);
            s.place(bearer, at, yaw, 1.0, node);
            const dvec3 lamp = dvec3(placement(at, yaw) * glm::dvec4(0.65, 1.9, 0, 1));
            s.pointLight("bearer " + std::to_string(index++), lamp, 7.0, kAmber, 1.4, node);
        }
    }
    MeshBuilder w("thin_wisp", mat.iron);
    addLathe(w, {{0.0, 0.2}, {0.1, 0.2}, {0.11, 0.22}, {0.04, 0.3}, {0.0, 0.31}}, 10);
    for (int i = 0; i < 6; ++i) {
        std::vector<dvec3> rib;
        for (int k = 0; k <= 6; ++k)
            rib.emplace_back((0.06 + 0.16 * sinTurns(0.5 * k / 6)) * cosTurns(i / 6.0),
                             0.3 + 0.4 * k / 6,
                             (0.06 + 0.16 * sinTurns(0.5 * k / 6)) * sinTurns(i / 6.0));
        addTube(w, rib, 0.015, 5);
    }
    const int wisp = s.mesh(w);
    HashRandom random(501);
    for (int k = 0; k < 56; ++k) {
        const double cx = random.between(-kHalfX + 6, kHalfX - 6),
                     cz = random.between(-kHalfZ + 5, kHalfZ - 5);
        const double push =
            cx * cx + cz * cz < 110.0 ? 12.0 : 0.0; // around the temple, not through it
        const double rx = random.between(2.0, 5.0), rz = random.between(2.0, 4.0),
                     phase = random.unit();
        const double y = random.between(7.5, 9.5), turns = random.unit() < 0.5 ? 1.0 : -1.0;
        std::vector<float> times;
        std::vector<dvec3> keys;
        for (int q = 0; q <= 20; ++q) {
            const double t = phase + turns * q / 20.0;
            times.push_back(float(kDuration * q / 20));
            keys.emplace_back(cx + (cx < 0 ? -push : push) + rx * cosTurns(t),
                              y + 0.4 * sinTurns(3 * t), cz + rz * sinTurns(t));
        }
        const int node = s.group("wisp " + std::to_string(k), keys.front());
        s.animateTranslation(node, times, keys);
        s.place(wisp, {0, 0, 0}, 0.0, 1.0, node);
        s.pointLight("wisp " + std::to_string(k), {0, -0.12, 0}, random.between(9.0, 14.0),
                     k & 1 ? kGreen : kMoon, 3.0, node);
    }
}

} // namespace

Scene makeNecropolis() {
    Stage s("necropolis");
    const Materials mat = makeMaterials(s);
    s.cameraPath({{0.0, {-33, 13, 30}, {-2, 3.5, -3}},
                  {4.0, {-24, 9.5, 24}, {0, 3.5, 0}},
                  {8.0, {-17.3, 3.6, 15.5}, {-6, 3.0, 8}},
                  {11.0, {-8.5, 2.6, 13.8}, {4, 3.4, 5}},
                  {14.0, {4.0, 2.2, 14.2}, {12, 2.4, 16}},
                  {17.0, {14.0, 3.0, 14.2}, {17, 4.0, 0}},
                  {20.0, {17.2, 5.0, 8.0}, {2, 5.0, -8}}},
                 0.9, 0.1);
    Lighting lights{s};
    int roofs[2];
    const Kit kit = makeKit(s, mat, roofs);
    addTerrain(s, mat);
    addTemple(s, mat, lights);
    addCells(s, kit, roofs, lights);
    addMovers(s, mat);
    return s.take();
}

} // namespace shadowdag
