// SPDX-License-Identifier: Apache-2.0
// `houses`: a village at night on a hill, 256 lamps of similar size, a camera that moves from far
// to near; after the scene HOUSES of Olsson et al. 2015. Own geometry. More than 300 lines because
// it is one village.
#include "scenes/builtin_props.h"
#include "scenes/builtin_stage.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

using glm::dvec2;
using glm::dvec3;

namespace {

constexpr int kPlots = 8; // a side; the four in the middle are the church's
constexpr double kPitchX = 11.0, kPitchZ = 10.0;
constexpr double kHalfX = kPlots * kPitchX / 2, kHalfZ = kPlots * kPitchZ / 2;
constexpr int kHouseKinds = 12;
constexpr double kWallThickness = 0.3;

/// Height of the ground: a hill under the church, waves outwards.
double ground(double x, double z) {
    const double r2 = (x * x + z * z) / 900.0;
    return 3.6 / (1.0 + r2) + 0.5 * sinTurns(x / 37.0 + 0.1) * cosTurns(z / 29.0) +
           0.25 * sinTurns((x + z) / 17.0);
}

struct Materials {
    uint32_t grass, path, bark, leaf, leafDark, iron, fence, stone, timber, glass, litGlass,
        cloth[2];
    uint32_t wall[4], roof[3], shutter[3];
};

Materials makeMaterials(Stage& s) {
    Materials m;
    m.grass = s.material("grass", {0.22f, 0.27f, 0.13f});
    m.path = s.material("path", {0.45f, 0.40f, 0.33f});
    m.bark = s.material("bark", {0.24f, 0.17f, 0.12f});
    m.leaf = s.material("leaf", {0.24f, 0.36f, 0.12f});
    m.leafDark = s.material("leaf dark", {0.13f, 0.26f, 0.14f});
    m.iron = s.material("iron", {0.12f, 0.12f, 0.13f});
    m.fence = s.material("fence", {0.62f, 0.57f, 0.48f});
    m.stone = s.material("stone", {0.52f, 0.49f, 0.44f});
    m.timber = s.material("timber", {0.22f, 0.14f, 0.09f});
    m.glass = s.material("glass", {0.10f, 0.13f, 0.18f});
    m.litGlass = s.material("lit glass", {0.8f, 0.6f, 0.3f}, {0.9f, 0.55f, 0.2f});
    m.cloth[0] = s.material("red cloth", {0.52f, 0.10f, 0.08f});
    m.cloth[1] = s.material("blue cloth", {0.12f, 0.20f, 0.46f});
    m.wall[0] = s.material("cream wall", {0.74f, 0.66f, 0.52f});
    m.wall[1] = s.material("ochre wall", {0.70f, 0.52f, 0.30f});
    m.wall[2] = s.material("white wall", {0.76f, 0.74f, 0.70f});
    m.wall[3] = s.material("rose wall", {0.66f, 0.44f, 0.36f});
    m.roof[0] = s.material("red roof", {0.52f, 0.23f, 0.15f});
    m.roof[1] = s.material("brown roof", {0.38f, 0.24f, 0.17f});
    m.roof[2] = s.material("slate roof", {0.26f, 0.28f, 0.33f});
    m.shutter[0] = s.material("blue shutter", {0.16f, 0.28f, 0.46f});
    m.shutter[1] = s.material("green shutter", {0.16f, 0.32f, 0.26f});
    m.shutter[2] = s.material("brown shutter", {0.34f, 0.20f, 0.12f});
    return m;
}

/// A house kind: its meshes and where its lamps go, in its own frame (door towards +Z).
struct House {
    int walls, details, roof;
    std::vector<dvec3> lights;
    double width, depth;
};

/// The two slopes, gables included, of a roof over [-w/2, w/2] x [-d/2, d/2] with its ridge along
/// X.
void addGableRoof(MeshBuilder& walls, MeshBuilder& tiles, double w, double d, double eave,
                  double rise, uint32_t wallMaterial, uint32_t timber) {
    const double over = 0.45;
    const double slope = glm::sqrt(rise * rise + d * d / 4);
    const dvec3 down(0, -rise / slope, d / 2 / slope), up(0, d / 2 / slope, rise / slope);
    const double length = slope + over;
    walls.setMaterial(timber);
    const glm::dmat4 saved = walls.transform();
    for (int side = 0; side < 2; ++side) {
        const double f = side ? -1 : 1;
        const dvec3 x(f, 0, 0), y(0, up.y, f * up.z), z(0, down.y, f * down.z);
        const glm::dmat4 frame = frameOf({-f * (w / 2 + over), eave + rise + 0.16, 0}, x, y, z);
        walls.setTransform(saved * frame);
        tiles.setTransform(saved * frame);
        addTiledSlope(walls, tiles, w + 2 * over, length);
    }
    walls.setTransform(saved);
    tiles.setTransform(saved);
    std::vector<dvec3> ridge;
    for (int i = 0; i <= 12; ++i)
        ridge.emplace_back(-w / 2 - over + (w + 2 * over) * i / 12, eave + rise + 0.19, 0);
    addTube(tiles, ridge, 0.1, 8);
    walls.setMaterial(wallMaterial);
    for (int side = 0; side < 2; ++side) {
        const double xo = (side ? 1 : -1) * w / 2, xi = xo - (side ? 1 : -1) * kWallThickness;
        for (const double x : {xo, xi}) {
            const uint32_t a = walls.vertex({x, eave, -d / 2}), b = walls.vertex({x, eave, d / 2}),
                           c = walls.vertex({x, eave + rise, 0});
            if ((x == xo) == (side == 1))
                walls.triangle(a, c, b);
            else
                walls.triangle(a, b, c);
        }
    }
}

House makeHouse(Stage& s, const Materials& mat, int kind) {
    HashRandom random(100 + uint64_t(kind));
    House house;
    const double w = house.width = random.between(5.4, 7.0),
                 d = house.depth = random.between(4.6, 5.6);
    const int floors = kind % 3 == 0 && kind != 9 ? 1 : 2;
    const double floorHeight = 2.7, eave = floors * floorHeight + 0.3,
                 rise = random.between(1.9, 3.0);
    const FacadeMaterials facade = {mat.wall[kind % 4], mat.fence, mat.glass, mat.litGlass,
                                    mat.shutter[kind % 3]};
    const std::string tag = std::to_string(kind);
    MeshBuilder walls("flat_house_walls_" + tag), thin("thin_house_details_" + tag),
        tiles("curved_house_roof_" + tag, mat.roof[kind % 3]);
    for (int side = 0; side < 4; ++side) {
        const double length = side & 1 ? d : w;
        std::vector<Opening> openings;
        const int columns = side & 1 ? 2 : 3;
        for (int f = 0; f < floors; ++f)
            for (int c = 0; c < columns; ++c) {
                const double middle = length * (c + 0.5) / columns;
                if (side == 0 && f == 0 && c == 1)
                    openings.push_back({middle - 0.55, 0.35, 1.1, 2.1, true, false});
                else if (random.unit() < 0.85)
                    openings.push_back({middle - 0.4, f * floorHeight + 1.2, 0.8, 1.2, false,
                                        random.unit() < 0.35});
            }
        const glm::dmat4 around = placement({0, 0, 0}, side * 0.25);
        const double half = side & 1 ? w / 2 : d / 2;
        const glm::dmat4 frame = around * placement({-length / 2, 0, half});
        walls.setTransform(frame);
        thin.setTransform(frame);
        addFacade(walls, thin, facade, length, eave, kWallThickness, openings);
        // Plinth down into the slope, corner posts and floor beams.
        walls.setMaterial(mat.stone);
        addBox(walls, {-0.08, -1.6, -0.1},
               {length + (side & 1 ? -0.18 : 0.08), 0.3, side & 1 ? 0.079 : 0.08});
        thin.setMaterial(mat.timber);
        if (kind % 4 != 3) {
            addBox(thin, {0.001, 0.31, -0.05}, {0.18, eave, 0.05});
            addBox(thin, {length - 0.18, 0.31, -0.05}, {length - 0.001, eave, 0.05});
            for (int f = 1; f < floors; ++f)
                addBox(thin, {0.19, f * floorHeight + 0.35, -0.05},
                       {length - 0.19, f * floorHeight + 0.55, 0.05});
        }
    }
    const glm::dmat4 identity(1.0);
    walls.setTransform(identity);
    thin.setTransform(identity);
    addGableRoof(walls, tiles, w, d, eave, rise, mat.wall[kind % 4], mat.timber);
    walls.setMaterial(mat.stone); // chimney
    const double cx = random.between(-0.3, 0.3) * w;
    addBox(walls, {cx - 0.3, eave + 0.4 * rise, -1.0}, {cx + 0.3, eave + rise + 0.9, -0.45}, false);
    addBox(walls, {cx - 0.36, eave + rise + 0.9, -1.06}, {cx + 0.36, eave + rise + 1.02, -0.39});
    tiles.setTransform(placement({cx, eave + rise + 1.02, -0.72}));
    addLathe(tiles, {{0.13, 0.0}, {0.1, 0.1}, {0.11, 0.4}, {0.14, 0.42}, {0.09, 0.42}, {0.08, 0.0}},
             12);
    // Step, door canopy on braces, gutters and downpipes.
    walls.setMaterial(mat.stone);
    addBox(walls, {-0.8, -1.0, d / 2 + 0.081}, {0.8, 0.33, d / 2 + 0.7}, false);
    thin.setMaterial(mat.timber);
    addBox(thin, {-0.95, 2.75, d / 2}, {0.95, 2.83, d / 2 + 0.85});
    for (const double x : {-0.85, 0.85})
        addTube(thin, {{x, 2.1, d / 2}, {x, 2.75, d / 2 + 0.75}}, 0.04, 6);
    thin.setMaterial(mat.iron);
    for (const double f : {-1.0, 1.0}) {
        const double z = f * (d / 2 + 0.48), y = eave - 0.45 * rise / (d / 2) + 0.02;
        addTube(thin, {{-w / 2 - 0.4, y, z}, {w / 2 + 0.4, y, z}}, 0.06, 8);
        addTube(thin,
                {{w / 2 + 0.1, y, z},
                 {w / 2 + 0.1, y - 0.35, f * (d / 2 + 0.12)},
                 {w / 2 + 0.1, 0.0, f * (d / 2 + 0.12)}},
                0.045, 8);
    }
    // Wall lamps: beside the door, behind, and on one gable.
    const double lampHeight = 2.55;
    const auto lamp = [&](const glm::dmat4& frame) {
        thin.setTransform(frame);
        const dvec3 at = addWallLamp(thin);
        house.lights.push_back(dvec3(frame * glm::dvec4(at, 1.0)));
    };
    lamp(placement({1.2, lampHeight, d / 2 + 0.02}));
    lamp(placement({-0.25 * w, lampHeight, -d / 2 - 0.02}, 0.5));
    lamp(placement({-w / 2 - 0.02, eave + 0.3 * rise, 0.02}, 0.75)); // high: it reaches the roofs
    house.walls = s.mesh(walls);
    house.details = s.mesh(thin);
    house.roof = s.mesh(tiles);
    return house;
}

void addTerrain(Stage& s, const Materials& mat) {
    MeshBuilder m("flat_terrain", mat.grass);
    const int count = 150;
    const double sizeX = kHalfX + 2.0, sizeZ = kHalfZ + 2.0;
    std::vector<uint32_t> ids;
    for (int j = 0; j <= count; ++j)
        for (int i = 0; i <= count; ++i) {
            const double x = sizeX * (2.0 * i / count - 1), z = sizeZ * (2.0 * j / count - 1);
            ids.push_back(m.vertex({x, ground(x, z), z}));
        }
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i) {
            // Streets lie on the borders of the plots.
            const double x = sizeX * (2.0 * (i + 0.5) / count - 1),
                         z = sizeZ * (2.0 * (j + 0.5) / count - 1);
            const double fx = (x + kHalfX) / kPitchX, fz = (z + kHalfZ) / kPitchZ;
            const double dx = glm::abs(fx - std::floor(fx + 0.5)) * kPitchX;
            const double dz = glm::abs(fz - std::floor(fz + 0.5)) * kPitchZ;
            const bool isPlaza = glm::abs(x) < kPitchX && glm::abs(z) < kPitchZ;
            m.setMaterial(dx < 1.1 || dz < 1.1 || isPlaza ? mat.path : mat.grass);
            const size_t a = size_t(j * (count + 1) + i), b = a + size_t(count) + 1;
            m.quad(ids[a], ids[b], ids[b + 1], ids[a + 1]);
        }
    s.placeOnce(m);
}

