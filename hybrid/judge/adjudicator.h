// SPDX-License-Identifier: Apache-2.0
// The adjudicator: whether a light reaches a sample, decided by proofs. docs/adjudicator.md defines
// the question, derives the clearance and lists the conventions for edges, ends and masks.
//
// A pair means a family of segments (segment_family.h). It is lit when every triangle is proven to
// miss all of them: a plane separates the triangle from the family's convex hull. It is dark when
// all are proven to be crossed: triangles that touch the hull form a surface whose border and whose
// distance to both ends the hull does not reach, so that the number of crossings, counted with
// their signs, is the same for every segment; and it is not 0 for one of them. Else it is
// ambiguous. Signs are exact (exact_sign.h), so no rounding of ours decides a pair.
//
// It shares no arithmetic with the truth, with exact rays, or with the voxels, only their inputs:
// triangles, masks, lights and samples as floats.
#pragma once

#include "hybrid/judge/segment_family.h"
#include "hybrid/judge/triangle_boxes.h"

#include <vector>

namespace shadowdag {

/// What the adjudicator says of a pair.
enum class Verdict : uint8_t { kLit, kDark, kAmbiguous };

/// A verdict with its reasons.
struct Ruling {
    Verdict verdict = Verdict::kAmbiguous;
    /// Ambiguous pairs: one segment was found that is crossed, and one that is free or a light that
    /// may not be asked, so that no better proof exists.
    bool isWitnessed = false;
    /// Triangles that were not proven to miss; of very many only the first are counted, and the
    /// pair is ambiguous.
    uint32_t touchedCount = 0;
};

/// Judges pairs of one set of triangles. Const functions are thread-safe and deterministic.
class Adjudicator {
public:
    /// @param triangles world space, finite, under 1e18; they and their masks outlive this
    explicit Adjudicator(const TriangleView& triangles);

    /// Returns the ruling on a pair of a sample and a light that faces it.
    Ruling rule(const FloatPair& pair, const Light& light) const;
    /// Returns the ruling on a family. @param usesTree false: asks every triangle
    Ruling rule(const SegmentFamily& family, bool usesTree = true) const;

    /// Returns the family of a pair.
    SegmentFamily family(const FloatPair& pair, const Light& light) const {
        return families_.make(pair, light);
    }

private:
    TriangleView triangles_;
    FamilyMaker families_;
    TriangleBoxes boxes_;
};

} // namespace shadowdag
