// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/routing/resolution_pass.h"

SDAG_PASS(DemandResolution)
SDAG_PASS(DemandMaps)
SDAG_PASS(MarkOccupiedSlots)
SDAG_PASS(NumberPairs)
SDAG_PASS(NoteLengths)