/// A picket fence along a line on the ground.
void addFence(MeshBuilder& m, dvec2 a, dvec2 b) {
    const double length = glm::length(b - a);
    const dvec2 along = (b - a) / length;
    const int count = int(length / 0.27);
    const auto at = [&](double t, double y, double side) {
        const dvec2 p = a + along * t;
        return dvec3(p.x - along.y * side, ground(p.x, p.y) + y, p.y + along.x * side);
    };
    for (int i = 0; i < count; ++i) {
        const double t0 = (i + 0.2) * length / count, t1 = (i + 0.75) * length / count,
                     tm = (t0 + t1) / 2;
        const double y = i % 8 == 0 ? 1.05 : 0.9;
        uint32_t v[2][5];
        for (int side = 0; side < 2; ++side) {
            const double q = side ? 0.02 : -0.025;
            v[side][0] = m.vertex(at(t0, -0.05, q));
            v[side][1] = m.vertex(at(t1, -0.05, q));
            v[side][2] = m.vertex(at(t1, y, q));
            v[side][3] = m.vertex(at(tm, y + 0.12, q));
            v[side][4] = m.vertex(at(t0, y, q));
        }
        for (int side = 0; side < 2; ++side)
            for (int k = 2; k < 5; ++k)
                m.triangle(v[side][0], v[side][side ? k - 1 : k], v[side][side ? k : k - 1]);
        for (int k = 1; k < 5; ++k)
            m.quad(v[0][k], v[1][k], v[1][(k + 1) % 5], v[0][(k + 1) % 5]);
    }
    for (const double y : {0.25, 0.7}) {
        std::vector<dvec3> rail;
        for (int i = 0; i <= 6; ++i)
            rail.push_back(at(length * i / 6, y, 0.055));
        addTube(m, rail, 0.035, 5);
    }
}

