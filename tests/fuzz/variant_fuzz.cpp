// SPDX-License-Identifier: Apache-2.0
// Names of variants: a name that is read has a canonical name, which is read as the same variant.
#include "tests/fuzz/fuzz_target.h"
#include "tools/settings/parse.h"
#include "tools/settings/variants.h"

namespace shadowdag::fuzz::variant {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const std::string text(data, data + size);
    for (const std::string& name : parseList("--variants", text)) {
        if (name == "paper")
            continue;
        const Variant variant = parseVariant("--variants", name);
        const std::string canonical = variantName(variant);
        fuzzCheck(variantName(parseVariant("--variants", canonical)) == canonical,
                  "a canonical name stays as it is");
        const RunParameters run = variantRun(variant, {});
        fuzzCheck(!run.label().empty() && run.slug().size() < 200, "a label is a file name");
    }
    parseVariants("--variants", parseList("--variants", text), {});
}

std::vector<std::string> seeds() {
    std::vector<std::string> names = paperVariants();
    names.insert(names.end(), {"PMCD-EB-SO-4SM-u2", "Hybrid:expr:(texels-96)-RH0.25", "paper,RT",
                               "Sphere-TB-SOR-Nk3-PLOD0.5-LP-RP-RL-16SM-u1024-T4"});
    return names;
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "variant",
                   .maxBytes = 1024,
                   .fuzzOne = fuzzOne,
                   .seeds = seeds,
                   .words = {"-",  ",",           "Sphere",   "CFM",     "PMC",   "PMCD", "PMCC",
                             "EB", "TB",          "SO",       "SOR",     "Nk",    "PLOD", "FP",
                             "LP", "SP",          "RP",       "RL",      "SM",    "u",    "T",
                             "RT", "Hybrid",      "Hybrid:",  "texels:", "expr:", "cost", "oracle",
                             "RH", "Ray Tracing", "all-rays", "paper"}});

} // namespace

} // namespace shadowdag::fuzz::variant
