// SPDX-License-Identifier: Apache-2.0
// The passes of this folder.
#include "cuda/pass_launch.h"
#include "shadowmap/cull.h"
#include "shadowmap/drawn_cells.h"
#include "shadowmap/kept_pages.h"
#include "shadowmap/page_mask.h"
#include "shadowmap/rasterize.h"

// page_mask.h, cell_depth.h; cull_cuda.cu has the kernels of those that are registered for the CPU
// alone
SDAG_PASS(MarkReceiver)
SDAG_PASS(MarkBoxPages)
SDAG_PASS(CountPages)
SDAG_CPU_PASS(CountPagesOfMaps)
SDAG_PASS(GatherBlock)

// cull.h
SDAG_CPU_PASS(CountReached)
SDAG_CPU_PASS(ListReached)
SDAG_CPU_PASS(CountDraws)
SDAG_PASS(ListDraws)
SDAG_PASS(NoteCullLengths)

// kept_pages.h
SDAG_PASS(CarryPages)
SDAG_PASS(MarkUnder)
SDAG_CPU_PASS(SortOutPages)
SDAG_PASS(NumberPages)
SDAG_PASS(MarkFreePages)
SDAG_PASS(ListFreePages)
SDAG_CPU_PASS(AssignPages)
SDAG_CPU_PASS(ClearPages)

// drawn_cells.h
SDAG_PASS(EmptySlots)
SDAG_CPU_PASS(ResetCells)
SDAG_PASS(PrepareBlock)
SDAG_PASS(LowerCells)
SDAG_CPU_PASS(ListOpenCells)
SDAG_PASS(ListOpenPages)
SDAG_CPU_PASS(RaiseDrawn)

// rasterize.h; rasterize_cuda.cu has a kernel
SDAG_CPU_PASS(RasterizeTriangle)
SDAG_PASS(RasterizeLargeTriangle)
