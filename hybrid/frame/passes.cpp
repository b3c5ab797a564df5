// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/frame/lookup_pages_pass.h"
#include "hybrid/frame/map_receivers_pass.h"
#include "hybrid/frame/shade_pass.h"

SDAG_PASS(CountMapReceivers)
SDAG_PASS(ListMapReceivers)

// lookup_pages_pass.h; the CPU's is lookup_pages_cpu.cpp
SDAG_CUDA_PASS(MarkLookupPages)

// shade_pass.h; lights are shaded by shade_cpu.cpp and shade_cuda.cu
SDAG_PASS(ShadeUnlit)
