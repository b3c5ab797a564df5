// SPDX-License-Identifier: Apache-2.0
// Why a method was wrong about a pair: acne, contact, magnified, explained by a shift within its
// resolution, or unexplained.
//
// Acne (false shadows only): the blocker is the receiver's own surface, that is
//   - its triangle or one in its plane to within the truth's c (Truth::isCoplanar). They need not
//     be connected: no triangle in the plane can shadow a point of it, so this counts too many
//     pairs rather than too few; or
//   - one that continues it smoothly within rho of the sample (smooth_patch.h: connected by shared
//     vertices, its plane within 45 degrees), if the blocker itself lies within rho.
//     DAG: such a triangle touches the closed cell that stopped the ray.
//     Map: the first triangle that Embree meets from the light through the blocking texel's point
//     is such a triangle; in the plane, that point is within one texel of it.
//
// Contact (false lights only): every blocker found by Embree is nearer to an end of its ray than
// the offset, that is: the ray shortened by the offsets is unblocked.
//     DAG: the distances by which the documented offset moves the two ends (own_segment.h), made
//     without the method's code.
//     Map: the part of the ray that the lookup's bias skips (shadow_map_lookup.h): the share 2 k /
//     N of its length next to the receiver, k = constantTexels, N the texels of rho below. Nothing
//     at the light's end.
//
// Magnified: the method's resolution lets a shadow's edge be displaced at the sample by more than
// kMagnifiedFootprints footprints of a pixel there: a voxel or texel is small where the blocker is
// and large where its shadow falls. Such an error is not counted as explained; but it must be found
// by one of the shifts below, or by one aimed at the blocker, or it is unexplained.
//     DAG: the cell that stopped the ray, of side s, is at the distance t from the light, the
//     sample at d: sqrt(3) s d / t + the lift, t to the cell's middle, at least s / 2. For a false
//     light the cell at the start.
//     Triangles: never.
//     Map: rho below, with the texel at the receiver.
//
// Explained: of 32 fixed shifts perpendicular to the ray, no longer than rho, both ends by one
// vector, the start lifted back to the lit side of the receiver's plane, Embree gives the method's
// result for at least one.
//     DAG: rho = sqrt(3) voxels of the level that was hit (of the level at the start, if there was
//     no hit; not of a coarser one than the rule of levels asks there, own_segment.h) + the start's
//     lift.
//     Triangles (exact rays, and moving geometry with any): they are compared with the truth's own
//     ray, so only rounding can differ: rho = c of truth.h; never acne, never contact.
//     Map: rho = the filter's radius (half the diagonal of its box: sqrt(2) texels with 9 taps,
//     sqrt(1/2) with 4, 0 with one) + one texel, at the blocker: the map's for a false shadow,
//     Embree's nearest to the receiver for a false light. The texel is that of the resolution that
//     the map's clusters request, if the map has fewer (a full pool, a fault): a map that is
//     coarser than the equation asks does not excuse itself. One that has more, since allocation
//     rounds up, is held to what it has; so is the window of a sun, whose size no equation asks.
//
// Settled (not explained by any of the 32; still counted as unexplained): there is stronger
// evidence than a nearby ray that agrees.
//     DAG, false shadow: a shift no longer than rho, aimed at the corners and the middle of each
//     triangle's part within the cell that was hit, is dark in the truth too. The 32 sample a disc
//     of area pi rho^2 and miss small objects in it, a wire's end or a leaf seen edge-on.
//     Map, false shadow: the same with a shift aimed at the blocking texel's point.
//     Map, both: the truth traced along the rays of the map's taps, light to texel centre to the
//     planes of the lookup, without its bias or with it, weighted as the taps are, gives the
//     method's result.
//     These rays are made without the method's code (own_taps.h), so that a fault of its geometry
//     does not excuse itself.
//     The map's content is then right, and the error is in the position of its samples: none of
//     those rays is farther than rho from the pair's own. This is stricter than the 32 shifts, of
//     which any may agree: a map that misses a wall is not settled (error_test.cpp). The 32 miss a
//     gap or a rim of a texel's size that a tap sees, and light at grazing angles, where a tap's
//     ray ends on the receiver's plane far from the receiver, while a shift that is lifted back to
//     that plane stays over it.
#pragma once

#include "hybrid/judge/error.h"

#include <functional>
#include <string_view>

