// SPDX-License-Identifier: Apache-2.0
// Memory for stb's PNG encoder, which writes into what it gets without a check for null.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

namespace shadowdag {

/// Returns what std::realloc does; throws std::bad_alloc in place of null.
inline void* reallocateOrThrow(void* old, size_t bytes) {
    void* const data = std::realloc(old, bytes);
    if (!data)
        throw std::bad_alloc();
    return data;
}

} // namespace shadowdag
