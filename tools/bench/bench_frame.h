// SPDX-License-Identifier: Apache-2.0
// The whole-frame part of `shadowdag bench voxel`: all (sample, light) pairs of a frame on one
// thread, by streams and by Embree's rtcOccluded16.
#pragma once

#include "hybrid/judge/embree_baseline.h"
#include "tools/bench/bench_view.h"
#include "tools/settings/console.h"
#include "tools/settings/json.h"
#include "voxel/dag.h"

#include <ostream>

namespace shadowdag {

/// Verifies the results, then measures the processor time in seconds for the visibility of all
/// pairs of a view, methods interleaved. Ours starts from samples, normals and the lights of each
/// sample; Embree from finished segments in packets of similar rays, whose packing is not timed.
/// Returns the measurements as JSON. Throws Error kInput when a result by streams differs from the
/// same ray's.
/// @param dag in the form that frames trace, with its wide form
/// @param embree over the triangles that the DAG holds
Json runFrameBench(const BenchView& view, const World& world, const DagView& dag,
                   const EmbreeBaseline& embree, int repeats);

/// Prints the result of runFrameBench as a table.
void printFrameBench(std::ostream& out, const Json& result);

} // namespace shadowdag
