// SPDX-License-Identifier: Apache-2.0
#include "scenes/mesh_shapes.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

double sinTurns(double turns) {
    // Reduce to [-1/4, 1/4] turns, where the Taylor series to x^17 leaves less than 1e-13.
    double t = turns - std::floor(turns + 0.5);
    if (t > 0.25)
        t = 0.5 - t;
    else if (t < -0.25)
        t = -0.5 - t;
    const double x = t * 6.283185307179586476925;
    const double x2 = x * x;
    double sum = 0.0;
    for (int n = 17; n >= 3; n -= 2)
        sum = (1.0 + sum) * (-x2 / double(n * (n - 1)));
    return x * (1.0 + sum);
}

double cosTurns(double turns) {
    return sinTurns(turns + 0.25);
}

uint64_t HashRandom::bits() {
    state_ += 0x9e3779b97f4a7c15ull;
    uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

glm::dmat4 placement(dvec3 offset, double yawTurns, double pitchTurns, double scale) {
    const double cy = cosTurns(yawTurns), sy = sinTurns(yawTurns);
    const double cp = cosTurns(pitchTurns), sp = sinTurns(pitchTurns);
    // Columns of Ry(yaw) * Rx(pitch), scaled.
    return glm::dmat4(dvec4(cy, 0, -sy, 0) * scale, dvec4(sy * sp, cp, cy * sp, 0) * scale,
                      dvec4(sy * cp, -sp, cy * cp, 0) * scale, dvec4(offset, 1));
}

void MeshBuilder::moveTo(dvec3 offset, double yawTurns, double scale) {
    toMesh_ = placement(offset, yawTurns, 0.0, scale);
}

uint32_t MeshBuilder::vertex(const dvec3& p) {
    mesh_.positions.push_back(glm::vec3(dvec3(toMesh_ * dvec4(p, 1.0))));
    if (!mesh_.uv.empty())
        mesh_.uv.emplace_back(0.0f);
    return uint32_t(mesh_.positions.size() - 1);
}

uint32_t MeshBuilder::vertex(const dvec3& p, const glm::vec2& uv) {
    const uint32_t index = vertex(p);
    mesh_.uv.resize(mesh_.positions.size(), glm::vec2(0.0f));
    mesh_.uv[index] = uv;
    return index;
}

void MeshBuilder::triangle(uint32_t a, uint32_t b, uint32_t c) {
    mesh_.triangles.emplace_back(a, b, c);
    mesh_.triangleMaterial.push_back(material_);
}

void MeshBuilder::quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    triangle(a, b, c);
    triangle(a, c, d);
}

void MeshBuilder::quad(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
    const uint32_t i = vertex(a), j = vertex(b), k = vertex(c), l = vertex(d);
    quad(i, j, k, l);
}

void addHexahedron(MeshBuilder& m, const dvec3 (&c)[8]) {
    uint32_t v[8];
    for (int i = 0; i < 8; ++i)
        v[i] = m.vertex(c[i]);
    m.quad(v[0], v[1], v[2], v[3]);
    m.quad(v[7], v[6], v[5], v[4]);
    for (int i = 0; i < 4; ++i) {
        const int j = (i + 1) & 3;
        m.quad(v[i], v[i + 4], v[j + 4], v[j]);
    }
}

void addBox(MeshBuilder& m, dvec3 a, dvec3 b, bool withBottom) {
    uint32_t v[8];
    const dvec3 corners[8] = {{a.x, a.y, a.z}, {b.x, a.y, a.z}, {b.x, a.y, b.z}, {a.x, a.y, b.z},
                              {a.x, b.y, a.z}, {b.x, b.y, a.z}, {b.x, b.y, b.z}, {a.x, b.y, b.z}};
    for (int i = 0; i < 8; ++i)
        v[i] = m.vertex(corners[i]);
    if (withBottom)
        m.quad(v[0], v[1], v[2], v[3]);
    m.quad(v[7], v[6], v[5], v[4]);
    for (int i = 0; i < 4; ++i) {
        const int j = (i + 1) & 3;
        m.quad(v[i], v[i + 4], v[j + 4], v[j]);
    }
}

