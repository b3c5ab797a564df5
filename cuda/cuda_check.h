// SPDX-License-Identifier: Apache-2.0
// Turns CUDA status codes into Error; included by .cu files only.
#pragma once

#include "cuda/error.h"

#include <cuda_runtime.h>

#include <string>

/// Evaluates a CUDA runtime call once and throws Error kDevice with that call's own code if it
/// failed. The runtime forgets the error: CUB's next call would report it again. Never compiled
/// out.
#define CUDA_CHECK(call)                                                                           \
    do {                                                                                           \
        const cudaError_t sdagStatus_ = (call);                                                    \
        if (sdagStatus_ != cudaSuccess) {                                                          \
            (void)cudaGetLastError();                                                              \
            throw ::shadowdag::Error(::shadowdag::ErrorKind::kDevice,                              \
                                     std::string(#call) + ": " + cudaGetErrorString(sdagStatus_)); \
        }                                                                                          \
    } while (false)
