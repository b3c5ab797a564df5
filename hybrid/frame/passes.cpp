// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/frame/map_receivers_pass.h"
#include "hybrid/frame/shade_pass.h"

SDAG_PASS(CountMapReceivers)
SDAG_PASS(ListMapReceivers)

// shade_pass.h; shade_cpu.cpp shades cluster by cluster
SDAG_PASS(ShadeUnlit)
SDAG_CUDA_PASS(ShadeLights)
