// SPDX-License-Identifier: Apache-2.0
// The pass of sdag_vdb.
#include "cuda/pass_launch.h"
#include "voxel/nano_trace_pass.h"

SDAG_PASS(TraceNano)
