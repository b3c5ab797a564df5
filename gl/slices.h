// SPDX-License-Identifier: Apache-2.0
// Splits long work so that it can be cancelled: a software driver may take half a minute for one
// call, during which no interrupt is handled.
#pragma once

#include "gl/context.h"

#include <chrono>
#include <cstdint>
#include <functional>

namespace shadowdag {

/// Sets the function that is called between pieces, on the thread that submits them; an exception
/// from it ends the work, whose results are then undefined. For the whole process; empty: work is
/// never cancelled.
void setGlPoll(std::function<void()> poll);

/// Splits [0, count) into pieces of about kSliceMs, estimated from the pieces before: a fast device
/// gets two or three, one after the other. The context is current throughout.
///
///     GlSlices slices(context, count, "shading");
///     while (slices.next())
///         submit(slices.begin(), slices.end());
class GlSlices {
public:
    /// @param what as GlContext::finish has it
    GlSlices(const GlContext& context, uint64_t count, const char* what)
        : context_(context), count_(count), what_(what) {}

    /// Waits for the last piece, calls the poll function and takes the next piece; false when all
    /// is done. Throws the exceptions of finish() and of the poll function.
    bool next();
    uint64_t begin() const { return begin_; }
    uint64_t end() const { return end_; }

    static constexpr double kSliceMs = 200;

private:
    const GlContext& context_;
    const uint64_t count_;
    const char* const what_;
    uint64_t begin_ = 0, end_ = 0, size_ = 0;
    std::chrono::steady_clock::time_point start_;
};

} // namespace shadowdag