void addChurch(Stage& s, const Materials& mat, int& lampIndex) {
    const double y0 = ground(0, 0) - 0.15;
    const dvec3 origin(-1.5, y0, 0);
    const double w = 13.0, d = 7.0, eave = 6.2;
    const FacadeMaterials facade = {mat.stone, mat.timber, mat.glass, mat.litGlass, mat.timber};
    MeshBuilder walls("flat_church", mat.stone), thin("thin_church_details", mat.timber),
        tiles("curved_church_roof", mat.roof[2]);
    for (int side = 0; side < 4; ++side) {
        const double length = side & 1 ? d : w;
        const glm::dmat4 frame = placement(origin) * placement({0, 0, 0}, side * 0.25) *
                                 placement({-length / 2, 0, side & 1 ? w / 2 : d / 2});
        std::vector<Opening> openings;
        if (!(side & 1))
            for (int c = 0; c < 4; ++c)
                openings.push_back({length * (c + 0.5) / 4 - 0.45, 2.2, 0.9, 2.8, false, true});
        walls.setTransform(frame);
        thin.setTransform(frame);
        addFacade(walls, thin, facade, length, eave, 0.5, openings);
        if (!(side & 1))
            for (int c = 0; c <= 4; ++c) { // buttresses
                const double x = 0.3 + (length - 0.6) * c / 4;
                const dvec3 b[8] = {{x - 0.25, -1.5, -0.1}, {x + 0.25, -1.5, -0.1},
                                    {x + 0.25, -1.5, 1.0},  {x - 0.25, -1.5, 1.0},
                                    {x - 0.25, 5.2, -0.1},  {x + 0.25, 5.2, -0.1},
                                    {x + 0.25, 4.2, 0.55},  {x - 0.25, 4.2, 0.55}};
                addHexahedron(walls, b);
            }
        walls.setMaterial(mat.stone);
        addBox(walls, {-0.1, -2, -0.2}, {length + 0.1, 0.4, side & 1 ? 0.11 : 0.12});
    }
    walls.setTransform(placement(origin));
    tiles.setTransform(placement(origin));
    addGableRoof(walls, tiles, w, d, eave, 4.2, mat.stone, mat.timber);
    // Tower at the eastern end with a belfry of four arches and a tall spire.
    const dvec3 tower = origin + dvec3(w / 2 + 2.0, 0, 0);
    walls.setTransform(placement(tower));
    walls.setMaterial(mat.stone);
    addBox(walls, {-1.9, -2, -1.9}, {1.9, 11.0, 1.9}, false);
    addBox(walls, {-2.1, 11.0, -2.1}, {2.1, 11.3, 2.1});
    MeshBuilder arches("curved_belfry", mat.stone);
    for (int side = 0; side < 4; ++side) {
        arches.setTransform(placement(tower) * placement({0, 11.3, 0}, side * 0.25) *
                            placement({-1.9, 0, 1.7}));
        addArchedWall(arches, 3.8, 1.1, 1.2, 3.0, 0.38, 20);
    }
    walls.setMaterial(mat.stone);
    addBox(walls, {-2.1, 14.302, -2.1}, {2.1, 14.55, 2.1});
    tiles.setTransform(placement(tower));
    std::vector<dvec2> spire;
    for (int i = 0; i <= 14; ++i)
        spire.emplace_back(i == 14 ? 0.0 : 2.35 * (1 - i / 14.0) + (i ? 0.03 : 0.0),
                           14.55 + 6.0 * i / 14);
    addLathe(tiles, spire, 8);
    addBall(tiles, {0, 20.7, 0}, 0.2, 12, 8);
    thin.setMaterial(mat.iron);
    thin.setTransform(placement(tower));
    addTube(thin, {{0, 20.8, 0}, {0, 22.0, 0}}, 0.04, 6);
    addTube(thin, {{-0.4, 21.6, 0}, {0.4, 21.6, 0}}, 0.04, 6);
    // Bell.
    arches.setTransform(placement(tower));
    arches.setMaterial(mat.roof[1]);
    addLathe(arches,
             {{0.75, 11.9}, {0.62, 12.1}, {0.45, 12.6}, {0.4, 13.0}, {0.25, 13.25}, {0.0, 13.3}},
             28);
    addLathe(arches, {{0.0, 13.1}, {0.3, 12.9}, {0.38, 12.5}, {0.55, 12.1}, {0.7, 11.9}}, 28);
    s.placeOnce(walls);
    s.placeOnce(arches);
    // Lamps on the church walls and in the belfry.
    const auto lamp = [&](const glm::dmat4& frame) {
        thin.setTransform(frame);
        const dvec3 at = dvec3(frame * glm::dvec4(addWallLamp(thin), 1.0));
        s.pointLight("lamp " + std::to_string(lampIndex++), at, 14.5, {1.0f, 0.78f, 0.5f}, 3.5);
    };
    for (int c = 0; c < 4; ++c)
        for (const double f : {-1.0, 1.0})
            lamp(placement(origin + dvec3(-w / 2 + 0.3 + (w - 0.6) * (c + 0.5) / 4 + 0.75, 3.2,
                                          f * (d / 2 + 0.02)),
                           f > 0 ? 0.0 : 0.5));
    for (int side = 0; side < 4; ++side)
        lamp(placement(tower) * placement({0, 8.5, 0}, side * 0.25) * placement({0, 0, 1.9}));
    s.placeOnce(thin);
    s.placeOnce(tiles);
}

