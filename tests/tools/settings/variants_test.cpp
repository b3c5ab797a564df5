// SPDX-License-Identifier: Apache-2.0
// Variants by name: round trips over all parts, every refusal with part and position.
#include "tools/settings/variants.h"

#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <random>

namespace shadowdag {

namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string refusal(const std::string& name) {
    try {
        parseVariant("--variants", name);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage) << name;
        return error.what();
    }
    ADD_FAILURE() << "no error for " << name;
    return "";
}

std::string canonical(const std::string& name) {
    return variantName(parseVariant("--variants", name));
}

/// A variant at random, as parseVariant may return one.
Variant randomVariant(std::mt19937_64& random) {
    const auto pick = [&](uint32_t count) { return uint32_t(random() % count); };
    Variant v;
    v.bounds = std::array{ClusterBounds::kImplicit, ClusterBounds::kExplicit,
                          ClusterBounds::kTight}[pick(3)];
    v.normalClusters = pick(2) ? 0 : 1 + pick(4);
    v.pruning = std::array{PairPruning::kNone, PairPruning::kFacing, PairPruning::kLit}[pick(3)];
    v.reorderLights = pick(2);
    v.method = std::array{Variant::Method::kMaps, Variant::Method::kRays,
                          Variant::Method::kHybrid}[pick(3)];
    if (v.method == Variant::Method::kRays)
        return v;
    if (v.method == Variant::Method::kHybrid)
        v.model = std::array{"texels:96", "texels:12.25", "oracle", "expr:texels-96",
                             "expr:(texels-96)*(pages-2)"}[pick(5)];
    if (v.method == Variant::Method::kHybrid && pick(2))
        v.routeMargin = std::array{0.0f, 0.1f, 0.25f}[pick(3)];
    v.culling = MapCulling(pick(5));
    v.useStaticOptimization = pick(2);
    v.retainsPages = v.useStaticOptimization && pick(2);
    v.lodTexels = std::array{0.0f, 1.0f, 0.5f, 2.25f}[pick(4)];
    v.pageMarks = PageMarks(pick(2));
    v.resolutionRule = pick(2) ? ResolutionRule::kPlane : ResolutionRule::kSphere;
    v.mapsPerLight = 1 + pick(16);
    v.undersample = std::array{1.0f, 2.0f, 4.0f, 1.5f}[pick(4)];
    v.taps = std::array{0u, 1u, 4u, 9u}[pick(4)];
    return v;
}

} // namespace

TEST(Variants, EveryNameParsesToItsVariant) {
    const uint64_t seed = 11;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 3000; ++i) {
        const Variant v = randomVariant(random);
        const std::string name = variantName(v);
        EXPECT_EQ(parseVariant("--variants", name), v) << name;
        EXPECT_EQ(canonical(name), name);
    }
}

TEST(Variants, PartsMayHaveAnyOrder) {
    EXPECT_EQ(canonical("PMCD-EB-SO-4SM-u2"), "PMCD-EB-SO-u2");
    EXPECT_EQ(canonical("u2-4SM-SO-EB-PMCD"), "PMCD-EB-SO-u2");
    EXPECT_EQ(canonical("1SM-PMC"), "PMC-1SM");
}

TEST(Variants, ANameOmitsThePapersDefaults) {
    const Variant v = parseVariant("--variants", "PMCD");
    EXPECT_EQ(v.mapsPerLight, 4u);
    EXPECT_EQ(v.bounds, ClusterBounds::kImplicit);
    EXPECT_EQ(v.undersample, 1.0f);
    EXPECT_FALSE(v.useStaticOptimization);
}

TEST(Variants, HybridIsPmcdEbByDefault) {
    EXPECT_EQ(parseVariant("--variants", "Hybrid"), parseVariant("--variants", "Hybrid-PMCD-EB"));
    EXPECT_EQ(parseVariant("--variants", "Hybrid").bounds, ClusterBounds::kExplicit);
    EXPECT_EQ(parseVariant("--variants", "Hybrid").model, "texels:96");
    EXPECT_EQ(parseVariant("--variants", "Hybrid-PMCD").bounds, ClusterBounds::kImplicit);
    EXPECT_EQ(parseVariant("--variants", "Hybrid-TB").bounds, ClusterBounds::kTight);
    EXPECT_EQ(canonical("Hybrid-PMCD-EB-SO"), "Hybrid-SO");
    EXPECT_EQ(canonical("Hybrid:texels:32"), "Hybrid:texels:32");
}

