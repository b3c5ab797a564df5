// SPDX-License-Identifier: Apache-2.0
// Turns CUDA status codes into Error; included by .cu files only.
#pragma once

#include "cuda/error.h"

#include <cuda_runtime.h>

#include <string>

namespace shadowdag::detail {

/// Throws Error of `kind` that says what `call` returned, or `instead`. The runtime forgets the
/// error: CUB's next call would report it again.
[[noreturn]] inline void throwCudaError(cudaError_t status, const std::string& call,
                                        ErrorKind kind = ErrorKind::kDevice,
                                        const std::string& instead = {}) {
    (void)cudaGetLastError();
    throw Error(kind, instead.empty() ? call + ": " + cudaGetErrorString(status) : instead);
}

} // namespace shadowdag::detail

/// Evaluates a CUDA runtime call once and throws Error kDevice with that call's own code if it
/// failed. Never compiled out.
#define CUDA_CHECK(call)                                                                           \
    do {                                                                                           \
        const cudaError_t sdagStatus_ = (call);                                                    \
        if (sdagStatus_ != cudaSuccess)                                                            \
            ::shadowdag::detail::throwCudaError(sdagStatus_, #call);                               \
    } while (false)
