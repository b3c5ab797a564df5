// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/ray_answers.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/judge/truth.h"
#include "tools/workspace/timing.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

constexpr size_t kMaxTracerName = 64, kMaxRepeats = 100000;

std::string textOf(const std::vector<NamedArray>& arrays, const std::string& path,
                   const char* name) {
    const NamedArray& array = requireArray(arrays, path, name, ArrayType::kUint8, 1);
    return {array.bytes.begin(), array.bytes.end()};
}

/// Returns an array of numbers, whatever their type.
std::vector<double> numbersOf(const NamedArray& array, const std::string& path) {
    if (array.columns != 1)
        throw arrayError(path, "array \"" + array.name + "\" has " + std::to_string(array.columns) +
                                   " columns; it needs one number a row");
    std::vector<double> numbers(array.rows);
    for (uint64_t i = 0; i < array.rows; ++i)
        switch (array.type) {
        case ArrayType::kUint8:
            numbers[i] = array.at<uint8_t>(i);
            break;
        case ArrayType::kUint32:
            numbers[i] = array.at<uint32_t>(i);
            break;
        case ArrayType::kUint64:
            numbers[i] = double(array.at<uint64_t>(i));
            break;
        case ArrayType::kFloat:
            numbers[i] = double(array.at<float>(i));
            break;
        case ArrayType::kDouble:
            numbers[i] = array.at<double>(i);
            break;
        }
    return numbers;
}

[[noreturn]] void refuse(const std::string& path, const std::string& array, size_t row,
                         const std::string& what) {
    throw arrayError(path, "array \"" + array + "\", row " + std::to_string(row) + ": " + what);
}

/// Returns what may be a name in a chart.
bool isPrintable(const std::string& name) {
    return std::none_of(name.begin(), name.end(),
                        [](char c) { return uint8_t(c) < 32 || uint8_t(c) == 127; });
}

} // namespace

RayAnswers answersOf(const std::vector<NamedArray>& arrays, const std::string& path) {
    RayAnswers answers;
    answers.tracer = textOf(arrays, path, "name");
    if (answers.tracer.empty() || answers.tracer.size() > kMaxTracerName ||
        !isPrintable(answers.tracer))
        throw arrayError(path, "array \"name\" must be the tracer's name, 1 to " +
                                   std::to_string(kMaxTracerName) + " characters");
    answers.setId = textOf(arrays, path, "set_id");
    const NamedArray *lit = findArray(arrays, "lit"), *visibility = findArray(arrays, "visibility");
    if (!lit == !visibility)
        throw arrayError(path,
                         lit ? "has both arrays \"lit\" and \"visibility\""
                             : "has neither an array \"lit\" nor \"visibility\"",
                         "give one");
    const NamedArray& given = lit ? *lit : *visibility;
    const std::vector<double> values = numbersOf(given, path);
    for (size_t i = 0; i < values.size(); ++i) {
        if (lit ? values[i] != 0.0 && values[i] != 1.0 : !(values[i] >= 0.0 && values[i] <= 1.0))
            refuse(path, given.name, i, lit ? "is neither 0 nor 1" : "is not within 0 and 1");
        answers.visibility.push_back(float(values[i]));
    }
    if (const NamedArray* times = findArray(arrays, "time_ms"))
        answers.timeMs = numbersOf(*times, path);
    if (answers.timeMs.size() > kMaxRepeats)
        throw arrayError(path, "array \"time_ms\" has more than " + std::to_string(kMaxRepeats) +
                                   " rows");
    for (size_t i = 0; i < answers.timeMs.size(); ++i)
        if (!(answers.timeMs[i] > 0.0 && answers.timeMs[i] < 1e12))
            refuse(path, "time_ms", i, "is no time in milliseconds");
    if (const NamedArray* build = findArray(arrays, "build_ms")) {
        const std::vector<double> time = numbersOf(*build, path);
        if (time.size() != 1 || !(time[0] >= 0.0 && time[0] < 1e12))
            throw arrayError(path, "array \"build_ms\" is no time");
        answers.buildMs = time[0];
    }
    return answers;
}

