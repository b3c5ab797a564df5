// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "voxel/unique_nodes_pass.h"
#include "voxel/voxelize_pass.h"

// voxelize_pass.h
SDAG_PASS(MarkInside)
SDAG_PASS(ListMarked)
SDAG_PASS(MarkChild)
SDAG_PASS(CountChildren)
SDAG_PASS(ListChildren)
SDAG_PASS(ListLeaves)
SDAG_PASS(JoinLeaves)

// unique_nodes_pass.h
SDAG_PASS(CountUp)
SDAG_PASS(ListRunValues)
SDAG_PASS(NumberByRun)
SDAG_PASS(GatherChildren)
SDAG_PASS(PackNodeKeys)
SDAG_PASS(MarkDistinctNodes)
SDAG_PASS(ListDistinctNodes)
SDAG_PASS(CountEdges)
SDAG_PASS(VisitEdges)
SDAG_PASS(RankNodes)
SDAG_PASS(WriteInnerNodes)
SDAG_PASS(WriteLeaves)
