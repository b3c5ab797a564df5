// SPDX-License-Identifier: Apache-2.0
// Lists whose length a pass computes. Reading the length makes the host wait for the device, and
// the device then for the host. On CUDA the length is therefore estimated from the last frame, plus
// a margin; passes run over the longer list, whose end is empty, and the host reads all lengths at
// once where it has to wait anyway. Nothing is written past the end of a list that is too short;
// the work is then repeated with lengths that are read.
#pragma once

#include <cstddef>
#include <cstdint>

namespace shadowdag {

/// The length to allocate, estimated from earlier lengths.
class LengthGuess {
public:
    /// Returns the estimate; 0 if there is none: then the length must be read.
    size_t get() const { return guess_; }
    /// Records a length. The estimate adds an eighth, for moving cameras, and a little more, for
    /// short lists. When lists shrink, it follows by a sixteenth at a time, so that one short list,
    /// as of a frame that redraws nothing, does not make the next too short.
    void note(size_t length) {
        const size_t wanted = length + length / 8 + spare_, kept = guess_ - guess_ / 16;
        guess_ = wanted > kept ? wanted : kept;
    }
    /// Forgets all lengths. @param spare elements that estimates add besides the eighth
    void forget(size_t spare) {
        guess_ = 0;
        spare_ = spare;
    }

    /// The same with the spare elements as they are.
    void forget() { guess_ = 0; }

    static constexpr size_t kSpare = 1024;

private:
    size_t guess_ = 0, spare_ = kSpare;
};

} // namespace shadowdag
