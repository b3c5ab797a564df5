// SPDX-License-Identifier: Apache-2.0
// Runs of equal neighbours in a sorted array, from which "unique" and "reduce by key" are built.
// The items of a run are adjacent, so a reduction loops over them in their order, on any processor.
#pragma once

#include "cuda/buffer.h"

namespace shadowdag {

/// The runs of `itemCount` items. next: itemCount + 1, runs that start before each item;
/// start: count() + 1, the first item of each run, itemCount last.
struct Runs {
    Runs(Backend backend, const std::string& name)
        : next(backend, name + " run of item"), start(backend, name + " run starts") {}

    Buffer<uint32_t> next;
    Buffer<uint32_t> start;

    size_t count() const { return start.size() - 1; }
};

/// Returns the run of an item. @param next of Runs
SDAG_HD inline uint32_t runOf(View<const uint32_t> next, size_t item) {
    return next[item + 1] - 1;
}

/// Marks with 1 the first item and the items whose key, without its low `shift` bits, differs from
/// that of the item before. marks: keys.count + 1; the last stays unchanged.
struct MarkRunStarts {
    View<const uint64_t> keys;
    uint32_t shift;
    View<uint32_t> marks;

    size_t itemCount() const { return keys.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        marks[i] = i == 0 || keys[i] >> shift != keys[i - 1] >> shift;
    }
};

/// Writes the starts of runs. @param next the exclusive scan of marks
struct ListRunStarts {
    View<const uint32_t> next;
    View<uint32_t> start;

    size_t itemCount() const { return next.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (i + 1 == next.count || next[i + 1] != next[i])
            start[next[i]] = uint32_t(i);
    }
};

/// Replaces `runs` by those of keys that are equal in all but their low `shift` bits. Equal keys
/// must be adjacent. Throws Error kResource for 2^32 - 1 keys or more. All views are on the
/// backend.
void listRuns(Backend backend, View<const uint64_t> keys, uint32_t shift, Runs& runs);

/// Replaces `runs.start` by the runs that marks in `runs.next` begin (MarkRunStarts; for keys of
/// other kinds callers mark themselves).
/// @param runs next: itemCount + 1 elements; the last is overwritten
void listMarkedRuns(Backend backend, Runs& runs);

} // namespace shadowdag
