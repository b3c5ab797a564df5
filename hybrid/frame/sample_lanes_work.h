// SPDX-License-Identifier: Apache-2.0
// What sample_lanes.cpp hands to the files that are compiled for one kind of processor each. Plain
// pointers, for the reason that voxel/dag_stream_work.h gives.
#pragma once

#include <cstdint>

namespace shadowdag::stream {

/// The arrays of samples are padded to a multiple of this, with whatever is harmless.
constexpr uint32_t kSamplePadding = 16;

/// The samples of a cluster, and one light.
struct SampleWork {
    uint32_t count;                                        ///< of samples
    float *position[3], *normal[3], *albedo[3], *color[3]; ///< color: what lights are added to
    float inversePi;

    bool isDirectional, isSpot;
    float at[3];        ///< the light's position; directional: the vector towards it
    float intensity[3]; ///< as Light
    float rangeSquared;
    float direction[3], cosOuter;
    float coneWidth; ///< of irradianceAt

    uint8_t* isAsked;    ///< mark: receives 1 or 0; add: which samples are meant
    const uint8_t* seen; ///< add: visibility, 255 lit .. 0 dark
};

/// Set isAsked to lightsSample of each sample; return how many are.
uint32_t markSamplesPortable(const SampleWork& work);
uint32_t markSamplesAvx2(const SampleWork& work);   ///< where hasStreamIsa(kAvx2)
uint32_t markSamplesAvx512(const SampleWork& work); ///< where hasStreamIsa(kAvx512)

/// Add reflectedLight to the colours of asked samples that see the light.
void addLightPortable(const SampleWork& work);
void addLightAvx2(const SampleWork& work);
void addLightAvx512(const SampleWork& work);

} // namespace shadowdag::stream
