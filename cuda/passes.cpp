// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/fill_pass.h"
#include "cuda/pass_launch.h"
#include "cuda/runs.h"

SDAG_PASS(FillArrays)
SDAG_PASS(MarkRunStarts)
SDAG_PASS(ListRunStarts)
