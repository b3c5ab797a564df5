// SPDX-License-Identifier: Apache-2.0
// A fuzz target reads bytes as the program reads them from its user. The same targets are run by
// libFuzzer (libfuzzer_main.cpp, ./do fuzz) and by the ordinary tests (replay_main.cpp), which read
// the committed corpus and seeded mutations of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag::fuzz {

/// The most memory that reading `size` bytes may hold at once.
struct MemoryBound {
    uint64_t fixedBytes = uint64_t(64) << 20;
    uint64_t perByte = 32;

    uint64_t of(size_t size) const { return fixedBytes + perByte * size; }
};

struct FuzzTarget {
    /// Names its folder in tests/fuzz/corpus.
    std::string name;
    /// No input is longer.
    size_t maxBytes;
    /// Reads the bytes. Throws Error kInput or kUsage for what the program refuses. A promise that
    /// is not kept ends the process (fuzzCheck).
    void (*fuzzOne)(const uint8_t* data, size_t size);
    /// Returns inputs beside the committed corpus, from the program's own writers; null for none.
    std::vector<std::string> (*seeds)() = nullptr;
    /// Returns what mutations change of an input: its content without packing; null: all of it.
    std::string (*unpack)(const std::string& input) = nullptr;
    /// Returns the input of a content, with lengths and checksums that fit, so that mutations reach
    /// what is behind their checks; null: the content itself.
    std::string (*pack)(const std::string& content) = nullptr;
    /// Texts that mutations insert.
    std::vector<std::string> words = {};
    MemoryBound memory = {};
    /// Mutations that an ordinary test run reads.
    int replayCount = 2000;
};

/// Returns the targets of this binary.
std::vector<FuzzTarget>& fuzzTargets();

/// Adds a target; returns true.
bool addFuzzTarget(FuzzTarget target);

/// Runs a target on an input: refusals are right answers. Ends the process, naming the reason, for
/// any other exception and for more memory than its bound.
void runTarget(const FuzzTarget& target, const uint8_t* data, size_t size);

/// Ends the process with a message unless the condition holds.
void fuzzCheck(bool holds, const char* promise);

/// Returns all seeds of a target: the committed corpus and FuzzTarget::seeds.
std::vector<std::string> seedsOf(const FuzzTarget& target);

} // namespace shadowdag::fuzz
