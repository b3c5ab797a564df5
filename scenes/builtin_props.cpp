// SPDX-License-Identifier: Apache-2.0
#include "scenes/builtin_props.h"

#include <algorithm>

namespace shadowdag {

using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

glm::dmat4 frameOf(const dvec3& origin, const dvec3& x, const dvec3& y, const dvec3& z) {
    return glm::dmat4(dvec4(x, 0), dvec4(y, 0), dvec4(z, 0), dvec4(origin, 1));
}

namespace {

dvec3 onSphere(HashRandom& random) {
    for (;;) { // rejection needs no sine
        const double z = random.between(-1, 1), y = random.between(-1, 1);
        const dvec3 p(random.between(-1, 1), y, z);
        const double d2 = glm::dot(p, p);
        if (d2 < 1.0 && d2 > 0.01)
            return p / glm::sqrt(d2);
    }
}

/// Adds a leaf at `at` that points along `direction`.
void addLeafAt(MeshBuilder& m, const dvec3& at, const dvec3& direction, double length, double width,
               double droop, int segments) {
    const glm::dmat4 saved = m.transform();
    const dvec3 helper = glm::abs(direction.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0);
    const dvec3 z = glm::normalize(glm::cross(direction, helper));
    m.setTransform(saved * frameOf(at, direction, glm::cross(z, direction), z));
    addLeaf(m, length, width, droop, segments);
    m.setTransform(saved);
}

} // namespace

void addTree(MeshBuilder& m, uint32_t bark, uint32_t leaf, uint64_t seed, double height,
             int leafCount, double leafLength) {
    HashRandom random(seed);
    m.setMaterial(bark);
    const double trunkRadius = 0.035 * height;
    std::vector<dvec3> trunk;
    std::vector<double> radii;
    const double leanZ = random.between(-0.1, 0.1);
    dvec3 p(0, -0.3, 0);
    const dvec3 lean(random.between(-0.1, 0.1), 1.0, leanZ);
    for (int i = 0; i <= 7; ++i) {
        trunk.push_back(p);
        radii.push_back(trunkRadius * (i == 0 ? 1.5 : 1.05 - 0.12 * i));
        const double bendZ = random.between(-0.04, 0.04);
        p += lean * (height * 0.1) + dvec3(random.between(-0.04, 0.04), 0, bendZ);
    }
    addTaperedTube(m, trunk, radii, 9);
    std::vector<std::pair<dvec3, dvec3>> tips; // place, direction
    const int limbCount = 8 + int(random.below(3));
    for (int i = 0; i < limbCount; ++i) {
        const double turn = i * 0.381966 + random.between(-0.05, 0.05);
        const dvec3 from = trunk[size_t(3 + i * 4 / limbCount)];
        dvec3 along =
            glm::normalize(dvec3(cosTurns(turn), random.between(0.35, 1.1), sinTurns(turn)));
        const double reach = height * random.between(0.28, 0.4);
        std::vector<dvec3> limb = {from};
        for (int k = 1; k <= 4; ++k) {
            along = glm::normalize(along + 0.25 * onSphere(random) + dvec3(0, 0.08, 0));
            limb.push_back(limb.back() + along * (reach / 4));
        }
        const double r = trunkRadius * 0.45;
        addTaperedTube(m, limb, {r, 0.8 * r, 0.6 * r, 0.45 * r, 0.25 * r}, 6);
        for (int k = 2; k <= 4; ++k)
            for (int j = 0; j < 3; ++j) { // twigs
                const dvec3 out = glm::normalize(along + 1.2 * onSphere(random));
                const dvec3 mid = limb[size_t(k)] + out * (reach * 0.16);
                const dvec3 end =
                    mid + glm::normalize(out + 0.5 * onSphere(random)) * (reach * 0.18);
                addTaperedTube(m, {limb[size_t(k)], mid, end}, {0.35 * r, 0.25 * r, 0.12 * r}, 4);
                tips.emplace_back(end, out);
                tips.emplace_back(mid, out);
            }
    }
    m.setMaterial(leaf);
    for (int i = 0; i < leafCount; ++i) {
        const auto& [at, out] = tips[random.below(uint32_t(tips.size()))];
        const dvec3 direction = glm::normalize(out * 0.5 + onSphere(random) + dvec3(0, 0.1, 0));
        const double distance = 0.085 * height * random.unit();
        const dvec3 offset = onSphere(random) * distance;
        addLeafAt(m, at + offset, direction, leafLength * random.between(0.75, 1.25),
                  0.32 * leafLength, 0.25 * leafLength, 2);
    }
}

void addCypress(MeshBuilder& m, uint32_t bark, uint32_t leaf, uint64_t seed, double height,
                int leafCount) {
    HashRandom random(seed);
    m.setMaterial(bark);
    addTaperedTube(m, {{0, -0.3, 0}, {0, 0.4 * height, 0}, {0, 0.96 * height, 0}},
                   {0.022 * height, 0.014 * height, 0.004 * height}, 8);
    m.setMaterial(leaf);
    for (int i = 0; i < leafCount; ++i) {
        const double t = (i + random.unit()) / leafCount;
        const double turn = i * 0.381966;
        const double reach = height * 0.1 * (1.05 - t) * (0.35 + 1.3 * std::min(t * 4.0, 1.0));
        const double r = reach * (0.35 + 0.65 * random.unit());
        const dvec3 out(cosTurns(turn), 0, sinTurns(turn));
        const dvec3 at = out * (r * 0.7) + dvec3(0, height * (0.06 + 0.92 * t), 0);
        addLeafAt(m, at, glm::normalize(out + dvec3(0, 0.9, 0) + 0.5 * onSphere(random)),
                  0.055 * height, 0.014 * height, 0.006 * height, 2);
    }
}

void addFacade(MeshBuilder& wall, MeshBuilder& thin, const FacadeMaterials& mat, double width,
               double height, double thickness, const std::vector<Opening>& openings) {
    std::vector<double> xs = {0, width}, ys = {0, height};
    for (const Opening& o : openings) {
        xs.insert(xs.end(), {o.x, o.x + o.width});
        ys.insert(ys.end(), {o.y, o.y + o.height});
    }
    for (auto* cuts : {&xs, &ys}) {
        std::sort(cuts->begin(), cuts->end());
        cuts->erase(std::unique(cuts->begin(), cuts->end()), cuts->end());
    }
    const auto isHole = [&](double x, double y) {
        for (const Opening& o : openings)
            if (x > o.x && x < o.x + o.width && y > o.y && y < o.y + o.height)
                return true;
        return false;
    };
    const double t = thickness;
    wall.setMaterial(mat.wall);
    for (size_t i = 0; i + 1 < xs.size(); ++i)
        for (size_t j = 0; j + 1 < ys.size(); ++j) {
            const double x0 = xs[i], x1 = xs[i + 1], y0 = ys[j], y1 = ys[j + 1];
            if (isHole((x0 + x1) / 2, (y0 + y1) / 2))
                continue;
            wall.quad({x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0});
            wall.quad({x0, y1, -t}, {x1, y1, -t}, {x1, y0, -t}, {x0, y0, -t});
        }
    for (const Opening& o : openings) {
        const double x0 = o.x, x1 = o.x + o.width, y0 = o.y, y1 = o.y + o.height;
        wall.setMaterial(mat.wall);
        wall.quad({x0, y0, 0}, {x0, y1, 0}, {x0, y1, -t}, {x0, y0, -t});
        wall.quad({x1, y0, -t}, {x1, y1, -t}, {x1, y1, 0}, {x1, y0, 0});
        wall.quad({x0, y0, -t}, {x1, y0, -t}, {x1, y0, 0}, {x0, y0, 0});
        wall.quad({x0, y1, 0}, {x1, y1, 0}, {x1, y1, -t}, {x0, y1, -t});
        wall.setMaterial(o.isDoor ? mat.shutter : o.isLit ? mat.litGlass : mat.glass);
        const double pane = -0.6 * t;
        wall.quad({x0, y0, pane}, {x1, y0, pane}, {x1, y1, pane}, {x0, y1, pane});
        thin.setMaterial(mat.frame);
        const double b = 0.05, front = pane + 0.07; // glazing bars and casing
        const auto bar = [&](double xa, double ya, double xb, double yb) {
            addBox(thin, {xa, ya, pane}, {xb, yb, front});
        };
        if (o.isDoor) {
            for (int k = 1; k < 5; ++k) // battens
                bar(x0 + o.width * k / 5 - 0.02, y0, x0 + o.width * k / 5 + 0.02, y1);
            bar(x0, y0 + 0.3 * o.height, x1, y0 + 0.3 * o.height + 0.12);
            bar(x0, y0 + 0.75 * o.height, x1, y0 + 0.75 * o.height + 0.12);
            continue;
        }
        bar(x0, y0, x0 + b, y1);
        bar(x1 - b, y0, x1, y1);
        bar(x0 + b, y0, x1 - b, y0 + b);
        bar(x0 + b, y1 - b, x1 - b, y1);
        bar((x0 + x1) / 2 - b / 2, y0 + b, (x0 + x1) / 2 + b / 2, y1 - b);
        bar(x0 + b, y0 + 0.6 * o.height, x1 - b, y0 + 0.6 * o.height + b);
        addBox(thin, {x0 - 0.1, y0 - 0.09, -0.02}, {x1 + 0.1, y0, 0.12}); // sill
        thin.setMaterial(mat.shutter);
        for (int side = 0; side < 2; ++side) {
            const double w = o.width / 2, xa = side ? x1 + 0.03 : x0 - 0.03 - w, xb = xa + w;
            addBox(thin, {xa, y0, 0.02}, {xa + 0.06, y1, 0.07});
            addBox(thin, {xb - 0.06, y0, 0.02}, {xb, y1, 0.07});
            const int louvres = int(o.height / 0.16);
            for (int k = 0; k <= louvres; ++k) {
                const double y = y0 + (o.height - 0.05) * k / louvres;
                const dvec3 c[8] = {{xa + 0.06, y, 0.03},         {xb - 0.06, y, 0.03},
                                    {xb - 0.06, y - 0.03, 0.065}, {xa + 0.06, y - 0.03, 0.065},
                                    {xa + 0.06, y + 0.05, 0.03},  {xb - 0.06, y + 0.05, 0.03},
                                    {xb - 0.06, y + 0.02, 0.065}, {xa + 0.06, y + 0.02, 0.065}};
                addHexahedron(thin, c);
            }
        }
    }
}

void addTiledSlope(MeshBuilder& slab, MeshBuilder& tiles, double length, double slopeLength) {
    addBox(slab, {0, -0.14, 0}, {length, -0.02, slopeLength});
    const int columns = std::max(1, int(length / 0.3)), rows = std::max(1, int(slopeLength / 0.45));
    const double width = length / columns, run = slopeLength / rows;
    for (int i = 0; i < columns; ++i)
        for (int j = 0; j < rows; ++j) {
            const double x = (i + 0.5) * width, z0 = j * run - 0.03, z1 = (j + 1) * run + 0.03;
            addSheet(tiles, 4, 1, [&](double u, double v) {
                const double half = width * (0.52 - 0.04 * (1 - v));
                const double lift = (v > 0.5 ? 0.035 : 0.0) - 0.02;
                return dvec3(x - half * cosTurns(0.5 * u), lift + 0.085 * sinTurns(0.5 * u),
                             v > 0.5 ? z1 : std::max(z0, 0.0));
            });
        }
}

void addCage(MeshBuilder& m, double radius, double low, double high, int count) {
    constexpr double kHalfBar = 0.007;
    const glm::dmat4 saved = m.transform();
    std::vector<dvec3> hoop;
    for (int i = 0; i <= count; ++i) {
        const double turn = double(i) / count;
        hoop.emplace_back(radius * cosTurns(turn), low, radius * sinTurns(turn));
        if (i == count)
            break;
        m.setTransform(saved * placement(hoop.back(), -turn));
        addBox(m, {-kHalfBar, 0, -kHalfBar}, {kHalfBar, high - low, kHalfBar});
    }
    m.setTransform(saved);
    addTube(m, hoop, 1.4 * kHalfBar, 3);
}

namespace {

/// Adds the lantern of a light at the origin: a cap 0.3 above it and the bars that carry it.
void addLantern(MeshBuilder& m) {
    addCage(m, 0.12, -0.16, 0.32, 8);
    addLathe(m,
             {{0.0, 0.33},
              {0.08, 0.32},
              {0.15, 0.3},
              {0.16, 0.315},
              {0.12, 0.38},
              {0.06, 0.43},
              {0.03, 0.46},
              {0.0, 0.47}},
             12);
}

} // namespace

dvec3 addLampPost(MeshBuilder& m, double height) {
    const glm::dmat4 saved = m.transform();
    addLathe(m,
             {{0.16, -0.4},
              {0.16, 0.12},
              {0.1, 0.18},
              {0.12, 0.3},
              {0.065, 0.45},
              {0.055, 0.5 * height},
              {0.075, 0.5 * height + 0.05},
              {0.05, 0.5 * height + 0.1},
              {0.042, height},
              {0.0, height + 0.1}},
             10);
    std::vector<dvec3> arm;
    for (int i = 0; i <= 10; ++i) {
        const double t = 0.5 * i / 10;
        arm.emplace_back(0.35 - 0.35 * cosTurns(t), height - 0.05 + 0.3 * sinTurns(t), 0);
    }
    addTube(m, arm, 0.025, 6);
    const dvec3 light(0.7, height - 0.5, 0);
    m.setTransform(saved * placement(light));
    addLantern(m);
    m.setTransform(saved);
    return light;
}

void addColumn(MeshBuilder& m, double height, double radius, int segments) {
    const double r = radius;
    addBox(m, {-1.4 * r, 0, -1.4 * r}, {1.4 * r, 0.4 * r, 1.4 * r}, false);
    std::vector<dvec2> base;
    for (int i = 0; i <= 5; ++i)
        base.emplace_back(r * (1.12 + 0.2 * sinTurns(0.5 * i / 5)), r * (0.4 + 0.35 * i / 5));
    base.emplace_back(r, 0.85 * r);
    addLathe(m, base, segments);
    const double foot = 0.85 * r, head = height - 0.95 * r;
    std::vector<dvec2> shaft;
    for (int i = 0; i <= 7; ++i) {
        const double t = i / 7.0;
        shaft.emplace_back(r * (1.0 - 0.17 * t * t), foot + (head - foot) * t);
    }
    addLathe(m, shaft, segments, 0.06, segments / 4);
    std::vector<dvec2> echinus = {
        {0.83 * r, head}, {0.92 * r, head + 0.06 * r}, {0.85 * r, head + 0.12 * r}};
    for (int i = 0; i <= 4; ++i)
        echinus.emplace_back(r * (0.86 + 0.42 * sinTurns(0.25 * i / 4)),
                             head + r * (0.15 + 0.1 * i));
    addLathe(m, echinus, segments);
    addBox(m, {-1.3 * r, height - 0.42 * r, -1.3 * r}, {1.3 * r, height, 1.3 * r});
}

void addHangingChain(MeshBuilder& m, dvec3 a, dvec3 b, double sag, double wireRadius) {
    const double length = glm::length(b - a), pitch = 5.0 * wireRadius;
    const int count = std::max(2, int((length + 2.0 * sag * sag / length) / pitch));
    const glm::dmat4 saved = m.transform();
    const auto at = [&](double t) {
        return a + (b - a) * t - dvec3(0, 4.0 * sag * t * (1.0 - t), 0);
    };
    for (int i = 0; i < count; ++i) {
        const dvec3 p = at(double(i) / count), q = at(double(i + 1) / count);
        const dvec3 y = glm::normalize(p - q),
                    z = glm::normalize(glm::cross(y, dvec3(0.3, 0.1, 0.9)));
        const dvec3 x = glm::cross(y, z);
        m.setTransform(saved * (i & 1 ? frameOf(p, z, y, -x) : frameOf(p, x, y, z)));
        addChain(m, glm::length(p - q), wireRadius, 6, 4); // one link
    }
    m.setTransform(saved);
}

dvec3 addWallLamp(MeshBuilder& m) {
    const glm::dmat4 saved = m.transform();
    std::vector<dvec3> arm;
    for (int i = 0; i <= 8; ++i) {
        const double t = 0.25 * i / 8;
        arm.emplace_back(0, 0.25 * sinTurns(t), 0.55 - 0.57 * cosTurns(t));
    }
    addTube(m, arm, 0.022, 6);
    addBox(m, {-0.06, -0.14, -0.02}, {0.06, 0.12, 0.03});
    const dvec3 light(0, -0.2, 0.55);
    m.setTransform(saved * placement(light));
    addLantern(m);
    m.setTransform(saved);
    return light;
}

} // namespace shadowdag
