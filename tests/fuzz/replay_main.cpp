// SPDX-License-Identifier: Apache-2.0
// Runs targets without libFuzzer: the corpus, then seeded mutations of it.
//
//     fuzz_replay TARGET [FILE...]     the corpus and mutations; or these files alone
//
// SDAG_FUZZ_SEED in the environment is the seed of the mutations, SDAG_FUZZ_SECONDS goes on for
// that long. The input that ends the process is kept as crash-TARGET in the working folder.
#include "cuda/backend.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/mutation.h"

#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace shadowdag::fuzz {

namespace {

constexpr unsigned kMaxSeconds = 10; ///< an input that takes longer hangs

/// For the handler of signals.
const std::string* theInput = nullptr;
std::string crashPath;

void keepInput(int signal) {
    const int file = open(crashPath.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    const bool isKept =
        file >= 0 && theInput &&
        write(file, theInput->data(), theInput->size()) == ssize_t(theInput->size());
    const char* const text = signal == SIGALRM ? "this input takes more than 10 s" : "it crashed";
    if (write(STDERR_FILENO, text, std::char_traits<char>::length(text)) < 0 || !isKept)
        _exit(125);
    _exit(signal == SIGALRM ? 124 : 128 + signal);
}

void run(const FuzzTarget& target, const std::string& input) {
    theInput = &input;
    alarm(kMaxSeconds);
    runTarget(target, reinterpret_cast<const uint8_t*>(input.data()), input.size());
    alarm(0);
    theInput = nullptr;
}

double environmentNumber(const char* name, double otherwise) {
    const char* const text = std::getenv(name);
    return text ? std::strtod(text, nullptr) : otherwise;
}

void replay(const FuzzTarget& target) {
    const std::vector<std::string> seeds = seedsOf(target);
    fuzzCheck(!seeds.empty(), "a target has a corpus");
    std::vector<std::string> words = target.words;
    for (const std::string& seed : seeds) {
        run(target, seed);
        const std::vector<std::string> own = wordsOf(seed);
        words.insert(words.end(), own.begin(), own.end());
    }
    const auto seed = uint64_t(environmentNumber("SDAG_FUZZ_SEED", 1));
    const std::chrono::duration<double> least(environmentNumber("SDAG_FUZZ_SECONDS", 0));
    const auto begin = std::chrono::steady_clock::now();
    test::Random random(seed);
    long count = 0;
    while (least.count() > 0 ? std::chrono::steady_clock::now() - begin < least
                             : count < target.replayCount) {
        run(target, mutatedInput(target, seeds[random.below(seeds.size())], words, random));
        ++count;
    }
    std::printf("%s: %zu of the corpus and %ld mutations of seed %llu\n", target.name.c_str(),
                seeds.size(), count, (unsigned long long)seed);
}

std::string contentOf(const char* path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        std::fprintf(stderr, "cannot read %s\n", path);
        std::exit(2);
    }
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

} // namespace

} // namespace shadowdag::fuzz

int main(int argumentCount, char** arguments) {
    using namespace shadowdag;
    setThreadCount(1);
    const std::string name = argumentCount > 1 ? arguments[1] : "";
    fuzz::crashPath = "crash-" + name;
    for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGALRM})
        std::signal(signal, fuzz::keepInput);
    std::string names;
    for (const fuzz::FuzzTarget& target : fuzz::fuzzTargets()) {
        names += " " + target.name;
        if (target.name != name)
            continue;
        for (int i = 2; i < argumentCount; ++i)
            fuzz::run(target, fuzz::contentOf(arguments[i]));
        if (argumentCount == 2)
            fuzz::replay(target);
        return 0;
    }
    std::fprintf(stderr, "usage: fuzz_replay TARGET [FILE...]; targets:%s\n", names.c_str());
    return 1;
}
