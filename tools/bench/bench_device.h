// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench voxel --backend cuda`: shadow rays on a device, by our pass and by NanoVDB's
// HDDA on the same rays in the same run.
#pragma once

#include "tools/bench/bench_voxel.h"

namespace shadowdag {

/// Verifies, then measures: rays a second of the whole device, tracers in turn. Our pass must give
/// the bits of the CPU's, NanoVDB's HDDA the CPU's own answers within kNanoVdbTolerance. A time is
/// from the start of a pass, with the queue empty, until the device is done, by the wall clock.
/// Returns JSON as runVoxelBench, without "frame" and "checks" of Embree. Throws Error kInput when
/// the view has no pairs or results are wrong, kDevice.
/// @param backend kCuda; kCpu, on all threads, serves tests
Json runDeviceBench(Backend backend, const World& world, const Camera& camera,
                    const VoxelBenchOptions& options, const Console& console);

/// Prints the result of runDeviceBench as a table.
void printDeviceBench(std::ostream& out, const Json& result);

} // namespace shadowdag