TEST(Variants, RaysHaveThreeNames) {
    for (const char* name : {"RT", "Ray Tracing", "all-rays"})
        EXPECT_EQ(canonical(name), "RT");
    EXPECT_EQ(canonical("all-rays-EB"), "RT-EB");
}

TEST(Variants, AnUnknownPartIsRefusedWithItsPosition) {
    EXPECT_THAT(refusal("PMCD-EX"),
                HasSubstr("--variants 'PMCD-EX': part 2, 'EX' at character 6, is unknown"));
    EXPECT_THAT(refusal(""), HasSubstr("part 1, '' at character 1, is unknown"));
    EXPECT_THAT(refusal("PMCD--EB"), HasSubstr("part 2, '' at character 6, is unknown"));
    for (const char* part : {"pmcd", "4sm", "u2x", "1.5SM", "all-ray", "+1SM", "u1e2"})
        EXPECT_THAT(refusal(part), HasSubstr("is unknown")) << part;
    for (const char* part : {"u", "SM", "Nk", "T", "PLOD", "u-2", "PLOD-1"})
        EXPECT_THAT(refusal(part), HasSubstr("lacks its number, which follows without a dash"))
            << part;
    EXPECT_THAT(refusal("PMCD-PLOD-1"), HasSubstr("as in PLOD1"));
}

TEST(Variants, NumbersOutOfRangeAreRefused) {
    EXPECT_THAT(refusal("PMCD-17SM"),
                HasSubstr("'17SM' at character 6, is out of range: use 1 to 16"));
    EXPECT_THAT(refusal("PMCD-0SM"), HasSubstr("out of range"));
    EXPECT_THAT(refusal("PMCD-u0.5"), HasSubstr("out of range: use 1 to 1024"));
    EXPECT_THAT(refusal("PMCD-Nk0"), HasSubstr("out of range"));
    EXPECT_THAT(refusal("PMCD-PLOD0"), HasSubstr("out of range"));
    EXPECT_THAT(refusal("Hybrid-RH1001"), HasSubstr("out of range: use 0 to 1000"));
    EXPECT_THAT(refusal("PMCD-T2"), HasSubstr("is not a filter: use T1, T4 or T9"));
    EXPECT_THAT(refusal("Hybrid:magic"),
                HasSubstr("'Hybrid:magic' at character 1, is not a cost model"));
}

TEST(Variants, PartsThatContradictEachOtherAreRefused) {
    EXPECT_THAT(refusal("PMC-EB-PMCD"),
                HasSubstr("part 3, 'PMCD' at character 8, contradicts part 1, 'PMC': use one"));
    EXPECT_THAT(refusal("PMCD-EB-TB"), HasSubstr("contradicts part 2, 'EB'"));
    EXPECT_THAT(refusal("PMCD-1SM-4SM"), HasSubstr("contradicts part 2, '1SM'"));
    EXPECT_THAT(refusal("PMCD-SO-SOR"), HasSubstr("contradicts part 2, 'SO'"));
    EXPECT_THAT(refusal("RT-Hybrid"), HasSubstr("contradicts part 1, 'RT'"));
    EXPECT_THAT(refusal("RT-4SM"),
                HasSubstr("part 2, '4SM' at character 4, contradicts 'RT', which draws no maps"));
    EXPECT_THAT(refusal("PMCD-RH"), HasSubstr("'RH' at character 6, is for Hybrid"));
    EXPECT_THAT(refusal("RT-RH0.2"), HasSubstr("'RH0.2' at character 4, is for Hybrid"));
    EXPECT_THAT(refusal("EB-SO"), HasSubstr("has no culling"));
}

TEST(Variants, PaperListsAllVariantsOfThePaper) {
    const std::vector<std::string> names =
        parseVariants("--variants", {"paper", "PMCC-EB", "RT"}, {});
    for (const char* name : {"CFM", "PMC", "PMCD", "PMCD-EB", "PMCD-EB-SO", "PMCD-EB-1SM",
                             "PMCD-EB-u2", "PMCD-EB-u4", "PMCD-EB-Nk3", "RT", "Hybrid"})
        EXPECT_THAT(names, testing::Contains(name));
    EXPECT_EQ(names[paperVariants().size() - 1], "PMCC-EB");
    EXPECT_EQ(names.back(), "RT"); // named by itself, it stands where it was named
    EXPECT_EQ(names.size(), paperVariants().size() + 1);
    for (const std::string& name : paperVariants())
        EXPECT_EQ(canonical(name), name);
}