namespace shadowdag {

constexpr int kShiftCount = 32;

/// The displacement of a shadow's edge, in footprints of a pixel at the sample, beyond which an
/// error is magnified: a viewer sees the edge in another place, not merely blurred or jagged.
constexpr double kMagnifiedFootprints = 8.0;

/// Returns the shifts in the unit disc: 24 of a sunflower (radius sqrt((i + 1/2) / 24), golden
/// angle) and, after every third of them, one of 8 on the rim, all turned by a seeded angle. Basic
/// IEEE operations only. Source of the sunflower: Vogel, A Better Way to Construct the Sunflower
/// Head, Mathematical Biosciences 1979.
std::array<glm::dvec2, kShiftCount> makeShifts(uint64_t seed);

/// What an unexplained error is, where a test of the pair's geometry says so.
enum class FailureName : uint8_t {
    kNone,
    /// A false shadow by a voxel: every part of a triangle within the cell that stopped the ray
    /// lies behind the truth's start of it or beyond its end. Shifts are perpendicular to the ray,
    /// so none meets it.
    kSurfaceBehind,
    /// The same, but every such part is seen edge-on, to within the truth's c: the truth's rays
    /// pass it, wherever they are shifted.
    kSurfaceEdgeOn,
    /// The same of cells with parts of both kinds, or farther from the ray than rho.
    kSurfaceOutOfReach,
    /// The light lies in the receiver's plane to within the truth's c: only rounding decides
    /// whether the pair exists, and half of a filter lies behind the surface.
    kLightInPlane,
    /// A map that has fewer texels than its clusters request, and a shift within the texels that
    /// it has agrees with it.
    kCoarserThanAsked,
};

/// Returns the name in results and studies: "surface-behind"; "" for kNone.
const char* failureNameText(FailureName name);
/// Returns whether a failure's name is one that a test gives.
bool isTestedFailure(std::string_view name);

/// Classifies single pairs. Const and thread safe.
class PairJudge {
public:
    PairJudge(const ErrorInputs& inputs, const Truth& truth, uint64_t seed);

    /// What a wrong pair says of the method's promises.
    struct Promises {
        bool isExact = false;        ///< triangles decided: only rounding can differ
        bool isBeyondBelief = false; ///< dark by a voxel displaced by more than `believe` allows
        bool isCoarserCell = false;  ///< dark by a cell coarser than the rule of levels asks
    };
    /// Returns the class of a wrong pair. @param isDark the method's result, the reverse of the
    /// truth's @param promises receives the rest; may be null
    PairVerdict judge(uint32_t sample, uint64_t pair, bool isDark,
                      Promises* promises = nullptr) const;

    /// Whether the reverse of a right result would be explained or settled.
    struct Flips {
        bool isMagnified = false; ///< its reverse would be magnified: not part of the rate
        bool byShifts = false;    ///< any of the 32 shifted rays differs from the result
        bool hasTaps = false;     ///< by a map that had all pages
        bool byTaps = false;      ///< the truth along the taps' own rays differs from the result
    };
    /// Returns what differs from a right pair's result. @param isDark that result
    Flips flips(uint32_t sample, uint64_t pair, bool isDark) const;

    /// Returns which known failure an unexplained pair is, by a test of its geometry
    /// (failure_names.cpp). @param isDark the method's result
    FailureName nameOf(uint32_t sample, uint64_t pair, bool isDark) const;

private:
    struct Question;
    Question ask(uint32_t sample, uint64_t pair, bool isDark) const;
    /// Returns the normal that lookups used: none without the receiver's plane.
    glm::vec3 planeNormal(const Question& q) const;
    /// Calls visit(triangle) for each that touches the closed cell that stopped a pair's ray.
    void forTrianglesInCell(const Question& q, const std::function<void(uint32_t)>& visit) const;
    Promises promisesOf(const Question& q) const;
    bool isMagnified(const Question& q) const;
    bool isAcne(const Question& q) const;
    bool isContact(const Question& q) const;
    bool hasTaps(const Question& q) const;
    bool anyShiftAgrees(const Question& q, bool dark) const;
    bool anyAimedShiftIsDark(const Question& q) const;
    bool isDarkByTruthTaps(const Question& q, float constantTexels) const;

    const ErrorInputs& inputs_;
    const Truth& truth_;
    std::array<glm::dvec2, kShiftCount> shifts_;
};

} // namespace shadowdag
