// SPDX-License-Identifier: Apache-2.0
// Objects that several built-in scenes use: trees, facades with openings, tiled roofs, fences,
// lamps. Not used outside scenes/builtin*.cpp.
#pragma once

#include "scenes/mesh_shapes.h"

#include <vector>

namespace shadowdag {

/// Returns the map with these axes (columns) and origin.
glm::dmat4 frameOf(const glm::dvec3& origin, const glm::dvec3& x, const glm::dvec3& y,
                   const glm::dvec3& z);

/// Adds a broad-leaved tree at the origin: trunk, limbs, twigs (tubes) and leaves of 4 triangles
/// each.
/// @param leafCount 0 gives a bare tree.
void addTree(MeshBuilder& m, uint32_t bark, uint32_t leaf, uint64_t seed, double height,
             int leafCount, double leafLength);

/// Adds a slim conifer or cypress: trunk and whorls of drooping leaves.
void addCypress(MeshBuilder& m, uint32_t bark, uint32_t leaf, uint64_t seed, double height,
                int leafCount);

/// A rectangular hole in a facade, in its frame.
struct Opening {
    double x, y, width, height; ///< lower left corner and size, metres
    bool isDoor;                ///< a plank instead of glass, no sill
    bool isLit;                 ///< emissive glass
};

struct FacadeMaterials {
    uint32_t wall, frame, glass, litGlass, shutter;
};

/// Adds a wall over [0, width] x [0, height] of real thickness (front at z = 0, back at -thickness)
/// with its openings: reveals, sunken pane, glazing bars, sill and louvred shutters.
void addFacade(MeshBuilder& wall, MeshBuilder& thin, const FacadeMaterials& mat, double width,
               double height, double thickness, const std::vector<Opening>& openings);

/// Adds one slope of a roof: a slab of 0.12 under rows of barrel tiles. Frame: x along the eave [0,
/// length], z down the slope [0, slopeLength], y outwards.
void addTiledSlope(MeshBuilder& slab, MeshBuilder& tiles, double length, double slopeLength);

/// Adds a Doric column from y = 0 to `height`: plinth, base, fluted shaft, echinus, abacus.
void addColumn(MeshBuilder& m, double height, double radius, int segments);

/// Adds a chain from a to b that sags by `sag` in the middle.
void addHangingChain(MeshBuilder& m, glm::dvec3 a, glm::dvec3 b, double sag, double wireRadius);

/// Adds `count` upright bars at `radius` from the axis, from y = `low` to y = `high`, on a hoop at
/// the foot: the cage of a lantern about the light at the origin.
void addCage(MeshBuilder& m, double radius, double low, double high, int count);

/// Adds a lamp post at the origin whose lantern hangs from a curved arm towards +X; returns where
/// the light lies: in a cage of eight bars, 0.3 under the cap.
glm::dvec3 addLampPost(MeshBuilder& m, double height);

/// Adds a lantern on a bracket that stands out of a wall at z = 0 towards +Z, at height 0; returns
/// where the light lies: 0.55 before the wall, in a cage of eight bars, 0.3 under the cap.
glm::dvec3 addWallLamp(MeshBuilder& m);

} // namespace shadowdag
