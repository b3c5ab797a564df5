// SPDX-License-Identifier: Apache-2.0
// Chooses one of the kernels that are compiled once per instruction set. For the files that
// sdag_compile_streams (cmake/ShadowDag.cmake) names.
#pragma once

#include "voxel/dag_stream.h"

/// The kernel of an instruction set: namePortable, nameAvx2 or nameAvx512; on other processors than
/// x86-64 there is the first alone. @param isa StreamIsa
#if defined(SDAG_STREAM_X86)
#define SDAG_KERNEL_OF(isa, name)                                                                  \
    ((isa) == ::shadowdag::StreamIsa::kAvx512 ? name##Avx512                                       \
     : (isa) == ::shadowdag::StreamIsa::kAvx2 ? name##Avx2                                         \
                                              : name##Portable)
#else
#define SDAG_KERNEL_OF(isa, name) ((void)(isa), name##Portable)
#endif
