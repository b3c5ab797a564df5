// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/routing/resolution_pass.h"

// resolution_cuda.cu has the kernels of what is registered for the CPU alone
SDAG_CPU_PASS(DemandResolution)
SDAG_CPU_PASS(DemandMaps)
SDAG_PASS(MarkOccupiedSlots)
SDAG_PASS(NumberPairs)
SDAG_PASS(NoteLengths)
