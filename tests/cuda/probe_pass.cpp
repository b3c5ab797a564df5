// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/probe_pass.h"

#include "cuda/pass_launch.h"

SDAG_PASS(Probe)
SDAG_PASS(AddParts)
SDAG_PASS(VisitParts)
SDAG_CPU_PASS(SortLists)
