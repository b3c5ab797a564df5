// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/fuzz_target.h"

#include "cuda/error.h"
#include "tests/fuzz/memory_meter.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace shadowdag::fuzz {

std::vector<FuzzTarget>& fuzzTargets() {
    static std::vector<FuzzTarget> targets;
    return targets;
}

bool addFuzzTarget(FuzzTarget target) {
    fuzzTargets().push_back(std::move(target));
    return true;
}

void fuzzCheck(bool holds, const char* promise) {
    if (holds)
        return;
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}

void runTarget(const FuzzTarget& target, const uint8_t* data, size_t size) {
    startMemoryMeter();
    try {
        target.fuzzOne(data, size);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput && error.kind() != ErrorKind::kUsage) {
            std::fprintf(stderr, "not a refusal of the input: %s\n", error.what());
            std::abort();
        }
        fuzzCheck(error.what()[0] != '\0', "a refusal has a message");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "an exception that is not an Error: %s\n", error.what());
        std::abort();
    }
    if (const uint64_t peak = meteredPeakBytes(); peak > target.memory.of(size)) {
        std::fprintf(stderr, "%llu bytes of memory for an input of %zu bytes, at most %llu\n",
                     (unsigned long long)peak, size, (unsigned long long)target.memory.of(size));
        std::abort();
    }
}

std::vector<std::string> seedsOf(const FuzzTarget& target) {
    namespace fs = std::filesystem;
    std::vector<fs::path> paths;
    const fs::path folder = fs::path(SDAG_SOURCE_DIR) / "tests/fuzz/corpus" / target.name;
    if (fs::is_directory(folder))
        for (const auto& entry : fs::directory_iterator(folder))
            paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    std::vector<std::string> seeds;
    for (const fs::path& path : paths) {
        std::ifstream in(path, std::ios::binary);
        seeds.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    if (target.seeds)
        for (std::string& seed : target.seeds())
            seeds.push_back(std::move(seed));
    return seeds;
}

} // namespace shadowdag::fuzz
