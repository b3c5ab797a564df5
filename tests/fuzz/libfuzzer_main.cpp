// SPDX-License-Identifier: Apache-2.0
// Runs the one target of a binary under libFuzzer, half of the mutations libFuzzer's and half ours.
// SDAG_FUZZ_SEEDS=FOLDER in the environment writes the seeds there and ends. Source: LLVM,
// libFuzzer, a library for coverage-guided fuzz testing.
#include "cuda/backend.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/mutation.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t maxSize);

namespace shadowdag::fuzz {

namespace {

std::vector<std::string> words;

/// Returns an input changed by libFuzzer, of its content.
std::string mutatedByLibFuzzer(const FuzzTarget& target, const std::string& input) {
    std::string content = target.unpack ? target.unpack(input) : input;
    const size_t size = content.size(), most = std::max(size, target.maxBytes);
    content.resize(most);
    content.resize(LLVMFuzzerMutate(reinterpret_cast<uint8_t*>(content.data()), size, most));
    return target.pack ? target.pack(content) : content;
}

} // namespace

} // namespace shadowdag::fuzz

using namespace shadowdag::fuzz;

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    shadowdag::setThreadCount(1);
    const FuzzTarget& target = fuzzTargets().at(0);
    const std::vector<std::string> seeds = seedsOf(target);
    words = target.words;
    for (const std::string& seed : seeds) {
        const std::vector<std::string> own = wordsOf(seed);
        words.insert(words.end(), own.begin(), own.end());
    }
    if (const char* const folder = std::getenv("SDAG_FUZZ_SEEDS")) {
        for (size_t i = 0; i < seeds.size(); ++i)
            std::ofstream(folder + ("/seed-" + std::to_string(i)), std::ios::binary) << seeds[i];
        std::exit(0);
    }
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const FuzzTarget& target = fuzzTargets().front();
    if (size <= target.maxBytes)
        runTarget(target, data, size);
    return 0;
}

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t maxSize,
                                          unsigned seed) {
    const FuzzTarget& target = fuzzTargets().front();
    const std::string input(data, data + size);
    shadowdag::test::Random random(seed);
    std::string changed = random.below(2) == 0 ? mutatedByLibFuzzer(target, input)
                                               : mutatedInput(target, input, words, random);
    changed.resize(std::min(changed.size(), maxSize));
    std::memcpy(data, changed.data(), changed.size());
    return changed.size();
}
