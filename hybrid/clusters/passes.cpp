// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/clusters/cluster_pass.h"
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/clusters/pairs_pass.h"
#include "hybrid/clusters/prune_pass.h"

// cluster_pass.h; cluster_cuda.cu has the kernels of what is registered for the CPU alone
SDAG_PASS(CountCellSamples)
SDAG_PASS(MarkOccupiedCells)
SDAG_PASS(CompactCells)
SDAG_CPU_PASS(FillTile)
SDAG_PASS(CountNormalCells)
SDAG_PASS(SplitByNormals)
SDAG_PASS(BoundByCell)
SDAG_CPU_PASS(BoundBySamples)
SDAG_PASS(JoinTenths)
SDAG_PASS(ShrinkBounds)

// light_assign_pass.h
SDAG_CPU_PASS(CountClusterLights)
SDAG_CPU_PASS(FillClusterLights)
SDAG_PASS(ClampStarts)
SDAG_PASS(RankLights)
SDAG_PASS(OrderClusterLights)

// pairs_pass.h, prune_pass.h
SDAG_PASS(ListPairs)
SDAG_CPU_PASS(EstimatePairs)
SDAG_CPU_PASS(PruneFacing)
