// SPDX-License-Identifier: Apache-2.0
// The smallest complete pass: one functor, two backends, one
// registration. It shows how a pass is written, and its
// test shows that both backends give the same floats, bit for bit.
#pragma once

#include "cuda/pass.h"
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

} // namespace shadowdag
