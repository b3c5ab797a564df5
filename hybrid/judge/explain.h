// SPDX-License-Identifier: Apache-2.0
// Why a method was wrong about a pair: acne, contact, explained by a shift within its resolution,
// or unexplained.
//
// Acne (false shadows only): the blocker is the receiver's own surface, that is its triangle or one
// in its plane to within the truth's c (Truth::isCoplanar). Connected or not makes no difference:
// no triangle in the plane can shadow a point of it, so this counts more than asked, never less.
//     DAG: such a triangle touches the closed cell that stopped the ray.
//     Map: the blocking texel's point is within one texel of the receiver's plane, and the first
//     triangle that Embree meets from the light through that point is such a triangle.
//
// Contact (false lights only): every blocker that Embree has lies nearer to an end of its ray than
// the offset, that is: with the ray cut by the offsets nothing blocks it.
//     DAG: the distances by which shadowSegment moved the two ends.
//     Map: the part of the ray that the lookup's bias leaves out (shadow_map_lookup.h): the share
//     2 k / N of its length next to the receiver, k = constantTexels. Nothing at the light's end.
//     Last, where nothing else says why (see settled): the truth along the taps' own rays is dark,
//     and lit once these rays end by the bias before the planes.
//
// Explained: of 32 fixed shifts perpendicular to the ray, no longer than rho, both ends by one
// vector, the start lifted back to the lit side of the receiver's plane, Embree answers at least
// one as the method did.
//     DAG: rho = sqrt(3) voxels of the level that was hit (of the level at the start, when nothing
//     was) + the start's lift.
//     Triangles (exact rays, and what moves under any): they are held against the truth's own ray,
//     so only rounding can differ: rho = c of truth.h; never acne, never contact.
//     Map: rho = the filter's radius (half the diagonal of its box: sqrt(2) texels with 9 taps,
//     sqrt(1/2) with 4, 0 with one) + one texel, at the blocker: the map's for a false shadow,
//     Embree's nearest to the receiver for a false light.
//
// Settled (what none of the 32 explains; it stays counted as unexplained): more is known than that
// something near would agree.
//     DAG, false shadow: a shift no longer than rho, aimed at the corners and the middle of each
//     triangle's part within the cell that was hit, finds it in the truth too. The 32 sample a disc
//     of area pi rho^2 and miss what is small in it, a wire's end or a leaf seen edge-on.
//     Map, false shadow: so does a shift aimed at the blocking texel's point.
//     Map, both: the truth asked along the very rays that the map answers, light to texel centre to
//     the planes of the lookup without its bias, tap by tap, and weighted as the taps are, gives
//     the method's answer. The map then holds what is there, and the error is where it was sampled:
//     no ray of those lies farther than rho from the pair's own. This asks more than the 32 do, of
//     which any may agree: a map that misses a wall is not settled (error_test.cpp). What the 32
//     miss is a gap or a rim of a texel's size that a tap sees, and light at grazing angles, where
//     a tap's ray ends on the receiver's plane far from the receiver, while a shift that is lifted
//     back to that plane stays over it.
#pragma once

#include "hybrid/judge/error.h"

namespace shadowdag {

constexpr int kShiftCount = 32;

/// Returns the shifts in the unit disc: 24 of a sunflower (radius sqrt((i + 1/2) / 24), golden
/// angle) and, after every third of them, one of 8 on the rim, all turned by a seeded angle. Basic
/// IEEE operations only. Source of the sunflower: Vogel, A Better Way to Construct the Sunflower
/// Head, Mathematical Biosciences 1979.
std::array<glm::dvec2, kShiftCount> makeShifts(uint64_t seed);

/// Judges single pairs. Const and thread safe.
class PairJudge {
public:
    PairJudge(const ErrorInputs& inputs, const Truth& truth, uint64_t seed);

    /// Returns what a wrong pair is. @param isDark the method's answer, the reverse of the truth's
    PairVerdict judge(uint32_t sample, uint64_t pair, bool isDark) const;

    /// What would call a right answer's reverse explained or settled.
    struct Flips {
        bool byShifts = false; ///< any of the 32 shifted rays differs from the answer
        bool hasTaps = false;  ///< a map answered, with all pages at hand
        bool byTaps = false;   ///< the truth along the taps' own rays differs from the answer
    };
    /// Returns what differs from a right pair's answer. @param isDark that answer
    Flips flips(uint32_t sample, uint64_t pair, bool isDark) const;

private:
    struct Question;
    Question ask(uint32_t sample, uint64_t pair, bool isDark) const;
    bool isAcne(const Question& q) const;
    bool isContact(const Question& q) const;
    bool hasTaps(const Question& q) const;
    bool anyShiftAnswers(const Question& q, bool dark) const;
    bool anyAimedShiftIsDark(const Question& q) const;
    bool isDarkByTruthTaps(const Question& q, float constantTexels) const;

    const ErrorInputs& inputs_;
    const Truth& truth_;
    std::array<glm::dvec2, kShiftCount> shifts_;
};

} // namespace shadowdag
