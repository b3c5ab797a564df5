// SPDX-License-Identifier: Apache-2.0
// cub::DeviceRadixSort over std::stable_sort, for the device that the host plays.
#pragma once

#include <cuda_runtime.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace cub {

template <class T> struct DoubleBuffer {
    T* d_buffers[2];
    int selector = 0;

    DoubleBuffer(T* current, T* alternate) : d_buffers{current, alternate} {}
    T* Current() const { return d_buffers[selector]; }
    T* Alternate() const { return d_buffers[selector ^ 1]; }
};

struct DeviceRadixSort {
    template <class Key>
    static cudaError_t SortKeys(void* scratch, size_t& bytes, DoubleBuffer<Key>& keys, size_t count,
                                SDAG_FROM) {
        DoubleBuffer<uint32_t> none(nullptr, nullptr);
        return sort("DeviceRadixSort::SortKeys", scratch, bytes, keys, none, count, from);
    }
    template <class Key>
    static cudaError_t SortPairs(void* scratch, size_t& bytes, DoubleBuffer<Key>& keys,
                                 DoubleBuffer<uint32_t>& values, size_t count, SDAG_FROM) {
        return sort("DeviceRadixSort::SortPairs", scratch, bytes, keys, values, count, from);
    }

private:
    // The sorted arrays are by turns in either buffer, as it may be on a device.
    template <class Key>
    static cudaError_t sort(const char* name, void* scratch, size_t& bytes, DoubleBuffer<Key>& keys,
                            DoubleBuffer<uint32_t>& values, size_t count,
                            const std::source_location& from) {
        if (!scratch) {
            bytes = 256 + count / 8;
            return cudaSuccess;
        }
        static thread_local uint64_t turn = 0;
        const bool isSwapped = turn++ % 2 == 0;
        const DoubleBuffer<Key> k = keys;
        const DoubleBuffer<uint32_t> v = values;
        if (isSwapped) {
            keys.selector ^= 1;
            values.selector ^= 1;
        }
        return shadowdag::cuda_host::queueLibraryCall(name, from, scratch, bytes, [=] {
            std::vector<size_t> order(count);
            std::iota(order.begin(), order.end(), size_t(0));
            const Key* const given = k.Current();
            std::stable_sort(order.begin(), order.end(),
                             [&](size_t a, size_t b) { return given[a] < given[b]; });
            place(order, k, isSwapped);
            if (v.Current())
                place(order, v, isSwapped);
        });
    }
    /// Writes the ordered elements into one buffer, and something else into the other.
    template <class T>
    static void place(const std::vector<size_t>& order, const DoubleBuffer<T>& pair,
                      bool isSwapped) {
        std::vector<T> sorted(order.size());
        for (size_t i = 0; i < order.size(); ++i)
            sorted[i] = pair.Current()[order[i]];
        T* const to = isSwapped ? pair.Alternate() : pair.Current();
        T* const left = isSwapped ? pair.Current() : pair.Alternate();
        std::copy(sorted.begin(), sorted.end(), to);
        std::reverse_copy(sorted.begin(), sorted.end(), left);
    }
};

} // namespace cub
