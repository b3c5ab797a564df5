// SPDX-License-Identifier: Apache-2.0
// `atrium`: a two-storey colonnaded court of 25 m after Crytek Sponza (Frank Meinl, 2010), the
// scene of Olsson et al. 2015 with 302 K triangles and 65 lights. Own geometry; nothing is copied.
// More than 300 lines because it is one building.
#include "scenes/builtin_props.h"
#include "scenes/builtin_stage.h"

#include <algorithm>

namespace shadowdag {

using glm::dvec2;
using glm::dvec3;

namespace {

// Plan: columns stand on a rectangle of half size kCourtX x kCourtZ; the arcade behind it is kDepth
// deep.
constexpr double kCourtX = 9.0, kCourtZ = 3.3, kDepth = 3.0;
constexpr int kLongBays = 7, kShortBays = 3;
constexpr double kLongSpan = 2 * kCourtX / kLongBays, kShortSpan = 2 * kCourtZ / kShortBays;
constexpr double kWall = 0.5; // thickness of arcade walls
constexpr double kInnerX = kCourtX + kDepth, kInnerZ = kCourtZ + kDepth; // inside of the outer wall
constexpr double kSpring = 2.95, kSlab = 4.6, kUpper = 5.0; // heights of the lower storey
constexpr double kUpperSpring = 2.25, kUpperTop = 3.7;      // above kUpper
constexpr double kTurn[4] = {0.0, 0.25, 0.5, 0.75};

struct Materials {
    uint32_t stone, paleStone, darkStone, tileLight, tileDark, roof, wood, metal, red, blue, leaf,
        clay, water, glow, plaster;
};

Materials makeMaterials(Stage& s) {
    Materials m;
    m.stone = s.material("stone", {0.66f, 0.57f, 0.45f});
    m.paleStone = s.material("pale stone", {0.76f, 0.69f, 0.58f});
    m.darkStone = s.material("dark stone", {0.42f, 0.36f, 0.31f});
    m.plaster = s.material("plaster", {0.72f, 0.62f, 0.50f});
    m.tileLight = s.material("floor light", {0.62f, 0.56f, 0.48f});
    m.tileDark = s.material("floor dark", {0.36f, 0.28f, 0.24f});
    m.roof = s.material("roof tile", {0.56f, 0.27f, 0.17f});
    m.wood = s.material("wood", {0.30f, 0.19f, 0.11f});
    m.metal = s.material("bronze", {0.26f, 0.20f, 0.13f});
    m.red = s.material("red cloth", {0.46f, 0.07f, 0.06f});
    m.blue = s.material("blue cloth", {0.09f, 0.14f, 0.40f});
    m.leaf = s.material("leaf", {0.16f, 0.34f, 0.10f});
    m.clay = s.material("clay", {0.58f, 0.33f, 0.21f});
    m.water = s.material("water", {0.12f, 0.26f, 0.30f});
    m.glow = s.material("lamp glass", {0.9f, 0.8f, 0.6f}, {1.0f, 0.75f, 0.4f});
    return m;
}

/// One of the four sides: a frame with x along the side, z out of the court, origin at its first
/// corner.
struct Side {
    dvec3 origin;
    double yaw;
    int bays;
    double span;
    dvec3 point(double x, double y, double z) const {
        const double c = cosTurns(yaw), s = sinTurns(yaw);
        return origin + dvec3(x * c + z * s, y, -x * s + z * c);
    }
};

std::vector<Side> makeSides() {
    return {{{-kCourtX, 0, kCourtZ}, kTurn[0], kLongBays, kLongSpan},
            {{kCourtX, 0, kCourtZ}, kTurn[1], kShortBays, kShortSpan},
            {{kCourtX, 0, -kCourtZ}, kTurn[2], kLongBays, kLongSpan},
            {{-kCourtX, 0, -kCourtZ}, kTurn[3], kShortBays, kShortSpan}};
}

/// A column from y = 0 to `height`: square plinth, attic base, fluted and swelling shaft, bell
/// capital with two rows of leaves, square abacus.
int makeColumn(Stage& s, const Materials& mat, const char* name, double height, double radius,
               int segments) {
    MeshBuilder m(name, mat.paleStone);
    const double r = radius;
    addBox(m, {-1.45 * r, 0, -1.45 * r}, {1.45 * r, 0.45 * r, 1.45 * r}, false);
    std::vector<dvec2> base;
    for (int i = 0; i <= 5; ++i) // lower torus
        base.emplace_back(r * (1.18 + 0.22 * sinTurns(0.5 * i / 5)), r * (0.45 + 0.3 * i / 5));
    for (int i = 1; i <= 4; ++i) // scotia and upper torus
        base.emplace_back(r * (1.12 + 0.12 * sinTurns(0.5 * i / 4)), r * (0.75 + 0.22 * i / 4));
    base.emplace_back(r, r * 1.05);
    addLathe(m, base, segments);
    m.setMaterial(mat.stone);
    const double bell = height - 2.1 * r, foot = 1.05 * r;
    std::vector<dvec2> shaft;
    for (int i = 0; i <= 8; ++i) {
        const double t = i / 8.0;
        shaft.emplace_back(r * (1.0 - 0.16 * t * t), foot + (bell - foot) * t);
    }
    addLathe(m, shaft, segments, 0.055, segments / 4);
    m.setMaterial(mat.paleStone);
    std::vector<dvec2> top = {
        {0.84 * r, bell}, {0.98 * r, bell + 0.05 * r}, {0.98 * r, bell + 0.15 * r}};
    for (int i = 0; i <= 6; ++i) {
        const double t = i / 6.0;
        top.emplace_back(r * (0.86 + 0.42 * t * t), bell + r * (0.2 + 1.5 * t));
    }
    addLathe(m, top, segments);
    const glm::dmat4 saved = m.transform();
    for (int row = 0; row < 2; ++row)
        for (int i = 0; i < 8; ++i) { // acanthus leaves, curling outwards
            const double turn = (i + 0.5 * row) / 8.0;
            const double w = 0.34 * r, rise = r * (row ? 1.35 : 0.8);
            m.setTransform(saved * placement({0, bell + 0.2 * r, 0}, turn));
            addSheet(m, 2, 6, [&](double u, double v) {
                const double half = w * (1.0 - 0.75 * v * v);
                const double out = r * (0.9 + 0.12 * v + (row ? 0.42 : 0.3) * v * v * v);
                const double y = rise * (v - 0.28 * v * v * v * v);
                return dvec3((2 * u - 1) * half, y, out + 0.06 * r * (u == 0.5));
            });
        }
    m.setTransform(saved);
    addBox(m, {-1.3 * r, height - 0.4 * r, -1.3 * r}, {1.3 * r, height, 1.3 * r});
    return s.mesh(m);
}

void addColumns(Stage& s, const Materials& mat) {
    const int lower = makeColumn(s, mat, "curved_column_lower", kSpring, 0.24, 32);
    const int upper = makeColumn(s, mat, "curved_column_upper", kUpperSpring, 0.165, 24);
    MeshBuilder pier("flat_pier", mat.stone);
    addBox(pier, {-0.4, 0, -0.4}, {0.4, 0.25, 0.4}, false);
    addBox(pier, {-0.33, 0.25, -0.33}, {0.33, kSpring - 0.2, 0.33}, false);
    addBox(pier, {-0.4, kSpring - 0.2, -0.4}, {0.4, kSpring, 0.4});
    addBox(pier, {-0.29, kSpring, -0.29}, {0.29, kSlab, 0.29}, false);
    addBox(pier, {-0.27, kUpper, -0.27}, {0.27, kUpper + kUpperTop, 0.27}, false);
    const int pierMesh = s.mesh(pier);
    for (const Side& side : makeSides()) {
        s.place(pierMesh, side.origin);
        for (int i = 1; i < side.bays; ++i) {
            s.place(lower, side.point(i * side.span, 0, 0), side.yaw);
            s.place(upper, side.point(i * side.span, kUpper, 0), side.yaw);
        }
    }
}

void addArcades(Stage& s, const Materials& mat) {
    for (int kind = 0; kind < 2; ++kind) { // a bay of the long and of the short sides
        const double span = kind ? kShortSpan : kLongSpan;
        const double r = span / 2 - 0.3;
        MeshBuilder m(kind ? "curved_arcade_short" : "curved_arcade_long", mat.stone);
        m.moveTo({0, kSpring, 0});
        addArchedWall(m, span, r, 0.0, kSlab - kSpring, kWall, 28);
        const double r2 = span / 2 - 0.24;
        m.moveTo({0, kUpper + kUpperSpring, 0});
        addArchedWall(m, span, r2, 0.0, kUpperTop - kUpperSpring, 0.42, 24);
        m.setMaterial(mat.paleStone);
        m.setTransform(placement({span / 2, kSpring, -kWall / 2}, 0.5));
        addArchivolt(m, r + 0.015, r + 0.2, 0.07, 28);
        m.setTransform(placement({span / 2, kSpring, kWall / 2}));
        addArchivolt(m, r + 0.015, r + 0.2, 0.05, 28);
        m.setTransform(placement({span / 2, kUpper + kUpperSpring, -0.21}, 0.5));
        addArchivolt(m, r2 + 0.015, r2 + 0.16, 0.06, 24);
        const int bay = s.mesh(m);
        for (const Side& side : makeSides())
            if ((side.bays == kShortBays) == (kind == 1))
                for (int i = 0; i < side.bays; ++i)
                    s.place(bay, side.point(i * side.span, 0, 0), side.yaw);
        // Outer wall: blind niches below, windowless niches above.
        MeshBuilder w(kind ? "flat_wall_short" : "flat_wall_long", mat.plaster);
        w.moveTo({0, 0, kDepth + 0.14});
        addArchedWall(w, span, span / 2 - 0.55, 1.9, kSlab, 0.28, 16);
        w.moveTo({0, kUpper, kDepth + 0.14});
        addArchedWall(w, span, span / 2 - 0.65, 1.5, kUpperTop, 0.28, 16);
        w.setMaterial(mat.darkStone); // pilasters under the ribs
        w.moveTo({0, 0, 0});
        addBox(w, {-0.2, 0, kDepth - 0.14}, {0.2, kSpring, kDepth + 0.02}, false);
        addBox(w, {-0.26, kSpring - 0.2, kDepth - 0.2}, {0.26, kSpring, kDepth + 0.02});
        addBox(w, {0.21, 0, kDepth - 0.06}, {span / 2 - 0.56, 0.4, kDepth + 0.02}, false);
        addBox(w, {span / 2 + 0.56, 0, kDepth - 0.06}, {span - 0.21, 0.4, kDepth + 0.02}, false);
        const int wall = s.mesh(w);
        MeshBuilder v(kind ? "curved_vault_short" : "curved_vault_long", mat.plaster);
        v.moveTo({0, kSpring + 0.1, kWall / 2});
        addGroinVault(v, span, kDepth - kWall / 2, 1.25, 18);
        const int vault = s.mesh(v);
        for (const Side& side : makeSides())
            if ((side.bays == kShortBays) == (kind == 1))
                for (int i = 0; i < side.bays; ++i) {
                    s.place(wall, side.point(i * side.span, 0, 0), side.yaw);
                    s.place(vault, side.point(i * side.span, 0, 0), side.yaw);
                }
    }
    // Corner bays, ribs across the arcade, and the solid shell outside the niches.
    MeshBuilder v("curved_vault_corner", mat.plaster);
    v.moveTo({0, kSpring + 0.1, 0});
    addGroinVault(v, kDepth, kDepth, 1.25, 18);
    const int corner = s.mesh(v);
    MeshBuilder rib("curved_rib", mat.darkStone);
    rib.setTransform(placement({0, kSpring, kDepth}, 0.25));
    addArchedWall(rib, kDepth, kDepth / 2 - 0.22, 0.0, kSlab - kSpring, 0.3, 20);
    const int ribMesh = s.mesh(rib);
    MeshBuilder shell("flat_shell", mat.plaster);
    for (const Side& side : makeSides()) {
        const double length = side.bays * side.span;
        s.place(corner, side.point(length, 0, 0), side.yaw);
        for (int i = 0; i <= side.bays; ++i)
            s.place(ribMesh, side.point(i * side.span, 0, 0), side.yaw);
        shell.setTransform(placement(side.origin, side.yaw));
        addBox(shell, {-kDepth, 0, kDepth + 0.28},
               {length + kDepth + 0.5, kUpper + 5.2, kDepth + 0.5}, false);
        // The corner bay's two walls, flush with the niches' fronts.
        addBox(shell, {-kDepth, 0, kDepth}, {0, kUpper + kUpperTop, kDepth + 0.28}, false);
        addBox(shell, {length, 0, kDepth}, {length + kDepth, kUpper + kUpperTop, kDepth + 0.28},
               false);
    }
    s.placeOnce(shell);
}

void addFloors(Stage& s, const Materials& mat) {
    MeshBuilder m("flat_floor", mat.darkStone);
    addBox(m, {-kInnerX - 0.5, -0.4, -kInnerZ - 0.5}, {kInnerX + 0.5, -0.05, kInnerZ + 0.5});
    // Flush squares without joints: grooves narrower than a ray's offset would only be contact
    // errors.
    const auto paving = [&](double x0, double z0, double x1, double z1, double pitch,
                            uint32_t light, uint32_t dark) {
        const int nx = std::max(1, int((x1 - x0) / pitch + 0.5));
        const int nz = std::max(1, int((z1 - z0) / pitch + 0.5));
        for (int i = 0; i < nx; ++i)
            for (int j = 0; j < nz; ++j) {
                m.setMaterial((i + j) & 1 ? dark : light);
                const double xa = x0 + (x1 - x0) * i / nx, xb = x0 + (x1 - x0) * (i + 1) / nx;
                const double za = z0 + (z1 - z0) * j / nz, zb = z0 + (z1 - z0) * (j + 1) / nz;
                m.quad({xa, 0, za}, {xa, 0, zb}, {xb, 0, zb}, {xb, 0, za});
            }
    };
    const double e = 0.5; // half width of the border under the columns
    paving(-kCourtX + e, -kCourtZ + e, kCourtX - e, kCourtZ - e, 0.58, mat.tileLight, mat.tileDark);
    paving(-kInnerX, kCourtZ + e, kInnerX, kInnerZ, 0.62, mat.tileLight, mat.tileDark);
    paving(-kInnerX, -kInnerZ, kInnerX, -kCourtZ - e, 0.62, mat.tileLight, mat.tileDark);
    paving(-kInnerX, -kCourtZ - e, -kCourtX - e, kCourtZ + e, 0.62, mat.tileLight, mat.tileDark);
    paving(kCourtX + e, -kCourtZ - e, kInnerX, kCourtZ + e, 0.62, mat.tileLight, mat.tileDark);
    paving(-kCourtX - e, kCourtZ - e, kCourtX + e, kCourtZ + e, 1.0, mat.paleStone, mat.stone);
    paving(-kCourtX - e, -kCourtZ - e, kCourtX + e, -kCourtZ + e, 1.0, mat.paleStone, mat.stone);
    paving(-kCourtX - e, -kCourtZ + e, -kCourtX + e, kCourtZ - e, 1.0, mat.paleStone, mat.stone);
    paving(kCourtX - e, -kCourtZ + e, kCourtX + e, kCourtZ - e, 1.0, mat.paleStone, mat.stone);
    // Upper floor and ceiling slabs.
    const auto ring = [&](double y0, double y1, double inX, double inZ) {
        addBox(m, {-kInnerX, y0, inZ}, {kInnerX, y1, kInnerZ});
        addBox(m, {-kInnerX, y0, -kInnerZ}, {kInnerX, y1, -inZ});
        addBox(m, {-kInnerX, y0, -inZ}, {-inX, y1, inZ});
        addBox(m, {inX, y0, -inZ}, {kInnerX, y1, inZ});
    };
    m.setMaterial(mat.stone);
    ring(kSlab, kUpper, kCourtX - 0.3, kCourtZ - 0.3);
    m.setMaterial(mat.wood);
    ring(kUpper + kUpperTop + 0.002, kUpper + kUpperTop + 0.2, kCourtX - 0.2, kCourtZ - 0.2);
    s.placeOnce(m);

    MeshBuilder c("curved_cornice", mat.paleStone);
    std::vector<dvec2> profile = {{0.0, -0.42}};
    for (int i = 0; i <= 8; ++i) // cyma
        profile.emplace_back(0.04 + 0.2 * i / 8 + 0.05 * sinTurns(i / 8.0), -0.4 + 0.03 * i);
    profile.insert(profile.end(), {{0.3, -0.14}, {0.3, 0.012}, {0.0, 0.012}});
    c.moveTo({0, kUpper, 0});
    addCornice(c, profile, kCourtX - 0.3, kCourtZ - 0.3);
    c.moveTo({0, kUpper + kUpperTop + 0.2, 0});
    addCornice(c, profile, kCourtX - 0.2, kCourtZ - 0.2);
    s.placeOnce(c);

    MeshBuilder beams("flat_beams", mat.wood);
    for (const Side& side : makeSides()) {
        beams.setTransform(placement(side.origin, side.yaw));
        const int count = side.bays * 3;
        for (int i = 0; i < count; ++i) {
            const double x = (i + 0.5) * side.bays * side.span / count;
            addBox(beams, {x - 0.07, kUpper + kUpperTop - 0.2, 0.2},
                   {x + 0.07, kUpper + kUpperTop, kDepth});
        }
    }
    s.placeOnce(beams);
}

void addRoof(Stage& s, const Materials& mat) {
    // Each side's roof falls from the outer wall to the eave over the court; hips at 45 degrees.
    const double high = 10.15, low = 9.05, depth = 3.55;
    MeshBuilder deck("flat_roof_deck", mat.wood);
    MeshBuilder tiles("curved_roof_tiles", mat.roof);
    for (const Side& side : makeSides()) {
        const double length = side.bays * side.span;
        const glm::dmat4 frame = placement(side.origin, side.yaw);
        deck.setTransform(frame);
        tiles.setTransform(frame);
        const double a = -kDepth, b = length + kDepth, za = kDepth, zb = kDepth - depth;
        const double ia = a + depth, ib = b - depth; // ends at the eave
        const dvec3 corners[8] = {{a, high - 0.12, za}, {ia, low - 0.12, zb}, {ib, low - 0.12, zb},
                                  {b, high - 0.12, za}, {a, high, za},        {ia, low, zb},
                                  {ib, low, zb},        {b, high, za}};
        addHexahedron(deck, corners);
        const double width = 0.27, run = 0.5;
        const int columns = int((b - a) / width);
        for (int i = 0; i < columns; ++i) {
            const double x = a + (i + 0.5) * (b - a) / columns;
            const double reach = std::min({depth, x - a, b - x}); // to the hip
            for (double t = depth; t > 0.1; t -= run) {           // from the eave up
                if (t > reach + 0.2)
                    continue;
                const double t0 = t, t1 = std::max(t - run - 0.06, 0.0);
                const auto at = [&](double along, double lift) {
                    return dvec3(x, high + (low - high) * along / depth + lift, za - along);
                };
                addSheet(tiles, 5, 1, [&](double u, double v) {
                    const double half = 0.125 - 0.012 * v;
                    const double c = cosTurns(0.5 * u), d = sinTurns(0.5 * u);
                    return at(v < 0.5 ? t0 : t1, 0.02 + 0.095 * d + (v < 0.5 ? 0.03 : 0.0)) +
                           dvec3(-half * c, 0, 0);
                });
            }
        }
    }
    s.placeOnce(deck);
    s.placeOnce(tiles);
    MeshBuilder eave("curved_gutter", mat.metal);
    std::vector<dvec2> profile;
    for (int i = 0; i <= 10; ++i)
        profile.emplace_back(0.09 - 0.09 * cosTurns(0.5 * i / 10), -0.1 * sinTurns(0.5 * i / 10));
    eave.moveTo({0, 8.96, 0});
    addCornice(eave, profile, kCourtX + kDepth - depth + 0.02, kCourtZ + kDepth - depth + 0.02);
    s.placeOnce(eave);
}

void addBalustrades(Stage& s, const Materials& mat) {
    MeshBuilder b("curved_baluster", mat.paleStone);
    addLathe(b,
             {{0.07, 0.0},
              {0.07, 0.05},
              {0.045, 0.07},
              {0.04, 0.12},
              {0.075, 0.22},
              {0.085, 0.3},
              {0.07, 0.4},
              {0.04, 0.52},
              {0.036, 0.6},
              {0.055, 0.65},
              {0.055, 0.68},
              {0.07, 0.7}},
             10);
    const int baluster = s.mesh(b);
    MeshBuilder rails("thin_balustrade_rails", mat.paleStone);
    for (const Side& side : makeSides()) {
        rails.setTransform(placement(side.origin, side.yaw));
        for (int i = 0; i < side.bays; ++i) {
            const double x0 = i * side.span + 0.26, x1 = (i + 1) * side.span - 0.26;
            addBox(rails, {x0, kUpper, -0.11}, {x1, kUpper + 0.12, 0.11}, false);
            addBox(rails, {x0, kUpper + 0.82, -0.12}, {x1, kUpper + 0.93, 0.12});
            addBox(rails, {x0, kUpper + 0.93, -0.09}, {x1, kUpper + 0.98, 0.09}, false);
            const int count = side.bays == kLongBays ? 9 : 7;
            for (int k = 0; k < count; ++k)
                s.place(baluster, side.point(x0 + (k + 0.5) * (x1 - x0) / count, kUpper + 0.12, 0),
                        side.yaw);
        }
    }
    s.placeOnce(rails);
}

/// A small chandelier: cap, knob, chain, and six bars that hang from the cap around the light,
/// which lies 0.34 below it. Origin: the light.
int makeLamp(Stage& s, const Materials& mat, const char* name, double chainLength) {
    MeshBuilder m(name, mat.metal);
    addLathe(m,
             {{0.0, 0.36},
              {0.06, 0.35},
              {0.125, 0.34},
              {0.13, 0.355},
              {0.105, 0.40},
              {0.06, 0.44},
              {0.03, 0.46},
              {0.04, 0.49},
              {0.03, 0.52},
              {0.0, 0.53}},
             16);
    addCage(m, 0.08, -0.1, 0.37, 6);
    m.moveTo({0, 0.52 + chainLength, 0});
    addChain(m, chainLength, 0.013, 6, 4);
    return s.mesh(m);
}

void addLamps(Stage& s, const Materials& mat) {
    const glm::vec3 warm(1.0f, 0.78f, 0.50f), amber(1.0f, 0.66f, 0.36f), cool(0.72f, 0.82f, 1.0f);
    const int lower = makeLamp(s, mat, "thin_lamp_lower", 0.75);
    const int upper = makeLamp(s, mat, "thin_lamp_upper", 0.75);
    const int court = makeLamp(s, mat, "thin_lamp_court", 2.2);
    int index = 0;
    const auto lamp = [&](int mesh, dvec3 at, double range, glm::vec3 color, double intensity) {
        s.place(mesh, at);
        s.pointLight("lamp " + std::to_string(index++), at, range, color, intensity);
    };
    // 24 in the bays of each storey.
    for (int storey = 0; storey < 2; ++storey)
        for (const Side& side : makeSides())
            for (int i = 0; i <= side.bays; ++i) {
                const double x =
                    i < side.bays ? (i + 0.5) * side.span : side.bays * side.span + kDepth / 2;
                const double z = i < side.bays ? 1.45 : kDepth / 2;
                lamp(storey ? upper : lower, side.point(x, storey ? kUpper + 2.3 : 3.03, z),
                     storey ? 6.0 : 6.5, storey ? warm : amber, storey ? 0.7 : 0.9);
            }
    // 8 over the court, on cables from wall to wall.
    MeshBuilder cables("thin_cables", mat.metal);
    for (int i = 0; i < 4; ++i) {
        const double x = -6.75 + 4.5 * i;
        std::vector<dvec3> path;
        for (int k = 0; k <= 24; ++k) {
            const double t = 2.0 * k / 24 - 1.0;
            path.emplace_back(x, 8.3 - 0.5 * (1 - t * t), t * (kCourtZ - 0.2));
        }
        addTube(cables, path, 0.012, 6);
        for (int k = -1; k <= 1; k += 2) {
            const double t = k * 1.45 / (kCourtZ - 0.2);
            lamp(court, {x, 8.3 - 0.5 * (1 - t * t) - 2.2 - 0.52, k * 1.45}, 9.0,
                 i & 1 ? warm : cool, 2.0);
        }
    }
    s.placeOnce(cables);
    // 8 braziers on tripods in the court.
    MeshBuilder b("thin_brazier", mat.metal);
    addLathe(b,
             {{0.0, 0.86},
              {0.1, 0.87},
              {0.2, 0.94},
              {0.24, 1.04},
              {0.25, 1.05},
              {0.21, 1.03},
              {0.0, 1.0}},
             18);
    for (int i = 0; i < 3; ++i) {
        const double c = cosTurns(i / 3.0), d = sinTurns(i / 3.0);
        addTube(b, {{0.3 * c, 0, 0.3 * d}, {0.12 * c, 0.5, 0.12 * d}, {0.2 * c, 0.95, 0.2 * d}},
                0.016, 8);
    }
    std::vector<dvec3> hoop;
    for (int i = 0; i <= 20; ++i)
        hoop.emplace_back(0.12 * cosTurns(i / 20.0), 0.5, 0.12 * sinTurns(i / 20.0));
    addTube(b, hoop, 0.01, 6);
    b.setMaterial(mat.glow);
    HashRandom random(5);
    for (int i = 0; i < 9; ++i) // coals
        addBall(b, {random.between(-0.12, 0.12), 1.02, random.between(-0.12, 0.12)}, 0.045, 6, 4);
    const int brazier = s.mesh(b);
    for (int i = 0; i < 8; ++i) {
        const double x = -7.72 + kLongSpan * 2 * (i / 2), z = (i & 1 ? 1 : -1) * 2.35;
        s.place(brazier, {x, 0, z}, 0.1 * i);
        s.pointLight("brazier " + std::to_string(i), {x, 1.42, z}, 7.0, amber, 1.3);
    }
    // And one over the fountain.
    s.pointLight("fountain", {0, 2.55, 0}, 11.0, {0.85f, 0.92f, 1.0f}, 2.6);
}

void addFountain(Stage& s, const Materials& mat) {
    MeshBuilder m("curved_fountain", mat.paleStone);
    std::vector<dvec2> basin = {{1.35, 0.0}, {1.35, 0.12}, {1.22, 0.16}, {1.2, 0.4}, {1.3, 0.48},
                                {1.3, 0.56}, {1.1, 0.56},  {1.06, 0.5},  {1.06, 0.1}};
    addLathe(m, basin, 64);
    addLathe(m,
             {{0.3, 0.1},
              {0.3, 0.3},
              {0.2, 0.4},
              {0.13, 0.6},
              {0.12, 0.9},
              {0.16, 1.1},
              {0.14, 1.2},
              {0.35, 1.3},
              {0.52, 1.42},
              {0.56, 1.5},
              {0.52, 1.5},
              {0.46, 1.44},
              {0.12, 1.4},
              {0.08, 1.6},
              {0.07, 1.85},
              {0.1, 1.95},
              {0.0, 2.1}},
             40, 0.05, 10);
    m.setMaterial(mat.water);
    addLathe(m, {{1.08, 0.42}, {0.28, 0.42}}, 48);
    s.placeOnce(m);
}

void addCloth(Stage& s, const Materials& mat) {
    // Banners from rods over the arcade, long sides; curtains half drawn in two bays of each short
    // side.
    HashRandom random(23);
    for (int kind = 0; kind < 2; ++kind) {
        MeshBuilder m(kind ? "thin_banner_blue" : "thin_banner_red", kind ? mat.blue : mat.red);
        const double phase = random.unit();
        addSheet(m, 24, 24, [&](double u, double v) {
            const double fold = 0.05 + 0.05 * v;
            const double x = (u - 0.5) * (1.25 - 0.12 * v);
            const double tail = v == 1.0 ? 0.22 * (u < 0.5 ? u : 1 - u) : 0.0;
            return dvec3(x, -2.15 * v - tail, fold * sinTurns(3.0 * u + 0.35 * v + phase));
        });
        m.setMaterial(mat.metal);
        addTube(m, {{-0.75, 0.03, 0}, {0.75, 0.03, 0}}, 0.02, 8);
        addBall(m, {-0.77, 0.03, 0}, 0.04, 8, 6);
        addBall(m, {0.77, 0.03, 0}, 0.04, 8, 6);
        const int banner = s.mesh(m);
        for (const Side& side : makeSides())
            if (side.bays == kLongBays)
                for (int i = 1; i < kLongBays; ++i)
                    if ((i & 1) == kind)
                        s.place(banner, side.point(i * side.span, 4.45, -0.72), side.yaw);
    }
    MeshBuilder m("thin_curtain", mat.red);
    for (int half = 0; half < 2; ++half) // gathered at both jambs of an arch
        addSheet(m, 24, 24, [&](double u, double v) {
            const double gather =
                1.0 - 0.55 * sinTurns(0.25 * std::min(1.0, v * 1.5)) + 0.12 * v * v;
            const double x = 0.95 - 0.85 * u * gather;
            return dvec3((half ? 1 : -1) * x, 2.9 - 2.85 * v, 0.06 * sinTurns(5.0 * u + 0.1 * v));
        });
    m.setMaterial(mat.metal);
    addTube(m, {{-1.0, 2.93, 0}, {1.0, 2.93, 0}}, 0.018, 8);
    const int curtain = s.mesh(m);
    for (const Side& side : makeSides())
        for (int i = 0; i < side.bays; ++i)
            if (side.bays == kShortBays ? i != 1 : i == 1 || i == 5)
                s.place(curtain, side.point((i + 0.5) * side.span, 0, 0.42), side.yaw);
}

void addPlants(Stage& s, const Materials& mat) {
    HashRandom random(31);
    for (int kind = 0; kind < 3; ++kind) {
        MeshBuilder m(kind == 0   ? "thin_plant_palm"
                      : kind == 1 ? "thin_plant_bush"
                                  : "thin_plant_fern",
                      mat.clay);
        addLathe(m,
                 {{0.0, 0.0},
                  {0.2, 0.0},
                  {0.22, 0.03},
                  {0.17, 0.08},
                  {0.26, 0.2},
                  {0.31, 0.36},
                  {0.28, 0.47},
                  {0.32, 0.52},
                  {0.33, 0.56},
                  {0.28, 0.56},
                  {0.26, 0.5},
                  {0.0, 0.49}},
                 24);
        m.setMaterial(mat.wood);
        if (kind == 0)
            addTaperedTube(m, {{0, 0.48, 0}, {0.03, 0.9, 0.02}, {0.0, 1.3, 0.05}},
                           {0.05, 0.04, 0.035}, 8);
        m.setMaterial(mat.leaf);
        const int leaves = kind == 0 ? 22 : kind == 1 ? 60 : 32;
        for (int i = 0; i < leaves; ++i) {
            const double turn = i * 0.381966 + random.between(-0.02, 0.02); // the golden angle
            const double lift = random.between(0.02, 0.2);
            if (kind == 0) {
                m.setTransform(placement({0, 1.28, 0.05}, turn) *
                               placement({0, 0, 0}, 0.25, -lift) * placement({0, 0, 0}, -0.25));
                addLeaf(m, random.between(0.7, 1.0), 0.11, 0.45, 7);
            } else if (kind == 1) {
                const double y = random.between(0.55, 1.25), r = 0.12 + 0.2 * random.unit();
                m.setTransform(placement({r * cosTurns(turn), y, -r * sinTurns(turn)}, turn));
                const double droop = random.between(-0.08, 0.1);
                addLeaf(m, random.between(0.18, 0.3), 0.075, droop, 5);
            } else {
                m.setTransform(placement({0, 0.5, 0}, turn) * placement({0, 0, 0}, 0.25, -lift) *
                               placement({0, 0, 0}, -0.25));
                const double droop = random.between(0.1, 0.35);
                addLeaf(m, random.between(0.45, 0.75), 0.06, droop, 6);
            }
        }
        if (kind == 1) { // stems that carry the leaves
            m.setMaterial(mat.wood);
            for (int i = 0; i < 7; ++i) {
                const double turn = i / 7.0;
                m.moveTo({0, 0, 0}, turn);
                addTube(m, {{0.02, 0.48, 0}, {0.1, 0.8, 0}, {0.2, 1.2, 0}}, 0.009, 5);
            }
        }
        const int plant = s.mesh(m);
        for (const Side& side : makeSides())
            for (int i = 0; i < side.bays; ++i) {
                if ((i + kind) % 3 != 0)
                    continue;
                const bool isLong = side.bays == kLongBays;
                s.place(plant, side.point((i + 0.5) * side.span, 0, kDepth - 0.8), 0.13 * i);
                if (isLong)
                    s.place(plant, side.point((i + 0.5) * side.span, kUpper, kDepth - 0.8),
                            0.37 * i, 0.85);
                if (isLong && i != 3)
                    s.place(plant, side.point(i * side.span, 0, -0.62), 0.21 * i, 0.8);
            }
    }
}

} // namespace

Scene makeAtrium() {
    Stage s("atrium");
    const Materials mat = makeMaterials(s);
    addColumns(s, mat);
    addArcades(s, mat);
    addFloors(s, mat);
    addRoof(s, mat);
    addBalustrades(s, mat);
    addLamps(s, mat);
    addFountain(s, mat);
    addCloth(s, mat);
    addPlants(s, mat);
    s.cameraPath({{0.0, {-8.2, 5.6, 0.5}, {0.5, 3.0, -0.2}},
                  {4.0, {-5.5, 4.2, 1.2}, {3.0, 2.4, -1.0}},
                  {7.0, {-2.4, 1.9, 1.9}, {3.5, 1.9, -1.5}},
                  {10.0, {2.2, 1.7, 1.6}, {7.0, 2.2, 2.6}},
                  {12.5, {5.15, 1.7, 4.1}, {0.5, 2.0, 5.0}},
                  {15.0, {0.3, 1.8, 4.9}, {-5.0, 2.2, 4.0}},
                  {17.5, {-4.0, 2.6, 1.8}, {1.0, 4.6, -3.5}},
                  {20.0, {-7.0, 6.4, 0.9}, {1.0, 5.0, -2.0}}},
                 1.0);
    return s.take();
}

} // namespace shadowdag
