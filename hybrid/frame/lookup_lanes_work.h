// SPDX-License-Identifier: Apache-2.0
// What lookup_lanes.cpp hands to the files that are compiled for one kind of processor each. Plain
// pointers, for the reason that voxel/dag_stream_work.h gives.
#pragma once

#include <cstdint>

namespace shadowdag::stream {

/// What makeWindowReceiver (shadowmap/filter_leaf.h) reads of a directional light's window, and
/// what it derives for every receiver.
struct WindowLookup {
    double row[3][3], offset[3]; ///< of DirectionalWindow: u, v, w
    uint32_t face;               ///< kDirectionalFace
    double halfSide, perWorld, perWindow;
    double steepest;    ///< -texel * perWorld
    double wayRounding; ///< kWayRounding
    double range;
    float light[3]; ///< magnitudes of its position
    float depthRounding, forgiven, low;
    double leastFacing;
    float lodDepth, leastFacingOfLevels; ///< lodDepth: lodTexels * texelDepth
};

/// The samples of a cluster, and one map of a light.
struct LookupWork {
    const float *position[3], *normal[3]; ///< world, by sample, padded as SampleWork has them
    uint32_t count;                       ///< of samples
    const uint8_t* isAsked;               ///< by sample
    uint8_t* seen;                        ///< lookUp: receives what is seen of those answered
    uint32_t* left;                       ///< receives the samples that are asked and not answered

    const uint32_t* pageTable; ///< lookUp: from the map's first entry on
    const uint32_t* depths;    ///< lookUp: at least one page
    uint32_t* pages; ///< markPages: a bit an entry of the map's page table; other threads set bits
    uint32_t pageTexelsLog2;
    float light[3];
    uint32_t faceTexels, facePages;

    // Of filterVisibility for every receiver of the map, as filter_leaf.h derives them.
    uint32_t side;                            ///< of the filter
    float rTexels, forgiven, low, twoLod;     ///< twoLod: 2 lodTexels
    float placeRounding, wayRounding;         ///< the constants of filter_leaf.h
    float total, largestOut;                  ///< of the weights: all, and what may be left out
    uint32_t leftCount = 0, missingCount = 0; ///< samples left; taps without memory
    const WindowLookup* window;               ///< null: a cube map
};

/// Mark the pages that lookUp reads for the asked samples; set leftCount.
void markPagesPortable(LookupWork& work);
void markPagesAvx2(LookupWork& work);   ///< where hasStreamIsa(kAvx2)
void markPagesAvx512(LookupWork& work); ///< where hasStreamIsa(kAvx512)

/// Look up the asked samples; set leftCount and missingCount.
void lookUpPortable(LookupWork& work);
void lookUpAvx2(LookupWork& work);   ///< where hasStreamIsa(kAvx2)
void lookUpAvx512(LookupWork& work); ///< where hasStreamIsa(kAvx512)

} // namespace shadowdag::stream
