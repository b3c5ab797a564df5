// SPDX-License-Identifier: Apache-2.0
// cub::DeviceReduce over std::accumulate, for the device that the host plays.
#pragma once

#include <cuda_runtime.h>

#include <numeric>

namespace cub {

struct DeviceReduce {
    /// Adds in the type of the output.
    template <class In, class Out>
    static cudaError_t Sum(void* scratch, size_t& bytes, const In* in, Out* out, size_t count,
                           SDAG_FROM) {
        if (!scratch) {
            bytes = 512;
            return cudaSuccess;
        }
        return shadowdag::cuda_host::queueLibraryCall(
            "DeviceReduce::Sum", from, scratch, bytes,
            [=] { *out = std::accumulate(in, in + count, Out(0)); });
    }
};

} // namespace cub
