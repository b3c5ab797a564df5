// SPDX-License-Identifier: Apache-2.0
// Vectors whose new elements have no value yet, for memory that threads fill at once.
#pragma once

#include "cuda/large_pages.h"

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace shadowdag {

/// Allocates as std::allocator, in large pages where there are several, but elements that resize()
/// or a size adds are not written: no memory is cleared only to be overwritten.
template <class T> struct UninitializedAllocator : std::allocator<T> {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

    UninitializedAllocator() = default;
    template <class U> UninitializedAllocator(const UninitializedAllocator<U>&) noexcept {}
    template <class U> struct rebind { using other = UninitializedAllocator<U>; };
    T* allocate(size_t count) {
        T* const data = std::allocator<T>::allocate(count);
        if (count * sizeof(T) >= kLeastLargeBytes)
            useLargePages(data, count * sizeof(T));
        return data;
    }
    template <class U> void construct(U* at) { ::new (static_cast<void*>(at)) U; }
    template <class U, class... Arguments> void construct(U* at, Arguments&&... arguments) {
        ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
};

/// A vector whose elements must be written before they are read.
template <class T> using UninitializedVector = std::vector<T, UninitializedAllocator<T>>;

} // namespace shadowdag