void addPlaza(Stage& s, const Materials& mat, int& lampIndex, int lampCount) {
    MeshBuilder stalls("thin_stalls"), posts("thin_plaza_posts", mat.iron);
    for (int i = 0; i < 10; ++i) { // market stalls under striped cloth
        const double x = -9.0 + 4.3 * (i % 5), z = i < 5 ? 7.2 : -7.2;
        if (i % 5 == 4)
            continue;
        stalls.moveTo({x, ground(x, z), z}, 0.01 * i);
        stalls.setMaterial(mat.timber);
        for (const double px : {-1.1, 1.1})
            for (const double pz : {-0.7, 0.7})
                addBox(stalls, {px - 0.04, -0.3, pz - 0.04},
                       {px + 0.04, pz > 0 ? 2.1 : 2.5, pz + 0.04});
        addBox(stalls, {-1.2, 0.8, -0.6}, {1.2, 0.88, 0.6});
        for (int k = 0; k < 12; ++k) {
            stalls.setMaterial(k & 1 ? mat.fence : mat.cloth[i & 1]);
            addSheet(stalls, 3, 10, [&](double u, double v) {
                const double xx = -1.3 + 2.6 * (k + u) / 12;
                const double sag = 0.06 * sinTurns(0.5 * v) + 0.03 * sinTurns(6 * (k + u) / 12 + v);
                return dvec3(xx, 2.6 - 0.5 * v - sag, -0.85 + 1.8 * v);
            });
        }
        HashRandom random(700 + uint64_t(i));
        stalls.setMaterial(mat.cloth[0]);
        for (int k = 0; k < 24; ++k) // fruit
            addBall(
                stalls,
                {-1.0 + 0.17 * (k % 12), 0.95, (k / 12) * 0.3 - 0.1 + random.between(-0.05, 0.05)},
                0.07, 8, 6);
    }
    for (int i = 0; i < lampCount; ++i) {
        const double turn = double(i) / lampCount;
        const double x = 10.2 * cosTurns(turn), z = 9.0 * sinTurns(turn);
        posts.setTransform(placement({x, ground(x, z), z}, 0.5 - turn));
        const dvec3 at = dvec3(posts.transform() * glm::dvec4(addLampPost(posts, 4.0), 1.0));
        s.pointLight("lamp " + std::to_string(lampIndex++), at, 14.5, {1.0f, 0.80f, 0.52f}, 7.0);
    }
    s.placeOnce(stalls);
    s.placeOnce(posts);
}

} // namespace

