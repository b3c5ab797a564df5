// SPDX-License-Identifier: Apache-2.0
// Answers to ray sets, as .npz and in our own form, with checksums that fit.
#include "tests/fuzz/array_seeds.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/tools/workspace/ray_set_files.h"

namespace shadowdag::fuzz::answers {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const RayAnswers answers = answersOf(readBytes(kAnswersKind, data, size), "answers");
    for (const float visibility : answers.visibility)
        fuzzCheck(visibility >= 0.0f && visibility <= 1.0f, "an answer is within 0 and 1");
    for (const double time : answers.timeMs)
        fuzzCheck(time > 0.0, "a time is positive");
    fuzzCheck(!answers.tracer.empty(), "a tracer has a name");
}

std::vector<std::string> seeds() {
    const RaySet set = makeSmallRaySet();
    const std::vector<NamedArray> arrays = arraysOf(makeRightAnswers(set));
    return {encodeArrays(kAnswersKind, arrays), encodeNpz(arrays)};
}

[[maybe_unused]] const bool isAdded = addFuzzTarget({.name = "answers",
                                                     .maxBytes = 4096,
                                                     .fuzzOne = fuzzOne,
                                                     .seeds = seeds,
                                                     .pack = withFittingSums,
                                                     .words = {"'<f4'", "'|b1'", "'<U5'", "(4,)"}});

} // namespace

} // namespace shadowdag::fuzz::answers
