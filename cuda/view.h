// SPDX-License-Identifier: Apache-2.0
// A non-owning array for functors: pointer and element count, copied by value into kernels.
#pragma once

#include "cuda/macros.h"

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace shadowdag {

/// A non-owning view of `count` elements at `data` on one backend; empty: null and 0.
template <class T> struct View {
    T* data = nullptr;
    size_t count = 0;

    SDAG_HD T& operator[](size_t i) const {
        SDAG_ASSERT(i < count);
        return data[i];
    }
    SDAG_HD T* begin() const { return data; }
    SDAG_HD T* end() const { return data + count; }
    SDAG_HD bool empty() const { return count == 0; }
    /// Views of the same elements that may not be written; a view of constants converts to nothing.
    template <class U>
    requires(std::is_same_v<U, const T> && !std::is_const_v<T>) SDAG_HD operator View<U>() const {
        return {data, count};
    }
};

/// Elements [first, first + count) of an array.
struct ArrayRange {
    size_t first, count;

    bool operator==(const ArrayRange&) const = default;
};

/// Returns a view of a host vector, valid until the vector reallocates.
template <class T, class Allocator> View<const T> viewOf(const std::vector<T, Allocator>& v) {
    return {v.data(), v.size()};
}
template <class T, class Allocator> View<T> viewOf(std::vector<T, Allocator>& v) {
    return {v.data(), v.size()};
}

} // namespace shadowdag
