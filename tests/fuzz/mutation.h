// SPDX-License-Identifier: Apache-2.0
// Seeded mutations of inputs, of binary formats and texts alike.
#pragma once

#include "tests/fuzz/fuzz_target.h"
#include "tests/hybrid/random.h"

#include <string>
#include <vector>

namespace shadowdag::fuzz {

/// Returns the texts of an input between quotes and its numbers, which mutations of others insert.
std::vector<std::string> wordsOf(const std::string& input);

/// Returns a content with one to four changes: bits, bytes, words of two to eight bytes and numbers
/// replaced, ranges deleted, repeated, moved and cut off, words inserted.
std::string mutated(std::string content, size_t maxBytes, const std::vector<std::string>& words,
                    test::Random& random);

/// Returns a mutation of an input of a target, unpacked before and packed again after.
std::string mutatedInput(const FuzzTarget& target, const std::string& input,
                         const std::vector<std::string>& words, test::Random& random);

} // namespace shadowdag::fuzz
