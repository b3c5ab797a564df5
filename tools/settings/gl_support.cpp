// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/gl_support.h"

#include "cuda/error.h"
#include "hybrid/gl/gl_options.h"
#include "tools/settings/setting.h"
#include "tools/settings/variants.h"

#include <algorithm>

namespace shadowdag {

namespace {

std::string whyNotMethod(const std::string& method) {
    FrameOptions options;
    if (!method.empty())
        methodOf(method).configure(options);
    return unfollowedByGl(options);
}

/// Returns why gl does not follow a setting's value, "" where it does.
std::string whyNotValue(const Setting& setting, const std::string& text) {
    FrameOptions options;
    setting.setFrame(options, setting.option, text);
    return unfollowedByGl(options);
}

std::string whyNotVariant(const std::string& name) {
    return unfollowedByGl(variantRun(parseVariant("variant", name), {}).frame);
}

[[noreturn]] void refuse(const std::string& what, const std::string& why) {
    throw Error(ErrorKind::kUsage,
                what + ": --backend gl " + why + "; drop it, or use --backend cpu or cuda");
}

} // namespace

std::vector<std::string> leaveOutOnGl(Experiment& experiment, Backend backend,
                                      const CommandLine& commandLine,
                                      const std::vector<std::string>& namedVariants,
                                      const Console& console) {
    std::vector<std::string> leftOut;
    if (backend != Backend::kGl)
        return leftOut;
    // An empty reason is none. Returns whether there is nothing left of what was there.
    const auto takeOut = [&](auto& list, const std::string& option, const std::string& what,
                             const auto& textOf, const auto& whyNot, const auto& isNamed) {
        const bool hadSome = !list.empty();
        std::erase_if(list, [&](const auto& value) {
            const std::string why = whyNot(value);
            if (why.empty())
                return false;
            if (isNamed(value))
                refuse(option + " '" + textOf(value) + "'", why);
            leftOut.push_back(what + " " + textOf(value) + ": --backend gl " + why);
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
    takeOut(experiment.methods, "--methods", "method", same, whyNotMethod, given("--methods"));
    takeOut(experiment.variants, "--variants", "variant", same, whyNotVariant,
            [&](const std::string& name) {
                return std::any_of(
                    namedVariants.begin(), namedVariants.end(), [&](const std::string& named) {
                        return named != "paper" && parseVariant("--variants", named) ==
                                                       parseVariant("--variants", name);
                    });
            });
    if (!leftOut.empty() && experiment.methods.empty() && experiment.variants.empty())
        throw Error(ErrorKind::kUsage, leftOut.back() + ", and nothing else is asked for; use "
                                                        "--backend cpu or cuda");
    // Every run has a value of each: where none is left, the default, which gl follows.
    for (const Setting* setting : frameSettings()) {
        std::vector<std::string> values = setting->texts(experiment);
        const size_t count = values.size();
        const bool isEmpty = takeOut(
            values, setting->option, setting->key, same,
            [&](const std::string& text) { return whyNotValue(*setting, text); },
            given(setting->option.c_str()));
        if (isEmpty) {
            values = {setting->texts(Experiment()).front()};
            leftOut.back() += "; " + values[0] + " in its place";
        }
        if (values.size() != count || isEmpty)
            setting->set(experiment, setting->option, values);
    }
    for (const std::string& text : leftOut)
        console.note("left out: " + text);
    return leftOut;
}

void refuseOnGl(const Experiment& experiment, Backend backend, const std::string& method,
                const std::string& variant, const std::string& methodOption) {
    if (backend != Backend::kGl)
        return;
    if (const std::string why = whyNotMethod(method); !why.empty())
        refuse(methodOption + " '" + method + "'", why);
    if (!variant.empty())
        if (const std::string why = whyNotVariant(variant); !why.empty())
            refuse("--variant '" + variant + "'", why);
    for (const Setting* setting : frameSettings())
        for (const std::string& text : setting->texts(experiment))
            if (const std::string why = whyNotValue(*setting, text); !why.empty())
                refuse(setting->option + " '" + text + "'", why);
}

} // namespace shadowdag
