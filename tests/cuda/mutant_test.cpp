// SPDX-License-Identifier: Apache-2.0
// The table of faults, and that none is committed unasked.
#include "cuda/mutant.h"

#include <gtest/gtest.h>

#include <iterator>
#include <set>
#include <string>

namespace shadowdag {
namespace {

TEST(Mutant, EachHasAnOwnNameOfSmallLettersAndAText) {
    std::set<std::string> names;
    for (const MutantText& text : kMutantTexts) {
        const std::string name = text.name;
        EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz-"), std::string::npos) << name;
        EXPECT_TRUE(names.insert(name).second) << name;
        EXPECT_GT(std::string(text.what).size(), 10u) << name;
    }
    EXPECT_GE(std::size(kMutantTexts), 30u);
}

TEST(Mutant, NoneIsCommittedUnasked) {
    if (chosenMutant() != Mutant::kNone)
        GTEST_SKIP() << kMutantVariable << " is set";
    for (const MutantText& text : kMutantTexts) {
        EXPECT_FALSE(isMutant(text.mutant)) << text.name;
        EXPECT_EQ(mutated(text.mutant, 1, 2), 1) << text.name;
    }
}

TEST(Mutant, TheChosenOneIsCommittedAndItsUsesAreCounted) {
#if SDAG_HAS_MUTANTS
    const Mutant before = detail::chosenMutant;
    const uint64_t countBefore = mutantUseCount();
    detail::chosenMutant = Mutant::kMapBiasZero;
    EXPECT_TRUE(isMutant(Mutant::kMapBiasZero));
    EXPECT_FALSE(isMutant(Mutant::kMapBiasTenfold));
    EXPECT_EQ(mutated(Mutant::kMapBiasZero, 1, 2), 2);
    detail::chosenMutant = before;
    EXPECT_EQ(mutantUseCount(), countBefore + 2);
#else
    GTEST_SKIP() << "built without assertions";
#endif
}

} // namespace
} // namespace shadowdag
