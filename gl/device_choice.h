// SPDX-License-Identifier: Apache-2.0
// Which of several devices a process uses: the first one that works, for its whole lifetime.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

/// Remembers the choice. One thread at a time.
class GlDeviceChoice {
public:
    struct Candidate {
        std::string name; ///< tells it from the others, the same every time
        /// Returns whether it answers, appending what went wrong to `why`.
        std::function<bool(std::string& why)> open;
    };

    /// Opens the first candidate that answers, in order, or, where one answered before, that one
    /// alone: another device would give other results without a word. Returns false where none has
    /// ever answered, `why` then has what each said. Throws Error kDevice, naming it, where the
    /// chosen one is not among the candidates any more or does not answer.
    bool open(const std::vector<Candidate>& candidates, std::string& why);

    const std::string& chosen() const { return chosen_; } ///< its name, or empty

private:
    std::string chosen_;
};

} // namespace shadowdag
