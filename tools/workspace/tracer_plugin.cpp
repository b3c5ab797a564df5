// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/tracer_plugin.h"

#include "cuda/backend.h"
#include "cuda/cancel.h"
#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "scenes/input_file.h"
#include "tools/workspace/tracer_api.h"

#include <array>
#include <cerrno>
#include <cfenv>
#include <chrono>
#include <dlfcn.h>
#include <filesystem>

namespace shadowdag {

namespace {

constexpr size_t kMostNameBytes = 64;

double millisecondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

/// Room for a tracer's words about an error.
struct ErrorText {
    std::array<char, 512> text{};

    ShadowdagError room() { return {text.data(), text.size()}; }
    std::string said() const {
        const std::string words(text.data(), strnlen(text.data(), text.size()));
        return words.empty() ? "it gives no reason" : words;
    }
};

/// Returns an Error kInput about a plug-in.
Error tracerError(const std::string& path, const std::string& why,
                  const std::string& remedy = "build a plug-in as docs/rays.md describes it") {
    return Error(ErrorKind::kInput, "--tracer " + path + ": " + why + "; " + remedy);
}

} // namespace

struct TracerPlugin::Library {
    void* handle = nullptr;
    const ShadowdagTracer* tracer = nullptr;

    ~Library() {
        if (handle)
            dlclose(handle);
    }
};

TracerPlugin::TracerPlugin(const std::string& path)
    : library_(std::make_unique<Library>()), path_(path) {
    const auto refuse = [&](const std::string& why) { throw tracerError(path, why); };
    // dlopen would wait for the writer of a pipe.
    if (const std::string why = whyNoInput(path, ~uint64_t(0)); !why.empty())
        throw tracerError(path, why, "give a shared library that exports " SHADOWDAG_TRACER_SYMBOL);
    library_->handle = dlopen(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library_->handle) {
        const std::string why = dlerror();
        if (saysTooManyFiles(why))
            refuseTooManyFiles(path, EMFILE);
        refuse("cannot be loaded: " + why);
    }
    void* const symbol = dlsym(library_->handle, SHADOWDAG_TRACER_SYMBOL);
    if (!symbol)
        refuse("exports no function " SHADOWDAG_TRACER_SYMBOL);
    const auto function = reinterpret_cast<ShadowdagTracerFunction>(symbol);
    library_->tracer = function();
    const ShadowdagTracer* const tracer = library_->tracer;
    if (!tracer)
        refuse(SHADOWDAG_TRACER_SYMBOL " returns null");
    if (tracer->version != SHADOWDAG_TRACER_VERSION)
        throw tracerError(path,
                          "is of version " + std::to_string(tracer->version) +
                              " of the interface; this program has " +
                              std::to_string(SHADOWDAG_TRACER_VERSION),
                          "build it with this program's tracer_api.h");
    if (!tracer->name || !tracer->build || !tracer->occluded || !tracer->destroy)
        refuse("its table lacks name, build, occluded or destroy");
    name_ = tracer->name;
    if (name_.empty() || name_.size() > kMostNameBytes)
        refuse("its name must have 1 to " + std::to_string(kMostNameBytes) + " bytes");
}

TracerPlugin::~TracerPlugin() = default;

RayAnswers TracerPlugin::answer(const RaySet& set, uint32_t repeatCount) const {
    const ShadowdagTracer& tracer = *library_->tracer;
    const auto refuse = [&](const std::string& why) { throw tracerError(path_, why); };
    std::vector<glm::vec3> samples, normals, ends;
    std::vector<uint32_t> receivers;
    for (size_t p = 0; p < set.pairCount(); ++p) {
        const uint32_t s = set.pairSample[p];
        samples.push_back(set.positionWorld[s]);
        normals.push_back(set.normalWorld[s]);
        ends.push_back(set.pairEnd(p));
        receivers.push_back(set.receiver[s]);
    }
    const auto threadCount = uint32_t(shadowdag::threadCount());
    const ShadowdagTriangles triangles = {
        reinterpret_cast<const float*>(set.vertex.data()), set.vertex.size(),
        reinterpret_cast<const uint32_t*>(set.triangle.data()), set.triangle.size(), threadCount};
    const ShadowdagSegments segments = {set.pairCount(),
                                        reinterpret_cast<const float*>(samples.data()),
                                        reinterpret_cast<const float*>(normals.data()),
                                        reinterpret_cast<const float*>(ends.data()),
                                        receivers.data(),
                                        threadCount};
    const auto given = [&] { // the hash of what the plug-in may read
        ContentHasher hasher;
        const auto add = [&](const auto& values) {
            hasher.add(values.data(), values.size() * sizeof values[0]);
        };
        add(set.vertex), add(set.triangle), add(samples), add(normals), add(ends), add(receivers);
        return hasher.hash();
    };
    const auto before = given();
    // Code of others: it may throw, and leave another rounding mode.
    const auto guarded = [&](const auto& call) {
        std::fenv_t mode;
        std::fegetenv(&mode);
        const auto restore = [](std::fenv_t* saved) { std::fesetenv(saved); };
        const std::unique_ptr<std::fenv_t, decltype(restore)> guard(&mode, restore);
        std::string why = "throws an exception";
        try {
            return call();
        } catch (const std::exception& error) {
            why += std::string(": ") + error.what();
        } catch (...) { // NOLINT(bugprone-empty-catch): refused below
        }
        throw tracerError(path_, why);
    };
    ErrorText error;
    auto start = std::chrono::steady_clock::now();
    void* const built = guarded([&] { return tracer.build(&triangles, error.room()); });
    RayAnswers answers;
    answers.buildMs = millisecondsSince(start);
    if (!built)
        refuse("cannot build over " + std::to_string(set.triangle.size()) +
               " triangles: " + error.said());
    const std::unique_ptr<void, void (*)(void*)> owner(built, tracer.destroy);
    answers.tracer = name_;
    answers.setId = set.id();
    std::vector<uint8_t> first, blocked;
    for (uint32_t repeat = 0; repeat <= repeatCount; ++repeat) {
        pollCpu();
        blocked.assign(set.pairCount(), 2); // neither answer
        start = std::chrono::steady_clock::now();
        const int status = guarded(
            [&] { return tracer.occluded(built, &segments, blocked.data(), error.room()); });
        if (repeat > 0)
            answers.timeMs.push_back(millisecondsSince(start));
        if (status != 0)
            refuse("cannot answer " + std::to_string(set.pairCount()) + " pairs: " + error.said());
        for (size_t p = 0; p < blocked.size(); ++p)
            if (blocked[p] > 1)
                refuse("leaves pair " + std::to_string(p) + " without an answer of 0 or 1");
        if (repeat == 0)
            first = blocked;
        else if (blocked != first)
            refuse("answers differ between repetitions, so that none can be scored");
    }
    if (given() != before)
        refuse("changes the triangles or segments that it is given, of which the truth is made, "
               "too; let it sort copies");
    for (const uint8_t isBlocked : first)
        answers.visibility.push_back(isBlocked ? 0.0f : 1.0f);
    return answers;
}

} // namespace shadowdag
