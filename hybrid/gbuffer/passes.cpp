// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "hybrid/gbuffer/gbuffer_raster.h"
#include "hybrid/gbuffer/resolve_base_color.h"

SDAG_CPU_PASS(RasterizeSlots) // gbuffer_cuda.cu has a kernel
SDAG_PASS(RasterizeLarge)
SDAG_CUDA_PASS(ResolveSamples) // resolve_cpu.cpp has the CPU's
SDAG_PASS(ResolveBaseColor)
