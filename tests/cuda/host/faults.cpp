// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/host/faults.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace shadowdag::cuda_host {

namespace {

struct MutantText {
    const char *name, *what, *function, *caller;
    Fault fault;
};

constexpr MutantText kMutants[] = {{"none", "nothing is wrong", "", "", Fault::kNone},
#define SDAG_TEXT(enumerator, name, what, function, caller, fault)                                 \
    {name, what, function, caller, Fault::fault},
                                   SDAG_CUDA_HOST_MUTANTS(SDAG_TEXT)
#undef SDAG_TEXT
};

Mutant mutantOfEnvironment() {
    const char* const wanted = std::getenv("SDAG_CUDA_HOST_MUTANT");
    if (!wanted || *wanted == 0)
        return Mutant::kNone;
    const bool isList = std::strcmp(wanted, "list") == 0;
    for (const MutantText& text : kMutants) {
        if (isList)
            std::printf("%s\t%s\n", text.name, text.what);
        else if (std::strcmp(wanted, text.name) == 0)
            return Mutant(&text - kMutants);
    }
    if (!isList)
        std::fprintf(stderr, "cuda host: SDAG_CUDA_HOST_MUTANT '%s' names no mutant\n", wanted);
    std::fflush(stdout);
    std::_Exit(isList ? 0 : 1);
}

struct Plan {
    std::string function;
    std::atomic<uint64_t> left{0}; ///< calls until the one that fails; 0: none does
    std::atomic<const char*> reached{nullptr}; ///< the function, when it failed
    int error = 0;
} plan;

} // namespace

const Mutant chosenMutant = mutantOfEnvironment();

void noteMutant() {
    static std::atomic<bool> isNoted{false};
    if (!isNoted.exchange(true))
        std::fprintf(stderr, "cuda host: commits %s\n", kMutants[size_t(chosenMutant)].name);
}

Fault faultOf(const char* function, const std::string& caller) {
    const MutantText& text = kMutants[size_t(chosenMutant)];
    if (text.fault == Fault::kNone || std::strcmp(text.function, function) != 0 ||
        caller.find(text.caller) == std::string::npos)
        return Fault::kNone;
    noteMutant();
    return text.fault;
}

FailCall::FailCall(std::string function, uint64_t n, int error) {
    plan.function = std::move(function);
    plan.error = error;
    plan.reached = nullptr;
    plan.left = n;
}

FailCall::~FailCall() {
    plan.left = 0;
}

bool FailCall::wasReached() const {
    return plan.reached != nullptr;
}

std::string FailCall::reached() const {
    return wasReached() ? plan.reached.load() : "";
}

int plannedError(const char* function) {
    if (plan.left == 0 || (!plan.function.empty() && plan.function != function) || --plan.left != 0)
        return 0;
    plan.reached = function;
    return plan.error;
}

} // namespace shadowdag::cuda_host
