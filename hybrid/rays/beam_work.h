// SPDX-License-Identifier: Apache-2.0
// What beams.cpp and beam_rays.cpp pass to the files that are compiled for one kind of processor
// each. Plain pointers, for the reason that dag_stream_work.h gives.
#pragma once

#include "hybrid/rays/exact_stream_work.h"

namespace shadowdag::stream {

/// A search for the triangles that may block a ray to a light from a box of starts. Local space
/// (TruthSpace), its unit of length.
struct BeamWork {
    const TriangleBvhNode* nodes;
    const TriangleBvhLeaf* leaves;
    uint32_t root; ///< not kNoTriangleChild

    float origin[3];       ///< of the light
    float low[3], high[3]; ///< of the starts

    uint32_t capacity; ///< of the arrays
    uint32_t* leaf;    ///< receives indices of leaves
    uint8_t* mask;     ///< receives a bit for each triangle of the leaf that may block

    uint32_t count;  ///< becomes the number of leaves
    bool isDark;     ///< becomes whether one triangle blocks every ray
    bool isOverflow; ///< becomes whether there were more leaves than `capacity`
};

/// Samples as the choice of those that a beam answers needs them. Arrays are readable up to a
/// packet beyond the last sample. Bits: sample i is bit i % 64 of word i / 64.
struct ActiveWork {
    float light[3];         ///< local
    float beyond;           ///< what rounding the light adds to the error of a height
    const float* plane[4];  ///< normals and offsets of the receivers' planes, by coordinate
    const float* clear;     ///< heights that a light must exceed to be certainly clear of the plane
    const uint8_t* isAsked; ///< 1 or 0
    size_t count;
    uint64_t* active; ///< receives whether a sample is asked and its light is clear of its plane
    uint64_t* open;   ///< receives whether it is asked and not active
};

/// Rays to the light of `rays`, against triangles of a list of leaves.
struct ListedWork {
    ExactWork rays;         ///< nodes, root, starts and blocked are not read
    const float* start[3];  ///< by axis, of each ray; readable up to a packet beyond the last one
    const uint64_t* active; ///< bits of the rays, from bit `firstBit` on; one more word is readable
    size_t firstBit;
    uint8_t* isDark; ///< receives 1 for active rays that are blocked
    uint32_t listCount;
    const uint32_t* leaf;
    const uint8_t* mask;
};

void findBeamPortable(BeamWork& work);
void findBeamAvx2(BeamWork& work);
void findBeamAvx512(BeamWork& work);

void findActivePortable(const ActiveWork& work);
void findActiveAvx2(const ActiveWork& work);
void findActiveAvx512(const ActiveWork& work);

void traceListedPortable(ListedWork& work);
void traceListedAvx2(ListedWork& work);
void traceListedAvx512(ListedWork& work);

} // namespace shadowdag::stream
