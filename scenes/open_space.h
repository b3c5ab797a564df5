// SPDX-License-Identifier: Apache-2.0
// The part of a scene in which a person could stand: not the gap between two walls, not the inside
// of a solid, not the outside of a closed map. Cameras and lights are placed there.
#pragma once

#include "scenes/surface_sampler.h"
#include "scenes/triangle_tree.h"
#include "scenes/world.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Points at about eye height in open space, found by seeded candidates and a fan of 26 rays each.
/// Deterministic in (triangles, bounds, lights, seed); no scale is assumed.
class OpenSpace {
public:
    struct Station {
        glm::vec3 position;
        float
            openness; ///< median length of the fan's rays; one that hits nothing ends at the bounds
        float clearance;   ///< length of the shortest
        float backShare;   ///< share of the hits that see a triangle from behind
        float escapeShare; ///< share of rays that hit nothing
    };

    /// Draws 512 candidates: half above surfaces that are more level than steep, by area, a quarter
    /// anywhere in the bounds, and a quarter around `lights` or, without any, above surfaces too.
    /// One that finds a floor below rises above it by 0.2 to 0.6 of the height to the ceiling or,
    /// under the sky, of its openness. Kept are, one rule after the other and each unless it would
    /// leave nothing, those which
    /// - see at most 0.1 more of back faces than the least tenth of candidates: in a mesh of
    ///   consistent orientation that leaves out solids and the far side of one-sided walls, in any
    ///   other it leaves out little;
    /// - let at most 0.55 of the rays escape, or a quarter more than the least quarter: 0.65 do on
    ///   a plane under the sky, such as a roof;
    /// - lie in a room whose stations' fans hit at least 3/10 as many different triangles as those
    ///   of the most varied room. Stations that see each other, directly or over others, share a
    ///   room. This leaves out the long and tall gap between two walls, which few triangles bound;
    /// - are at least half as open as the 3/4 quantile of these, typicalOpenness(): niches;
    /// - keep a tenth of that openness free along every ray of the fan.
    /// @param triangles, lights must outlive this and not move.
    OpenSpace(TriangleView triangles, const Box& bounds, const std::vector<Light>& lights,
              uint64_t seed);

    /// Returns the kept candidates; never empty.
    const std::vector<Station>& stations() const { return stations_; }
    /// Returns a length that separates near from far, world units; > 0 unless the scene is a point.
    float typicalOpenness() const { return typicalOpenness_; }
    /// Returns the share of back faces that the least tenth of the candidates see.
    float typicalBackShare() const { return typicalBackShare_; }
    /// Returns places at eye height around a point, of up to `tries`: those that see no more back
    /// faces than stations may. Unlike stations they may be narrow, cramped, or in rooms that are
    /// less varied or less open than others.
    std::vector<Station> stationsAround(const glm::vec3& point, int tries,
                                        PlacementRandom& random) const;
    const TriangleTree& tree() const { return tree_; }

    /// Returns whether the segment between the two points is unblocked.
    bool sees(const glm::vec3& from, const glm::vec3& to) const;
    /// Returns how many of the 12 stations nearest to the point see it; counting stops at `enough`.
    int stationsInSight(const glm::vec3& point, int enough) const;

private:
    Station probe(const glm::vec3& position, std::vector<uint32_t>* triangles = nullptr) const;
    void moveAside(glm::vec3& position, const glm::vec3& at, PlacementRandom& random) const;
    void keepVariedRooms();
    bool raiseToEyeHeight(glm::vec3& position, double share) const;

    Box bounds_;
    TriangleTree tree_;
    std::vector<Station> stations_;
    float typicalOpenness_ = 0.0f;
    float typicalBackShare_ = 0.0f;
};

/// Returns the distance from a point of the bounds to the next surface, or to the end of the bounds
/// if there is none.
float spaceAlong(const TriangleTree& tree, const Box& bounds, const glm::vec3& point,
                 const glm::vec3& direction);

} // namespace shadowdag
