// SPDX-License-Identifier: Apache-2.0
// The options of a frame that are refused on every backend.
#include "cuda/process_memory.h"
#include "hybrid/frame/frame_state.h"
#include "hybrid/rays/beams.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// What a frame with one light holds for each pixel at its most, measured at 2048 x 2048 (maps and
/// rays alike); more lights need more.
constexpr uint64_t kLeastBytesPerPixel = 140;

/// Lists of beams are found by 32 bits, in units of 4 bytes.
constexpr uint64_t kMostBeamBytes = uint64_t(16) << 30;

/// Throws Error kResource for a picture that cannot fit, before the system ends the process.
void checkMemory(const FrameOptions& options) {
    const uint64_t beams = options.rays.keepsBeams() ? options.rays.beamBytes : 0;
    const uint64_t needed = kLeastBytesPerPixel * options.width * options.height + beams;
    const uint64_t available = processMemoryBytes();
    if (needed > available)
        throw Error(ErrorKind::kResource,
                    "a picture of " + std::to_string(options.width) + " x " +
                        std::to_string(options.height) + " pixels" +
                        (beams > 0 ? " with its beams" : "") + " takes at least " +
                        std::to_string(needed >> 20) + " MiB of memory, this process may take " +
                        std::to_string(available >> 20) + " MiB; use a smaller size" +
                        (beams > 0 ? " or less with --beams" : ""));
}

void check(bool ok, const std::string& what) {
    if (!ok)
        throw Error(ErrorKind::kUsage, what);
}

} // namespace

void checkOptions(const FrameOptions& options) {
    checkMemory(options);
    check(std::isfinite(options.undersample) && options.undersample > 0.0f,
          "undersampling divisor " + std::to_string(options.undersample) +
              "; use a number above 0, 1 for none");
    check(options.maxFaceTexels >= 1 && options.maxFaceTexels <= kMaxFaceTexels,
          "largest face resolution " + std::to_string(options.maxFaceTexels) + "; use 1 to " +
              std::to_string(kMaxFaceTexels) + " texels");
    check(options.minFaceTexels >= 1 && options.minFaceTexels <= options.maxFaceTexels,
          "least face resolution " + std::to_string(options.minFaceTexels) +
              "; use 1 to the largest, " + std::to_string(options.maxFaceTexels) + " texels");
    check(options.mapsPerLight >= 1 && options.mapsPerLight <= kMaxMapsPerLight,
          std::to_string(options.mapsPerLight) + " shadow maps a light; use 1 to " +
              std::to_string(kMaxMapsPerLight));
    check(options.normalClusters <= kMaxNormalCellsPerEdge,
          "normal clustering by " + std::to_string(options.normalClusters) +
              " cells an edge; use 0 for none to " + std::to_string(kMaxNormalCellsPerEdge));
    check(options.pruning != PairPruning::kLit || !options.rays.usesLevels(),
          "proofs of light are valid for voxel rays of level 0 only; use them without a level of "
          "detail");
    check(options.bias.taps <= options.maps.taps,
          "lookups with " + std::to_string(options.bias.taps) + " taps in maps marked for " +
              std::to_string(options.maps.taps) +
              " would read pages without memory; give the maps as many taps");
    check(std::isfinite(options.routeMargin) && options.routeMargin >= 0.0f,
          "margin of routing " + std::to_string(options.routeMargin) +
              "; use a number >= 0, 0 to route every frame anew");
    check(std::isfinite(options.rays.offset) && options.rays.offset >= 0.0f,
          "ray offset " + std::to_string(options.rays.offset) + "; use a number >= 0");
    check(options.rays.triangleRays == TriangleRays::kExact || options.rays.believesNone(),
          "Embree traces triangles, so rays by it believe no voxel; use --believe none");
    check(!options.rays.usesLevels() || options.rays.believesAll() || options.rays.believesNone(),
          "a bound on the displacement of shadows holds for voxels, not for the larger cells of a "
          "level of detail; believe all with levels, or use level 0");
    check(options.rays.beamBytes == 0 || (options.rays.beamBytes >= BeamCache::kLeastBytes &&
                                          options.rays.beamBytes <= kMostBeamBytes),
          "memory for beams of " + std::to_string(options.rays.beamBytes) +
              " bytes; use 0 for none, or 1 MiB to 16 GiB");
    check(options.rays.lod == LodRule::kFixed || options.rays.level == 0,
          "level of detail " + std::to_string(options.rays.level) +
              " contradicts levels by footprint; use level 0 with footprints");
    check(std::isfinite(options.rays.footprintScale) && options.rays.footprintScale > 0.0f,
          "footprint scale " + std::to_string(options.rays.footprintScale) +
              "; use a number above 0, 1 for the pixel's");
    check(options.rays.coverage > 0.0f && options.rays.coverage <= 1.0f,
          "coverage " + std::to_string(options.rays.coverage) +
              "; use a share above 0, at most 1 (rule footprint counts every voxel)");
}

} // namespace shadowdag