Scene makeHouses() {
    Stage s("houses");
    const Materials mat = makeMaterials(s);
    addTerrain(s, mat);
    std::vector<House> houses;
    for (int kind = 0; kind < kHouseKinds; ++kind)
        houses.push_back(makeHouse(s, mat, kind));
    std::vector<int> trees;
    for (int kind = 0; kind < 5; ++kind) {
        MeshBuilder m("thin_tree_" + std::to_string(kind));
        addTree(m, mat.bark, kind & 1 ? mat.leafDark : mat.leaf, 40 + uint64_t(kind),
                4.6 + 0.5 * kind, 650, 0.38);
        trees.push_back(s.mesh(m));
    }
    MeshBuilder post("thin_lamp_post", mat.iron);
    const dvec3 postLight = addLampPost(post, 4.2);
    const int postMesh = s.mesh(post);
    MeshBuilder fences("thin_fences", mat.fence);
    HashRandom random(9);
    int lampIndex = 0;
    const glm::vec3 colors[3] = {{1.0f, 0.78f, 0.50f}, {1.0f, 0.70f, 0.40f}, {0.95f, 0.88f, 0.72f}};
    const auto light = [&](const dvec3& at, double intensity) {
        s.pointLight("lamp " + std::to_string(lampIndex), at, random.between(13.5, 15.5),
                     colors[lampIndex % 3], intensity);
        ++lampIndex;
    };
    for (int j = 0; j < kPlots; ++j)
        for (int i = 0; i < kPlots; ++i) {
            if ((i == 3 || i == 4) && (j == 3 || j == 4))
                continue;
            const double px = -kHalfX + (i + 0.5) * kPitchX, pz = -kHalfZ + (j + 0.5) * kPitchZ;
            const House& house = houses[(size_t(i) * 5 + size_t(j) * 7) % kHouseKinds];
            const double x = px + random.between(-0.5, 0.5),
                         z = pz - 0.6 + random.between(-0.4, 0.4);
            const double yaw = random.between(-0.02, 0.02) + (j >= 4 ? 0.5 : 0.0);
            const dvec3 at(x, ground(x, z) + 0.15, z + (j >= 4 ? 1.2 : 0.0));
            for (const int mesh : {house.walls, house.details, house.roof})
                s.place(mesh, at, yaw);
            const glm::dmat4 frame = placement(at, yaw);
            for (const dvec3& lamp : house.lights)
                light(dvec3(frame * glm::dvec4(lamp, 1.0)), 4.0);
            // Fence around the plot with a gap at the gate, and a lamp post by it.
            const double hx = kPitchX / 2 - 1.15, hz = kPitchZ / 2 - 1.1, f = j >= 4 ? -1 : 1;
            addFence(fences, {px - hx, pz - hz}, {px - hx, pz + hz});
            addFence(fences, {px + hx, pz - hz}, {px + hx, pz + hz});
            addFence(fences, {px - hx + 0.1, pz - f * hz}, {px + hx - 0.1, pz - f * hz});
            addFence(fences, {px - hx + 0.1, pz + f * hz}, {px - 0.7, pz + f * hz});
            addFence(fences, {px + 0.7, pz + f * hz}, {px + hx - 0.1, pz + f * hz});
            const dvec3 pole(px - 1.2, ground(px - 1.2, pz + f * (hz + 0.3)), pz + f * (hz + 0.3));
            s.place(postMesh, pole, f > 0 ? -0.25 : 0.25);
            light(dvec3(placement(pole, f > 0 ? -0.25 : 0.25) * glm::dvec4(postLight, 1.0)), 9.0);
            // A tree in the corner behind.
            const double tx = px + f * (hx - 1.0 - random.unit()), tz = pz - f * (hz - 0.9);
            if ((i + j) % 5 != 0) {
                const double scale = random.between(0.75, 1.0);
                s.place(trees[size_t((i * 3 + j) % 5)], {tx, ground(tx, tz), tz}, random.unit(),
                        scale);
            }
        }
    s.placeOnce(fences);
    addChurch(s, mat, lampIndex);
    addPlaza(s, mat, lampIndex, 256 - lampIndex);
    s.cameraPath({{0.0, {-36, 30, 46}, {2, 1, -2}},
                  {4.0, {-24, 21, 36}, {2, 1.5, 0}},
                  {8.0, {-15, 16.5, 24}, {2, 3, 2}},
                  {11.0, {-12.5, 12.5, 14.5}, {0, 4, 3}},
                  {14.0, {-10.0, 6.0, 9.6}, {0, 4.5, 5}},
                  {17.0, {-3.0, 4.9, 10.2}, {8, 4.6, 8}},
                  {20.0, {10.6, 4.4, 11.6}, {11.6, 3.5, 22}}},
                 0.8, 0.1);
    return s.take();
}

Scene makeHousesByDay() {
    Scene scene = makeHouses();
    scene.name = "houses-by-day";
    scene.lights.clear();
    for (Node& node : scene.nodes)
        node.light = kNone;
    Stage s(std::move(scene));
    s.directionalLight("sun", {0.35, -0.8, 0.48}, {1.0f, 0.96f, 0.88f}, 3.0);
    return s.take();
}

} // namespace shadowdag
