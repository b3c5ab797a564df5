// SPDX-License-Identifier: Apache-2.0
// The smallest complete pass: one functor, two backends, one
// registration. It shows how a pass is written, and its
// test shows that both backends give the same floats, bit for bit.
// Beside it passes over what only warps do: parts of a list, and sorting.
#pragma once

#include "cuda/pass.h"
#include "cuda/split_work_view.h"
#include "cuda/view.h"

#include <cmath>

namespace shadowdag {

/// out[i] from a[i] and b[i] by every operation that a pass may feed into an integer: products that
/// invite a fused multiply-add, division, square root.
struct Probe {
    View<const float> a;
    View<const float> b;
    View<float> out;

    size_t itemCount() const { return out.count; }
    SDAG_HD void operator()(size_t i) const {
        const float product = a[i] * b[i] + a[i];
        out[i] = sqrtf(product * product + b[i] * b[i]) / (1.0f + b[i] * product);
    }
};

/// Runs Probe over all elements; the three views have one count and live on `backend`.
inline void probe(Backend backend, View<const float> a, View<const float> b, View<float> out) {
    runPass(backend, Probe{a, b, out});
}

/// Adds item i with i % 7 + 1 parts to a list.
struct AddParts {
    SplitWorkView list;
    uint32_t count;

    SDAG_HD static uint32_t partsOf(uint32_t item) { return item % 7 + 1; }
    size_t itemCount() const { return count; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t index;
        list.add(uint32_t(i), uint32_t(i) + 5, partsOf(uint32_t(i)), index);
    }
};

/// Counts the lanes of the parts that it wants: about every `period`th.
struct VisitParts {
    SplitWorkView parts;
    View<uint32_t> visits; ///< 7 * kGroupLanes an item
    uint32_t period;

    SDAG_HD bool isWanted(uint32_t item, uint32_t part) const {
        return (item + part) % period == 0;
    }
    SDAG_HD bool wants(const SplitItem& item, uint32_t part) const {
        return isWanted(item.a, part);
    }
    SDAG_HD void operator()(const SplitItem& item, uint32_t part, uint32_t lane) const {
        if (item.b == item.a + 5 && part < AddParts::partsOf(item.a) && lane < kGroupLanes)
            atomicAddRelaxed(&visits[(item.a * 7 + part) * kGroupLanes + lane], 1);
    }
};

/// Sorts list i: numbers [start[i], start[i + 1]).
struct SortLists {
    View<const uint32_t> start;
    View<uint32_t> numbers;

    size_t itemCount() const { return start.count - 1; }
    SDAG_HD void operator()(size_t i) const {
        for (uint32_t k = start[i]; k < start[i + 1]; ++k)
            for (uint32_t at = k; at > start[i] && numbers[at] < numbers[at - 1]; --at) {
                const uint32_t less = numbers[at];
                numbers[at] = numbers[at - 1];
                numbers[at - 1] = less;
            }
    }
};
void launchPass(CudaTag, const SortLists& work); ///< by warps

} // namespace shadowdag
