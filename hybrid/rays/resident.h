// SPDX-License-Identifier: Apache-2.0
// A host array as passes read it: itself on the CPU, a copy on CUDA.
#pragma once

#include "cuda/buffer.h"

namespace shadowdag {

/// Move-only. On the CPU it refers to the host array, which must outlive it unchanged in place.
template <class T> class Resident {
public:
    Resident(Backend backend, std::string name) : copy_(backend, std::move(name)) {}

    /// Makes the array available; call again when its contents or place changed.
    void set(View<const T> host) {
        view_ = host;
        detail::countUpload(host.count * sizeof(T));
        if (copy_.backend() == Backend::kCpu)
            return;
        copy_.resize(host.count);
        detail::copyBytes(copy_.backend(), copy_.view().data, Backend::kCpu, host.data,
                          host.count * sizeof(T));
        view_ = copy_.view();
    }
    void set(const std::vector<T>& host) { set(viewOf(host)); }
    View<const T> view() const { return view_; }

private:
    Buffer<T> copy_;
    View<const T> view_;
};

} // namespace shadowdag