std::vector<NamedArray> arraysOf(const RayAnswers& answers) {
    std::vector<NamedArray> arrays = {
        makeArray("name", ArrayType::kUint8, answers.tracer.data(), answers.tracer.size()),
        makeArray("set_id", ArrayType::kUint8, answers.setId.data(), answers.setId.size()),
        makeArray("visibility", ArrayType::kFloat, answers.visibility.data(),
                  answers.visibility.size()),
        makeArray("time_ms", ArrayType::kDouble, answers.timeMs.data(), answers.timeMs.size())};
    if (answers.buildMs >= 0.0)
        arrays.push_back(makeArray("build_ms", ArrayType::kDouble, &answers.buildMs, 1));
    return arrays;
}

void requireAnswersTo(const RaySet& set, const std::string& id, const RayAnswers& answers,
                      const std::string& path) {
    if (answers.setId != id)
        throw Error(ErrorKind::kInput, path + ": answers the set " + answers.setId +
                                           ", not this one, which is " + id +
                                           "; answer this set, or give that one");
    if (answers.visibility.size() != set.pairCount())
        throw Error(ErrorKind::kInput,
                    path + ": has answers to " + std::to_string(answers.visibility.size()) +
                        " pairs; the set has " + std::to_string(set.pairCount()) +
                        ": answer every pair, in the order of the set");
}

RayAnswers readAnswers(const std::string& path, const RaySet& set) {
    RayAnswers answers = answersOf(readArrays(kAnswersKind, path), path);
    requireAnswersTo(set, set.id(), answers, path);
    return answers;
}

RaySetTruth judgeRaySet(const RaySet& set) {
    RaySetTruth truth;
    truth.setId = set.id();
    truth.lit.resize(set.pairCount());
    truth.verdicts.resize(set.pairCount());
    const Truth embree(set.triangles());
    const Adjudicator adjudicator(set.triangles());
    cpuParallelRanges(set.pairCount(), 256, [&](size_t begin, size_t end) {
        std::vector<TruthRay> rays;
        std::vector<uint8_t> blocked(end - begin);
        for (size_t p = begin; p < end; ++p) {
            const uint32_t s = set.pairSample[p];
            rays.push_back(embree.pairRay(set.positionWorld[s], set.normalWorld[s], set.receiver[s],
                                          set.pairEnd(p)));
            truth.verdicts[p] =
                adjudicator
                    .rule({set.positionWorld[s], set.normalWorld[s], set.receiver[s]},
                          set.lightOf(p))
                    .verdict;
        }
        embree.traceBlocked(rays.data(), rays.size(), blocked.data());
        for (size_t p = begin; p < end; ++p)
            truth.lit[p] = !blocked[p - begin];
    });
    return truth;
}

Json scoreRow(const RaySet& set, const RaySetTruth& truth, const RayAnswers& answers) {
    uint64_t falseShadow = 0, falseLight = 0, dark = 0, proven = 0, provenWrong = 0;
    double error = 0, square = 0;
    for (size_t p = 0; p < set.pairCount(); ++p) {
        const bool isLit = truth.lit[p] != 0, saysLit = answers.visibility[p] >= 0.5f;
        const double off = std::fabs(double(answers.visibility[p]) - (isLit ? 1.0 : 0.0));
        error += off;
        square += off * off;
        dark += !isLit;
        falseShadow += isLit && !saysLit;
        falseLight += !isLit && saysLit;
        if (truth.verdicts[p] == Verdict::kAmbiguous)
            continue;
        ++proven;
        provenWrong += saysLit != (truth.verdicts[p] == Verdict::kLit);
    }
    const double pairs = double(std::max<size_t>(set.pairCount(), 1));
    Json row = {{"scene", set.about.value("scene", "")},
                {"frame", set.about.value("frame", 0)},
                {"label", answers.tracer},
                {"method", "tracer"},
                {"model", answers.tracer},
                {"parameters", Json::object()},
                {"pair_count", set.pairCount()},
                {"occluded_count", dark},
                {"false_shadow_count", falseShadow},
                {"false_light_count", falseLight},
                {"mean_abs_visibility_error", error / pairs},
                {"rmse", std::sqrt(square / pairs)},
                {"proven_count", proven},
                {"proven_wrong_count", provenWrong},
                {"dag_bytes", 0},
                {"map_bytes", 0}};
    if (!answers.timeMs.empty()) {
        row.update(Timing{answers.timeMs, {}, {}}.toJson());
        row["ns_per_pair"] = row["time_ms"].get<double>() * 1e6 / pairs;
    }
    if (answers.buildMs >= 0.0)
        row["build_ms"] = answers.buildMs;
    return row;
}

} // namespace shadowdag
