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
        std::string name; ///< identifies it, the same every time
        /// Returns whether it can be opened; appends the reason of a failure to `why`.
        std::function<bool(std::string& why)> open;
    };

    /// Opens the first candidate that works, in order, or, if one worked before, only that one:
    /// another device could give other results silently. Returns false if none has ever worked;
    /// `why` then has the reason of each. Throws Error kDevice, naming it, if the chosen one is no
    /// longer a candidate or cannot be opened.
    bool open(const std::vector<Candidate>& candidates, std::string& why);

    const std::string& chosen() const { return chosen_; } ///< its name, or empty

private:
    std::string chosen_;
};

} // namespace shadowdag
