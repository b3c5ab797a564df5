// SPDX-License-Identifier: Apache-2.0
// Lists whose length the backend finds out. Reading it makes the host wait for the device, and the
// device then for the host; so on CUDA the length of the last frame is guessed, with room to spare,
// passes run over the longer list, whose end is empty, and the host reads all lengths at once where
// it has to wait anyway. A list that proves too short is never written beyond its end; all is done
// again with lengths that are read.
#pragma once

#include <cstddef>
#include <cstdint>

namespace shadowdag {

/// The length to make room for, from the lengths before.
class LengthGuess {
public:
    /// Returns the guess; 0 when nothing is known: then the length must be read.
    size_t get() const { return guess_; }
    /// Notes a length. The guess has an eighth to spare, for cameras that move, and a little more,
    /// for short lists; where lists shrink it follows by a sixteenth at a time, so that one short
    /// list, as of a frame that draws nothing anew, does not make the next too short.
    void note(size_t length) {
        const size_t wanted = length + length / 8 + spare_, kept = guess_ - guess_ / 16;
        guess_ = wanted > kept ? wanted : kept;
    }
    /// Knows nothing again. @param spare elements that guesses have to spare besides the eighth
    void forget(size_t spare = kSpare) {
        guess_ = 0;
        spare_ = spare;
    }

    static constexpr size_t kSpare = 1024;

private:
    size_t guess_ = 0, spare_ = kSpare;
};

} // namespace shadowdag
