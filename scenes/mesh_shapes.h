// SPDX-License-Identifier: Apache-2.0
// Generators of triangle meshes: boxes, extrusions, arches, lathes, tubes, chains, sheets, leaves.
// All arithmetic is double with + - * / sqrt only (own sine), then rounded to float once, so that
// the same bits come out everywhere. Not a modelling kernel: no booleans, no smoothing, no texture
// space.
#pragma once

#include "scenes/scene.h"

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

/// Returns sin(2 pi turns), |error| < 1e-12, from IEEE basic operations only: libm may differ by
/// machine.
double sinTurns(double turns);

/// Returns cos(2 pi turns) in the same way.
double cosTurns(double turns);

/// Seeded sequence of numbers from an integer hash; equal on every machine. Draw once per
/// expression: compilers evaluate operands and arguments in different orders.
/// Source: Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, OOPSLA 2014
/// (SplitMix64).
class HashRandom {
public:
    explicit HashRandom(uint64_t seed) : state_(seed) {}
    uint64_t bits();
    double unit() { return double(bits() >> 11) * (1.0 / 9007199254740992.0); } ///< in [0, 1)
    double between(double low, double high) { return low + (high - low) * unit(); }
    uint32_t below(uint32_t count) { return uint32_t((bits() >> 32) * count >> 32); }

private:
    uint64_t state_;
};

/// Collects triangles of one mesh. Points go through `toMesh` (object from shape) when they are
/// added; triangles carry the current material. Faces are wound counter-clockwise seen from outside
/// as long as toMesh does not mirror.
class MeshBuilder {
public:
    explicit MeshBuilder(std::string name, uint32_t material = 0) : material_(material) {
        mesh_.name = std::move(name);
    }

    void setMaterial(uint32_t material) { material_ = material; }
    /// Sets the placement of further shapes: rotated about +Y by `yawTurns`, then moved.
    void moveTo(glm::dvec3 offset, double yawTurns = 0.0, double scale = 1.0);
    /// Sets the whole map from shape to object space.
    void setTransform(const glm::dmat4& objectFromShape) { toMesh_ = objectFromShape; }
    const glm::dmat4& transform() const { return toMesh_; }

    uint32_t vertex(const glm::dvec3& p);
    /// The same with texture coordinates, for materials with a mask.
    uint32_t vertex(const glm::dvec3& p, const glm::vec2& uv);
    void triangle(uint32_t a, uint32_t b, uint32_t c);
    void quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d);
    /// Adds a quad with four vertices of its own.
    void quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d);

    /// Returns the mesh and leaves the builder empty.
    Mesh take() { return std::move(mesh_); }
    size_t triangleCount() const { return mesh_.triangles.size(); }

private:
    Mesh mesh_;
    uint32_t material_;
    glm::dmat4 toMesh_{1.0};
};

/// Returns the map that turns about +X, then +Y, then moves. Angles in turns.
glm::dmat4 placement(glm::dvec3 offset, double yawTurns = 0.0, double pitchTurns = 0.0,
                     double scale = 1.0);

/// Adds a closed box; `withBottom` false omits the -Y face (for objects on a floor).
void addBox(MeshBuilder& m, glm::dvec3 min, glm::dvec3 max, bool withBottom = true);

/// Adds a closed hexahedron: corners 0..3 counter-clockwise seen from below, 4..7 above them.
void addHexahedron(MeshBuilder& m, const glm::dvec3 (&corners)[8]);

/// Adds a surface of revolution about Y. `profile`: (radius, y) from bottom to top; radius 0 closes
/// an end, otherwise ends stay open. segments * 2 * (profile - 1) triangles, fewer at closed ends.
/// @param fluteDepth radius is reduced by up to this share along `fluteCount` vertical grooves.
void addLathe(MeshBuilder& m, const std::vector<glm::dvec2>& profile, int segments,
              double fluteDepth = 0.0, int fluteCount = 0);

/// Adds a tube of `sides` sides along a polyline (at least two different points), ends closed.
void addTube(MeshBuilder& m, const std::vector<glm::dvec3>& path, double radius, int sides);

/// Adds a tube whose radius is given per path point (tree trunks, horns); radii > 0.
void addTaperedTube(MeshBuilder& m, const std::vector<glm::dvec3>& path,
                    const std::vector<double>& radii, int sides);

/// Adds a chain of oval links hanging down from y = 0 to y = -length, every other one turned a
/// quarter.
/// @param wireRadius of the links' wire; link length is about 7 wire radii.
void addChain(MeshBuilder& m, double length, double wireRadius, int ringSegments, int wireSides);

/// Adds an open sheet: point(u, v) for u, v in [0, 1], uCount * vCount * 2 triangles.
void addSheet(MeshBuilder& m, int uCount, int vCount,
              const std::function<glm::dvec3(double u, double v)>& point);

/// Adds a leaf of two half blades folded along the midrib, from the origin along +X, bending down.
/// 4 * segments - 4 triangles.
void addLeaf(MeshBuilder& m, double length, double width, double droop, int segments);

/// Adds a wall from x = 0 to `span`, y = 0 to `top`, z = -thickness/2 to +thickness/2 with a
/// round-headed opening in the middle: jambs up to `jambHeight`, a half circle of `radius` above.
/// Its two outer ends (x = 0 and span) stay open.
void addArchedWall(MeshBuilder& m, double span, double radius, double jambHeight, double top,
                   double thickness, int segments);

/// Adds the moulding of such an opening: a half ring from `inner` to `outer` radius, centred at the
/// origin, standing `proud` in front of z = 0 (towards +Z). Its back stays open.
void addArchivolt(MeshBuilder& m, double inner, double outer, double proud, int segments);

/// Adds a groin vault over [0, sizeX] x [0, sizeZ]: two half ellipses of height `rise` that cross.
void addGroinVault(MeshBuilder& m, double sizeX, double sizeZ, double rise, int count);

/// Sweeps a closed or open cross-section along the inside of a rectangle with mitred corners.
/// `profile`: (distance from the rectangle towards its middle, y); the rectangle lies at y = 0 with
/// the given half sizes.
void addCornice(MeshBuilder& m, const std::vector<glm::dvec2>& profile, double halfX, double halfZ);

/// Adds a closed ball of latitude-longitude faces.
void addBall(MeshBuilder& m, glm::dvec3 center, double radius, int segments, int rings);

} // namespace shadowdag