TEST(Variants, TwoSpellingsOfOneVariantAreRefusedByBothNames) {
    const auto message = [](const std::vector<std::string>& names, const FrameOptions& base) {
        try {
            parseVariants("--variants", names, base);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(message({"PMCD-4SM", "RT", "PMCD"}, {}),
                HasSubstr("--variants 'PMCD': is the variant 'PMCD', which 'PMCD-4SM' denotes as "
                          "well; drop one"));
    EXPECT_THAT(message({"Hybrid", "Hybrid:texels:96.0"}, {}), HasSubstr("which 'Hybrid' denotes"));
    EXPECT_THAT(message({"Hybrid-RH", "Hybrid-RH0.10"}, {}),
                HasSubstr("is the variant 'Hybrid-RH', which 'Hybrid-RH' denotes"));
    EXPECT_THAT(message({"Hybrid:expr:texels - 96", "PMC"}, {}), HasSubstr("in parentheses"));
    EXPECT_THAT(message({"Hybrid:expr:( texels - 96 )", "Hybrid:expr:((texels-96))"}, {}),
                HasSubstr("is the variant 'Hybrid:expr:(texels-96)'"));
    // The values of --taps and --route-margin are omitted from names.
    FrameOptions base;
    EXPECT_THAT(message({"PMCD-T4", "PMCD"}, base), HasSubstr("is the variant 'PMCD'"));
    EXPECT_THAT(message({"Hybrid-RH0", "Hybrid"}, base), HasSubstr("is the variant 'Hybrid'"));
    base.bias.taps = base.maps.taps = 1;
    base.routeMargin = 0.25f;
    EXPECT_EQ(message({"PMCD-T9", "PMCD", "Hybrid-RH0", "Hybrid"}, base), "");
    EXPECT_THAT(parseVariants("--variants", {"PMCD-T1", "PMCC-T9", "Hybrid-RH0.25"}, base),
                ElementsAre("PMCD", "PMCC-T9", "Hybrid"));
}

TEST(Variants, AModelHasOneSpelling) {
    EXPECT_EQ(canonical("Hybrid:texels:96.0"), "Hybrid");
    EXPECT_EQ(canonical("Hybrid:texels:032.50"), "Hybrid:texels:32.5");
    EXPECT_EQ(canonical("Hybrid:texels:1e2-SO"), "Hybrid:texels:100-SO");
    EXPECT_EQ(canonical("Hybrid:expr:(texels+1)"), "Hybrid:expr:texels+1");
    EXPECT_EQ(canonical("Hybrid:expr:(texels-1)-EB-PMCC"), "Hybrid:expr:(texels-1)-PMCC-EB");
    EXPECT_EQ(canonical("Hybrid:expr:(texels-1)*(pages-1)"), "Hybrid:expr:(texels-1)*(pages-1)");
    EXPECT_EQ(parseVariant("--variants", "Hybrid:expr:(texels-96)-SO").model, "expr:texels-96");
    EXPECT_THAT(refusal("Hybrid:texels:0.0"), HasSubstr("draws every map: use its culling"));
    EXPECT_THAT(refusal("Hybrid:texels:inf"), HasSubstr("traces every light: use RT"));
}

TEST(Variants, ADashInAnExpressionIsRefusedWithARemedy) {
    const char* remedy = "put an expression with '-' in parentheses, as in Hybrid:expr:(texels";
    for (const char* name : {"Hybrid:expr:texels-96", "Hybrid:expr:a-b", "Hybrid:expr:96-texels",
                             "Hybrid:expr:(texels-96", "Hybrid:expr:2*-texels"})
        EXPECT_THAT(refusal(name), HasSubstr(remedy)) << name;
    EXPECT_THAT(refusal("Hybrid-XX"), Not(HasSubstr(remedy)));
}

// Proofs of voxel rays would decide pairs that the frame's own rays do not believe voxels about.
TEST(Variants, ProofsOfLightNeedMapsOrRaysThatBelieveAllVoxels) {
    FrameOptions base;
    for (const float believe : {0.0f, 0.5f}) {
        base.rays.believe = believe;
        for (const char* name : {"RT-LP", "Hybrid-LP"}) {
            try {
                variantRun(parseVariant("--variants", name), base);
                ADD_FAILURE() << name << " was taken with believe " << believe;
            } catch (const Error& error) {
                EXPECT_EQ(error.kind(), ErrorKind::kUsage);
                EXPECT_THAT(error.what(), HasSubstr("LP decides pairs by voxel rays"));
            }
        }
        EXPECT_NO_THROW(variantRun(parseVariant("--variants", "PMCD-LP"), base));
    }
}

TEST(Variants, SwitchesReachTheFrame) {
    FrameOptions base;
    base.width = 100;
    base.bias.taps = base.maps.taps = 9;
    const auto run = [&](const char* name) {
        return variantRun(parseVariant("--variants", name), base);
    };
    EXPECT_EQ(run("CFM").frame.maps.culling, MapCulling::kFaceMask);
    EXPECT_EQ(run("CFM").frame.width, 100u);
    EXPECT_EQ(run("CFM").frame.clusterBounds, ClusterBounds::kImplicit);
    EXPECT_EQ(run("PMCD-EB").frame.clusterBounds, ClusterBounds::kExplicit);
    EXPECT_TRUE(run("PMCD-SO").frame.maps.useStaticOptimization);
    EXPECT_FALSE(run("PMCD-SO").frame.maps.retainsPages);
    EXPECT_TRUE(run("PMCD-SOR").frame.maps.retainsPages);
    EXPECT_EQ(run("PMCD").frame.mapsPerLight, 4u);
    EXPECT_EQ(run("PMCD-16SM-u4").frame.mapsPerLight, 16u);
    EXPECT_EQ(run("PMCD-16SM-u4").frame.undersample, 4.0f);
    EXPECT_EQ(run("PMCD-T1").frame.bias.taps, 1u);
    EXPECT_EQ(run("PMCD-LP").frame.pruning, PairPruning::kLit);
    EXPECT_TRUE(run("PMCD-LP").usesVoxels());
    EXPECT_EQ(run("PMCD").frame.pageMarks, PageMarks::kBoxes);
    EXPECT_EQ(run("PMCD-SP").frame.pageMarks, PageMarks::kLookups);
    EXPECT_EQ(run("PMCD-RP").frame.resolutionRule, ResolutionRule::kPlane);
    EXPECT_EQ(run("PMCD-Nk3").frame.normalClusters, 3u);
    EXPECT_EQ(run("RT-Nk3").frame.normalClusters, 3u);
    EXPECT_EQ(run("PMCD-PLOD2").frame.maps.lodTexels, 2.0f);
    EXPECT_TRUE(run("PMCD-RL").frame.reorderLights);
    EXPECT_EQ(run("Hybrid").frame.routeMargin, 0.0f);
    EXPECT_EQ(run("Hybrid-RH").frame.routeMargin, 0.1f);
    EXPECT_EQ(run("Hybrid-RH0.2").frame.routeMargin, 0.2f);
    base.routeMargin = 0.3f;
    EXPECT_EQ(run("Hybrid").frame.routeMargin, 0.3f);
    EXPECT_EQ(run("Hybrid-RH0").frame.routeMargin, 0.0f);
    EXPECT_EQ(run("RT").method, "dag");
    EXPECT_EQ(run("RT").model, "texels:inf");
    EXPECT_EQ(run("Hybrid").model, "texels:96");
    EXPECT_EQ(run("PMCD-u2-EB").label(), "PMCD-EB-u2");
    EXPECT_EQ(run("PMCD-u2-EB").toJson()["variant"], "PMCD-EB-u2");
}

TEST(Variants, AConfigurationContainsItsVariant) {
    const uint64_t seed = 12;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 1000; ++i) {
        Variant v = randomVariant(random);
        if (v.taps == ShadowMapBias{}.taps)
            v.taps = 0; // what is given anyhow is not named
        if (v.routeMargin == 0.0f)
            v.routeMargin.reset();
        EXPECT_EQ(variantName(variantOf(variantRun(v, FrameOptions{}))), variantName(v));
    }
}

} // namespace shadowdag
