// SPDX-License-Identifier: Apache-2.0
// Ray streams in plain C++, for processors that have neither AVX2 nor AVX-512.
#include "voxel/dag_stream_kernel.h"
#include "voxel/lanes_portable.h"

#include <cmath>

namespace shadowdag::stream {
namespace {

struct Portable : PortableLanes {
    class Grid {
    public:
        Grid(const Slabs& slabs, uint32_t octant) : slabs_(slabs), octant_(octant) {}

        /// Returns the mask at `words` in the order of visits.
        uint64_t ordered(const uint32_t* words) const {
            uint64_t m = words[0] | uint64_t(words[1]) << 32;
            const uint32_t o = endOctant(octant_);
            const auto turn = [&m](uint64_t low, int shift) {
                m = (m & low) << shift | (m >> shift & low);
            };
            if (o & 1) {
                turn(0x5555555555555555u, 1);
                turn(0x00ff00ff00ff00ffu, 8);
            }
            if (o & 2) {
                turn(0x3333333333333333u, 2);
                turn(0x0000ffff0000ffffu, 16);
            }
            if (o & 4) {
                turn(0x0f0f0f0f0f0f0f0fu, 4);
                turn(0x00000000ffffffffu, 32);
            }
            return m;
        }

        /// Returns which of the 64 cells at the corner are met, in the order of visits.
        uint64_t hits(const float* corner, float side) const {
            float near[3][4], far[3][4];
            for (int a = 0; a < 3; ++a) {
                const float* numbers = planeNumbers(octant_, a);
                for (int k = 0; k < 4; ++k) {
                    const float n = __builtin_fmaf(corner[a] + side * numbers[k], slabs_.invNear[a],
                                                   slabs_.cNear[a]);
                    const float f = __builtin_fmaf(corner[a] + side * numbers[4 + k],
                                                   slabs_.invFar[a], slabs_.cFar[a]);
                    near[a][k] = n > 0.0f ? n : 0.0f;
                    far[a][k] = f < 1.0f ? f : 1.0f;
                }
            }
            uint64_t met = 0;
            for (uint32_t z = 0; z < 4; ++z)
                for (uint32_t y = 0; y < 4; ++y) {
                    const float n = near[1][y] > near[2][z] ? near[1][y] : near[2][z];
                    const float f = far[1][y] < far[2][z] ? far[1][y] : far[2][z];
                    if (!(n <= f))
                        continue;
                    for (uint32_t x = 0; x < 4; ++x) {
                        const uint32_t i = (x & 1) | (y & 1) << 1 | (z & 1) << 2 | (x >> 1) << 3 |
                                           (y >> 1) << 4 | (z >> 1) << 5;
                        met |= uint64_t(near[0][x] <= f && n <= far[0][x]) << i;
                    }
                }
            return met;
        }

        /// Sets out[8 * a + k] to the planes of axis a, numbered as planeNumbers does.
        void planes(const float* corner, float side, float* out) const {
            for (int a = 0; a < 3; ++a)
                for (int k = 0; k < 8; ++k)
                    out[8 * a + k] = corner[a] + side * planeNumbers(octant_, a)[k];
        }

    private:
        Slabs slabs_;
        uint32_t octant_;
    };
};

} // namespace

void tracePortable(const Work& work) {
    traceAll<Portable>(work);
}

} // namespace shadowdag::stream