void addLathe(MeshBuilder& m, const std::vector<dvec2>& profile, int segments, double fluteDepth,
              int fluteCount) {
    std::vector<uint32_t> before, now;
    for (size_t row = 0; row < profile.size(); ++row) {
        const auto [radius, y] = std::pair(profile[row].x, profile[row].y);
        now.clear();
        if (radius == 0.0) {
            now.assign(size_t(segments), m.vertex({0, y, 0}));
        } else {
            for (int i = 0; i < segments; ++i) {
                const double t = double(i) / segments;
                double r = radius;
                if (fluteCount > 0)
                    r *= 1.0 - fluteDepth * (0.5 - 0.5 * cosTurns(t * fluteCount));
                now.push_back(m.vertex({r * cosTurns(t), y, r * sinTurns(t)}));
            }
        }
        if (row > 0) {
            for (int i = 0; i < segments; ++i) {
                const size_t j = size_t((i + 1) % segments), k = size_t(i);
                if (before[k] != before[j])
                    m.triangle(before[k], now[j], before[j]);
                if (now[k] != now[j])
                    m.triangle(before[k], now[k], now[j]);
            }
        }
        std::swap(before, now);
    }
}

void addTaperedTube(MeshBuilder& m, const std::vector<dvec3>& path,
                    const std::vector<double>& radii, int sides) {
    const size_t count = path.size();
    std::vector<uint32_t> ring, before;
    dvec3 side(0);
    for (size_t k = 0; k < count; ++k) {
        const dvec3 along = glm::normalize(path[std::min(k + 1, count - 1)] - path[k ? k - 1 : 0]);
        // Carry the previous side vector along, so that the tube does not twist.
        if (k == 0)
            side = std::abs(along.y) < 0.8 ? dvec3(0, 1, 0) : dvec3(1, 0, 0);
        side = glm::normalize(side - along * glm::dot(side, along));
        const dvec3 other = glm::cross(along, side);
        ring.clear();
        for (int i = 0; i < sides; ++i) {
            const double t = double(i) / sides;
            ring.push_back(
                m.vertex(path[k] + (side * cosTurns(t) + other * sinTurns(t)) * radii[k]));
        }
        if (k > 0)
            for (int i = 0; i < sides; ++i) {
                const size_t j = size_t((i + 1) % sides);
                m.quad(before[size_t(i)], before[j], ring[j], ring[size_t(i)]);
            }
        else
            for (int i = 2; i < sides; ++i)
                m.triangle(ring[0], ring[size_t(i)], ring[size_t(i) - 1]);
        before = ring;
    }
    for (int i = 2; i < sides; ++i)
        m.triangle(ring[0], ring[size_t(i) - 1], ring[size_t(i)]);
}

void addTube(MeshBuilder& m, const std::vector<dvec3>& path, double radius, int sides) {
    addTaperedTube(m, path, std::vector<double>(path.size(), radius), sides);
}

void addChain(MeshBuilder& m, double length, double wireRadius, int ringSegments, int wireSides) {
    const double halfLong = 3.5 * wireRadius, halfWide = 2.4 * wireRadius;
    const double pitch = 2.0 * (halfLong - wireRadius); // each link hangs in the last one's bend
    const int linkCount = std::max(1, int(length / pitch));
    for (int link = 0; link < linkCount; ++link) {
        const double y = -(link + 0.5) * (length / linkCount);
        std::vector<uint32_t> first, before, ring;
        for (int i = 0; i <= ringSegments; ++i) {
            if (i == ringSegments) {
                ring = first;
            } else {
                const double t = double(i) / ringSegments;
                const dvec2 center(halfWide * cosTurns(t), halfLong * sinTurns(t));
                const dvec2 out =
                    glm::normalize(dvec2(cosTurns(t) / halfWide, sinTurns(t) / halfLong));
                ring.clear();
                for (int j = 0; j < wireSides; ++j) {
                    const double s = double(j) / wireSides;
                    const dvec2 p = center + out * (wireRadius * cosTurns(s));
                    const double q = wireRadius * sinTurns(s);
                    ring.push_back(
                        m.vertex(link & 1 ? dvec3(q, y + p.y, -p.x) : dvec3(p.x, y + p.y, q)));
                }
                if (i == 0)
                    first = ring;
            }
            if (i > 0)
                for (int j = 0; j < wireSides; ++j) {
                    const size_t a = size_t(j), b = size_t((j + 1) % wireSides);
                    m.quad(before[a], ring[a], ring[b], before[b]);
                }
            before = ring;
        }
    }
}

