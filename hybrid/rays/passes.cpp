// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/rays/mover_rays.h"

SDAG_PASS(BoundMoverRuns)
