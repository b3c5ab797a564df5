// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/gl_support.h"

#include "cuda/error.h"
#include "hybrid/gl/gl_options.h"
#include "tools/settings/setting.h"
#include "tools/settings/variants.h"

#include <algorithm>

namespace shadowdag {

namespace {

/// Returns why gl does not support a setting's value, "" if it does.
std::string whyNotValue(const Setting& setting, const std::string& text) {
    FrameOptions options;
    setting.setFrame(options, setting.option, text);
    return unfollowedByGl(options);
}

std::string whyNotVariant(const std::string& name) {
    return unfollowedByGl(variantRun(parseVariant("variant", name), {}).frame);
}

std::string whyNotMethod(const std::string& name) {
    return methodOf(name).needs().embree ? "has no rays of Embree, which run on the CPU" : "";
}

[[noreturn]] void refuse(const std::string& what, Backend backend, const std::string& why) {
    throw Error(ErrorKind::kUsage, what + ": --backend " + backendName(backend) + " " + why +
                                       "; drop it, or use --backend cpu" +
                                       (backend == Backend::kGl ? " or cuda" : ""));
}

} // namespace

std::vector<std::string> leaveOutUnsupported(Experiment& experiment, Backend backend,
                                             const CommandLine& commandLine,
                                             const std::vector<std::string>& namedVariants,
                                             const Console& console) {
    std::vector<std::string> leftOut;
    // An empty reason is ignored. Returns whether nothing is left.
    const auto takeOut = [&](auto& list, const std::string& option, const std::string& what,
                             const auto& textOf, const auto& whyNot, const auto& isNamed) {
        const bool hadSome = !list.empty();
        std::erase_if(list, [&](const auto& value) {
            const std::string why = whyNot(value);
            if (why.empty())
                return false;
            if (isNamed(value))
                refuse(option + " '" + textOf(value) + "'", backend, why);
            leftOut.push_back(what + " " + textOf(value) + ": --backend " + backendName(backend) +
                              " " + why);
            return true;
        });
        return hadSome && list.empty();
    };
    const auto given = [&](const char* option) {
        return [isGiven = commandLine.declares(option) && commandLine.given(option)](const auto&) {
            return isGiven;
        };
    };
    const auto same = [](const std::string& text) { return text; };
    if (backend == Backend::kCpu)
        return leftOut;
    takeOut(experiment.methods, "--methods", "method", same, whyNotMethod, given("--methods"));
    if (backend != Backend::kGl) {
        for (const std::string& text : leftOut)
            console.note("omitted: " + text);
        return leftOut;
    }
    takeOut(experiment.variants, "--variants", "variant", same, whyNotVariant,
            [&](const std::string& name) {
                return std::any_of(
                    namedVariants.begin(), namedVariants.end(), [&](const std::string& named) {
                        return named != "paper" && parseVariant("--variants", named) ==
                                                       parseVariant("--variants", name);
                    });
            });
    if (!leftOut.empty() && experiment.methods.empty() && experiment.variants.empty())
        throw Error(ErrorKind::kUsage, leftOut.back() + ", and nothing else is requested; use "
                                                        "--backend cpu or cuda");
    // Every run has a value of each: if none is left, the default of gl.
    for (const Setting* setting : frameSettings()) {
        std::vector<std::string> values = setting->texts(experiment);
        const size_t count = values.size();
        const bool isEmpty = takeOut(
            values, setting->option, setting->key, same,
            [&](const std::string& text) { return whyNotValue(*setting, text); },
            given(setting->option.c_str()));
        if (isEmpty) {
            values = {setting->onGl.empty() ? setting->texts(Experiment()).front() : setting->onGl};
            leftOut.back() += "; " + values[0] + " instead";
        }
        if (values.size() != count || isEmpty)
            setting->set(experiment, setting->option, values);
    }
    for (const std::string& text : leftOut)
        console.note("omitted: " + text);
    return leftOut;
}

void takeGlDefaults(Experiment& experiment, const std::string& backend,
                    const CommandLine& commandLine) {
    for (const Setting* setting : frameSettings())
        if (backend == "gl" && !setting->onGl.empty() && !commandLine.given(setting->option))
            setting->set(experiment, setting->option, {setting->onGl});
}

void refuseOnGl(const Experiment& experiment, Backend backend, const std::string& variant) {
    if (backend != Backend::kGl)
        return;
    if (!variant.empty())
        if (const std::string why = whyNotVariant(variant); !why.empty())
            refuse("--variant '" + variant + "'", backend, why);
    for (const Setting* setting : frameSettings())
        for (const std::string& text : setting->texts(experiment))
            if (const std::string why = whyNotValue(*setting, text); !why.empty())
                refuse(setting->option + " '" + text + "'", backend, why);
}

} // namespace shadowdag