void addSheet(MeshBuilder& m, int uCount, int vCount,
              const std::function<dvec3(double, double)>& point) {
    std::vector<uint32_t> ids;
    for (int v = 0; v <= vCount; ++v)
        for (int u = 0; u <= uCount; ++u)
            ids.push_back(m.vertex(point(double(u) / uCount, double(v) / vCount)));
    const auto id = [&](int u, int v) { return ids[size_t(v * (uCount + 1) + u)]; };
    for (int v = 0; v < vCount; ++v)
        for (int u = 0; u < uCount; ++u)
            m.quad(id(u, v), id(u + 1, v), id(u + 1, v + 1), id(u, v + 1));
}

void addLeaf(MeshBuilder& m, double length, double width, double droop, int segments) {
    // Half width along the midrib: a parabola; both ends are points. The blades rise from the
    // midrib.
    std::vector<uint32_t> mid, left, right;
    for (int i = 0; i <= segments; ++i) {
        const double t = double(i) / segments;
        const double half = 2.0 * width * t * (1.0 - t);
        const dvec3 p(length * t, -droop * t * t, 0);
        mid.push_back(m.vertex(p));
        if (i > 0 && i < segments) {
            left.push_back(m.vertex(p + dvec3(0, 0.35 * half, -half)));
            right.push_back(m.vertex(p + dvec3(0, 0.35 * half, half)));
        } else {
            left.push_back(mid.back());
            right.push_back(mid.back());
        }
    }
    const auto emit = [&](uint32_t a, uint32_t b, uint32_t c) {
        if (a != b && b != c && a != c)
            m.triangle(a, b, c);
    };
    for (size_t i = 0; i < size_t(segments); ++i) {
        emit(mid[i], mid[i + 1], left[i + 1]);
        emit(mid[i], left[i + 1], left[i]);
        emit(mid[i], right[i + 1], mid[i + 1]);
        emit(mid[i], right[i], right[i + 1]);
    }
}

void addArchedWall(MeshBuilder& m, double span, double radius, double jambHeight, double top,
                   double thickness, int segments) {
    const double z = thickness / 2, x0 = span / 2 - radius, x1 = span / 2 + radius;
    const auto panel = [&](dvec2 a, dvec2 b, dvec2 c, dvec2 d) { // a..d ccw seen from +Z
        m.quad(dvec3(a, z), dvec3(b, z), dvec3(c, z), dvec3(d, z));
        m.quad(dvec3(d, -z), dvec3(c, -z), dvec3(b, -z), dvec3(a, -z));
    };
    panel({0, 0}, {x0, 0}, {x0, top}, {0, top});
    panel({x1, 0}, {span, 0}, {span, top}, {x1, top});
    m.quad({0, 0, z}, {0, 0, -z}, {x0, 0, -z}, {x0, 0, z});
    m.quad({x1, 0, z}, {x1, 0, -z}, {span, 0, -z}, {span, 0, z});
    m.quad({0, top, z}, {span, top, z}, {span, top, -z}, {0, top, -z});
    if (jambHeight > 0.0) {
        m.quad({x0, 0, z}, {x0, 0, -z}, {x0, jambHeight, -z}, {x0, jambHeight, z});
        m.quad({x1, 0, -z}, {x1, 0, z}, {x1, jambHeight, z}, {x1, jambHeight, -z});
    }
    for (int i = 0; i < segments; ++i) {
        const double s = 0.5 - 0.5 * i / segments, t = 0.5 - 0.5 * (i + 1) / segments;
        const dvec2 p(span / 2 + radius * cosTurns(s), jambHeight + radius * sinTurns(s));
        const dvec2 q(span / 2 + radius * cosTurns(t), jambHeight + radius * sinTurns(t));
        panel(p, q, {q.x, top}, {p.x, top});
        m.quad(dvec3(p, z), dvec3(p, -z), dvec3(q, -z), dvec3(q, z));
    }
}

