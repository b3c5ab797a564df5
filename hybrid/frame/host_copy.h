// SPDX-License-Identifier: Apache-2.0
// Copies results of a frame from its backend to the host, for reports.
#pragma once

#include "cuda/buffer.h"

#include <vector>

namespace shadowdag {

/// Returns `array` itself if it is on the host, else a copy of it.
/// @param copy memory for that; valid until it is used again
template <class T>
View<const T> copyToHost(Backend backend, View<const T> array, std::vector<T>& copy) {
    if (backend == Backend::kCpu)
        return array;
    copy.resize(array.count);
    detail::copyBytes(Backend::kCpu, copy.data(), backend, array.data, array.count * sizeof(T));
    return viewOf(copy);
}

} // namespace shadowdag
