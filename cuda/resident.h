// SPDX-License-Identifier: Apache-2.0
// A host array made available to passes: in place on the CPU, a copy elsewhere.
#pragma once

#include "cuda/buffer.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace shadowdag {

/// Returns ascending ranges with those joined that overlap or lie at most `gap` elements apart: one
/// copy of a little more costs less than two copies.
inline std::vector<ArrayRange> joinRanges(const std::vector<ArrayRange>& ranges, size_t gap) {
    std::vector<ArrayRange> joined;
    for (const ArrayRange& range : ranges) {
        if (range.count == 0)
            continue;
        SDAG_ASSERT(joined.empty() || joined.back().first <= range.first);
        if (joined.empty() || range.first > joined.back().first + joined.back().count + gap)
            joined.push_back(range);
        else
            joined.back().count =
                std::max(joined.back().count, range.first + range.count - joined.back().first);
    }
    return joined;
}

/// Keeps one host array available on a backend, under a name in the ledger. Copies are counted as
/// uploads (HostCopyCounts), on the CPU as well, although none is made there. Move-only.
template <class T> class Resident {
public:
    Resident(Backend backend, std::string name) : copy_(backend, std::move(name)) {}

    /// Makes an array of the caller's available. It must outlive this object or the next set; on
    /// the CPU it must also stay in place. Copies it every time: call again when its contents or
    /// place changed.
    void set(View<const T> host) {
        isTaken_ = false;
        refer(host);
    }
    void set(const std::vector<T>& host) { set(viewOf(host)); }

    /// The same for an array that differs from the one before in these ranges alone, ascending:
    /// copies them, or everything if the length is another.
    void setChanged(View<const T> host, const std::vector<ArrayRange>& ranges) {
        const bool isCpu = copy_.backend() == Backend::kCpu;
        if (view_.count != host.count || isTaken_) {
            set(host);
            return;
        }
        if (isCpu)
            view_ = host;
        constexpr size_t kGapBytes = 64 << 10; // about what is copied while a copy is started
        for (const ArrayRange& range : joinRanges(ranges, kGapBytes / sizeof(T))) {
            SDAG_ASSERT(range.first + range.count <= host.count);
            detail::countUpload(range.count * sizeof(T));
            if (isCpu)
                continue;
            detail::copyBytes(copy_.backend(), copy_.view().data + range.first, Backend::kCpu,
                              host.data + range.first, range.count * sizeof(T));
        }
    }

    /// Takes ownership of an array and makes it available. Copies it only if it differs from the
    /// one taken before. Cost: a comparison of all elements.
    void take(std::vector<T> host) {
        if (isTaken_ && host == host_)
            return;
        isTaken_ = false; // until it is available
        host_ = std::move(host);
        refer(viewOf(std::as_const(host_)));
        isTaken_ = true;
    }
    /// Makes the next take copy its array even if it is the same.
    void forget() { isTaken_ = false; }

    View<const T> view() const { return view_; }
    size_t size() const { return view_.count; }

private:
    void refer(View<const T> host) {
        view_ = {}; // should there be no memory
        detail::countUpload(host.count * sizeof(T));
        if (copy_.backend() == Backend::kCpu) {
            view_ = host;
            return;
        }
        copy_.resize(host.count);
        detail::copyBytes(copy_.backend(), copy_.view().data, Backend::kCpu, host.data,
                          host.count * sizeof(T));
        view_ = std::as_const(copy_).view();
    }

    Buffer<T> copy_;       // elsewhere than on the CPU
    std::vector<T> host_;  // that take() was given last
    bool isTaken_ = false; // host_ is the available array
    View<const T> view_;
};

} // namespace shadowdag