void addArchivolt(MeshBuilder& m, double inner, double outer, double proud, int segments) {
    std::vector<uint32_t> before, now;
    for (int i = 0; i <= segments; ++i) {
        const double t = 0.5 * i / segments;
        const dvec2 d(cosTurns(t), sinTurns(t));
        const double middle = inner + (outer - inner) * 0.45;
        now.clear();
        for (const dvec2& p :
             {dvec2(inner, 0), dvec2(inner, proud * 0.7), dvec2(middle, proud * 0.7),
              dvec2(middle, proud), dvec2(outer, proud), dvec2(outer, 0)})
            now.push_back(m.vertex(dvec3(d * p.x, p.y)));
        if (i > 0)
            for (size_t k = 0; k + 1 < now.size(); ++k)
                m.quad(before[k], before[k + 1], now[k + 1], now[k]);
        before = now;
    }
}

void addGroinVault(MeshBuilder& m, double sizeX, double sizeZ, double rise, int count) {
    const auto arc = [](double t) { // half ellipse over [0, 1]
        const double c = 2.0 * t - 1.0;
        return std::sqrt(std::max(0.0, 1.0 - c * c));
    };
    std::vector<uint32_t> ids;
    // Points crowd towards the springing, where the ellipse is steep.
    const auto place = [&](int i) { return 0.5 - 0.5 * cosTurns(0.5 * double(i) / count); };
    for (int j = 0; j <= count; ++j)
        for (int i = 0; i <= count; ++i) {
            const double u = place(i), v = place(j);
            ids.push_back(m.vertex({sizeX * u, rise * std::max(arc(u), arc(v)), sizeZ * v}));
        }
    const auto id = [&](int i, int j) { return ids[size_t(j * (count + 1) + i)]; };
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i) {
            // The diagonal of each cell follows the groin of its quadrant.
            const bool rising = (2 * i < count) == (2 * j < count);
            const uint32_t a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
            if (rising) {
                m.triangle(a, b, c);
                m.triangle(a, c, d);
            } else {
                m.triangle(a, b, d);
                m.triangle(b, c, d);
            }
        }
}

void addCornice(MeshBuilder& m, const std::vector<dvec2>& profile, double halfX, double halfZ) {
    const double sx[4] = {-1, 1, 1, -1}, sz[4] = {-1, -1, 1, 1};
    std::vector<uint32_t> ids;
    for (int corner = 0; corner < 4; ++corner)
        for (const dvec2& p : profile)
            ids.push_back(m.vertex({sx[corner] * (halfX - p.x), p.y, sz[corner] * (halfZ - p.x)}));
    const size_t n = profile.size();
    for (size_t corner = 0; corner < 4; ++corner) {
        const size_t a = corner * n, b = (corner + 1) % 4 * n;
        for (size_t k = 0; k + 1 < n; ++k)
            m.quad(ids[a + k], ids[b + k], ids[b + k + 1], ids[a + k + 1]);
    }
}

void addBall(MeshBuilder& m, dvec3 center, double radius, int segments, int rings) {
    const glm::dmat4 saved = m.transform();
    m.setTransform(saved * placement(center));
    std::vector<dvec2> profile;
    for (int i = 0; i <= rings; ++i) {
        const double t = 0.5 * i / rings;
        profile.emplace_back(i == 0 || i == rings ? 0.0 : radius * sinTurns(t),
                             -radius * cosTurns(t));
    }
    addLathe(m, profile, segments);
    m.setTransform(saved);
}

} // namespace shadowdag
