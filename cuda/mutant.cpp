// SPDX-License-Identifier: Apache-2.0
// The fault of this process; nothing in builds without assertions.
#include "cuda/mutant.h"

#if SDAG_HAS_MUTANTS

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace shadowdag {

namespace {

std::atomic<uint64_t> useCount{0};

Mutant mutantOfEnvironment() {
    const char* const wanted = std::getenv(kMutantVariable);
    if (wanted == nullptr || *wanted == 0)
        return Mutant::kNone;
    for (const MutantText& text : kMutantTexts)
        if (std::string_view(text.name) == wanted)
            return text.mutant;
    std::fprintf(stderr,
                 "environment: %s '%s': names no fault; docs/mutants.md lists them, and without "
                 "the variable none is committed\n",
                 kMutantVariable, wanted);
    std::_Exit(1);
}

} // namespace

Mutant detail::chosenMutant = mutantOfEnvironment();

void detail::countMutantUse() {
    useCount.fetch_add(1, std::memory_order_relaxed);
}

uint64_t mutantUseCount() {
    return useCount.load(std::memory_order_relaxed);
}

} // namespace shadowdag

#endif
