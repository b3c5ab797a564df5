// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/gl_support.h"

#include "cuda/error.h"
#include "hybrid/gl/gl_options.h"
#include "tools/settings/parse.h"
#include "tools/settings/variants.h"

#include <algorithm>

namespace shadowdag {

namespace {

std::string whyNotMethod(const std::string& method) {
    FrameOptions options;
    if (method == "dag-exact")
        options.rays.kind = RayKind::kExact;
    return unfollowedByGl(options);
}

std::string whyNotLod(const LodChoice& lod) {
    FrameOptions options;
    lod.apply(options.rays);
    return unfollowedByGl(options);
}

std::string whyNotPolygonLod(float texels) {
    FrameOptions options;
    options.maps.lodTexels = texels;
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
    // Every run has one of these: where none is left, what experiments start with, which gl
    // follows.
    const auto lodText = [](const LodChoice& lod) { return lod.text(); };
    const auto texelsText = [](float texels) { return numberText(texels); };
    const Experiment fresh;
    if (takeOut(experiment.lod, "--lod", "level of detail", lodText, whyNotLod, given("--lod"))) {
        experiment.lod = fresh.lod;
        leftOut.back() += "; " + lodText(fresh.lod.front()) + " in its place";
    }
    if (takeOut(experiment.polygonLod, "--polygon-lod", "polygon level of detail", texelsText,
                whyNotPolygonLod, given("--polygon-lod"))) {
        experiment.polygonLod = fresh.polygonLod;
        leftOut.back() += "; " + texelsText(fresh.polygonLod.front()) + " in its place";
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
    for (const LodChoice& lod : experiment.lod)
        if (const std::string why = whyNotLod(lod); !why.empty())
            refuse("--lod '" + lod.text() + "'", why);
    for (const float texels : experiment.polygonLod)
        if (const std::string why = whyNotPolygonLod(texels); !why.empty())
            refuse("--polygon-lod '" + numberText(texels) + "'", why);
}

} // namespace shadowdag
