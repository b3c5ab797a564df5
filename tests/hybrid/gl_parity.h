// SPDX-License-Identifier: Apache-2.0
// Compares a frame of the OpenGL backend with the CPU's, pixel by pixel and pair by pair.
#pragma once

#include "hybrid/frame.h"

#include <cstring>
#include <ostream>

namespace shadowdag::test {

struct GlParity {
    uint64_t pixelCount = 0;          ///< that see geometry on the CPU
    uint64_t sameTriangleCount = 0;   ///< of these, see the same triangle
    uint64_t unlikeSampleCount = 0;   ///< of these, any of whose bits differ
    uint64_t holeCount = 0;           ///< see geometry on the CPU alone
    uint64_t pairCount = 0;           ///< of pixels that see the same triangle
    uint64_t unlikePairListCount = 0; ///< such pixels whose lights differ
    uint64_t unlikeRouteCount = 0;    ///< pairs that another method answered
    uint64_t unlikeVisibilityCount = 0;
    uint64_t unlikeDarkCount = 0; ///< pairs dark on one of the two
    uint64_t unlikeRayCount = 0;  ///< of unlikeDarkCount, by rays on both
    double colorError = 0;        ///< largest, relative to 1 + the CPU's, over equal visibilities

    double sameTrianglePercent() const {
        return 100.0 * double(sameTriangleCount) / double(pixelCount);
    }
    double unlikeDarkPercent() const { return 100.0 * double(unlikeDarkCount) / double(pairCount); }
    double unlikeVisibilityPercent() const {
        return 100.0 * double(unlikeVisibilityCount) / double(pairCount);
    }
};

inline std::ostream& operator<<(std::ostream& out, const GlParity& p) {
    return out << p.pixelCount << " pixels, same triangle " << p.sameTrianglePercent()
               << " %, of these unlike " << p.unlikeSampleCount << ", holes " << p.holeCount << "; "
               << p.pairCount << " pairs, lists unlike " << p.unlikePairListCount
               << ", routes unlike " << p.unlikeRouteCount << ", visibility unlike "
               << p.unlikeVisibilityPercent() << " %, dark unlike " << p.unlikeDarkCount << " = "
               << p.unlikeDarkPercent() << " %, by rays " << p.unlikeRayCount << "; colour off by "
               << p.colorError;
}

/// Compares frames with recorded pairs.
inline GlParity compareFrames(const FrameResult& cpu, const GBufferView& cpuSamples,
                              const FrameResult& gl, const GBufferView& glSamples) {
    GlParity p;
    for (size_t s = 0; s < cpuSamples.count(); ++s) {
        if (cpuSamples.triangle[s] == kBackground)
            continue;
        ++p.pixelCount;
        p.holeCount += glSamples.triangle[s] == kBackground;
        if (cpuSamples.triangle[s] != glSamples.triangle[s])
            continue;
        ++p.sameTriangleCount;
        p.unlikeSampleCount += cpuSamples.positionWorld[s] != glSamples.positionWorld[s] ||
                               cpuSamples.normalWorld[s] != glSamples.normalWorld[s] ||
                               cpuSamples.depthView[s] != glSamples.depthView[s];
        const uint64_t a = cpu.pairs.sampleStart[s], aEnd = cpu.pairs.sampleStart[s + 1];
        const uint64_t b = gl.pairs.sampleStart[s], bEnd = gl.pairs.sampleStart[s + 1];
        if (aEnd - a != bEnd - b ||
            std::memcmp(&cpu.pairs.light[a], &gl.pairs.light[b], (aEnd - a) * sizeof(uint32_t))) {
            ++p.unlikePairListCount;
            continue;
        }
        bool isAlike = true;
        for (uint64_t i = 0; i < aEnd - a; ++i) {
            ++p.pairCount;
            const bool isSameRoute = cpu.pairRoute[a + i] == gl.pairRoute[b + i];
            p.unlikeRouteCount += !isSameRoute;
            const uint8_t x = cpu.visibility[a + i], y = gl.visibility[b + i];
            isAlike &= x == y;
            p.unlikeVisibilityCount += x != y;
            if ((x < kHalfLit) == (y < kHalfLit))
                continue;
            ++p.unlikeDarkCount;
            p.unlikeRayCount += isSameRoute && cpu.pairRoute[a + i] == Route::kRays;
        }
        for (int channel = 0; isAlike && channel < 3; ++channel)
            p.colorError = glm::max(p.colorError,
                                    double(glm::abs(cpu.color[s][channel] - gl.color[s][channel])) /
                                        (1.0 + double(cpu.color[s][channel])));
    }
    return p;
}

} // namespace shadowdag::test
