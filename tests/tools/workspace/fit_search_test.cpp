// SPDX-License-Identifier: Apache-2.0
// The search for the cheapest model on made-up tables with a known result.
#include "tools/workspace/fit_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>

namespace shadowdag {

namespace {

using Kind = FitVerdict::Kind;

/// What a made model costs and how it errs, cell by cell.
struct Made {
    double cost;
    std::vector<double> errors;
};

/// Models of one method on a grid, last axis fastest; simplicity is the order of the ranks.
FitSpace gridOf(const std::vector<int>& sizes, const std::vector<FitLaw>& laws) {
    FitSpace space;
    space.laws = {laws};
    std::vector<int> at(sizes.size(), 0);
    for (;;) {
        space.models.push_back({0, at, at, 0});
        size_t axis = sizes.size();
        while (axis > 0 && ++at[axis - 1] == sizes[axis - 1])
            at[--axis] = 0;
        if (axis == 0)
            return space;
    }
}

/// Runs a search to its end as the program does, neighbours included; returns the choice, SIZE_MAX
/// for none, and counts what was measured.
struct Searched {
    FitSearch search;
    size_t choice = SIZE_MAX;
    size_t firstCount = 0, completeCount = 0; ///< measurements of the first cell, of all

    Searched(const FitSpace& space, const FitSettings& settings, const std::vector<Made>& made)
        : search(space, settings) {
        const auto measure = [&](const FitRequest& request) {
            const Made& m = made[request.model];
            double worst = m.errors[0];
            for (const double error : m.errors)
                worst = request.inAllCells ? std::max(worst, error) : worst;
            search.record(request.model, {worst, m.errors[0], m.cost, m.cost, request.inAllCells});
            ++(request.inAllCells ? completeCount : firstCount);
        };
        for (;;) {
            for (std::vector<FitRequest> batch; !(batch = search.next()).empty();)
                for (const FitRequest& request : batch)
                    measure(request);
            std::vector<FitCandidate> candidates;
            for (const size_t model : search.finalists())
                candidates.push_back({model, made[model].cost, 0});
            size_t center = candidates.empty() ? search.leastError() : SIZE_MAX;
            if (!candidates.empty())
                center = choice = chooseLeast(space, candidates).model;
            const std::vector<FitRequest> beside = search.unmeasuredNeighbours(center);
            if (beside.empty())
                return;
            for (const FitRequest& request : beside)
                measure(request);
        }
    }
};

/// Returns the least model by looking at all of them.
size_t bruteForce(const FitSpace& space, double bound, const std::vector<Made>& made) {
    size_t best = SIZE_MAX;
    for (size_t m = 0; m < made.size(); ++m) {
        if (std::any_of(made[m].errors.begin(), made[m].errors.end(),
                        [&](double error) { return error > bound; }))
            continue;
        if (best == SIZE_MAX || made[m].cost < made[best].cost ||
            (made[m].cost == made[best].cost &&
             space.models[m].simplicity < space.models[best].simplicity))
            best = m;
    }
    return best;
}

const FitSettings kExact{0.02, 0.0, 0.0, 0.0};

} // namespace

TEST(FitSearch, ErrorThatHalvesWithEachDoublingNeedsTheFirstDepthUnderTheBound) {
    // Error 0.32 / 2^k, cost 4^k: the bound 0.02 is held from k = 4 on.
    const FitSpace space = gridOf({8}, {{true, true}});
    std::vector<Made> made;
    for (int k = 0; k < 8; ++k)
        made.push_back({std::pow(4.0, k), {0.32 / std::pow(2.0, k)}});
    const Searched searched(space, kExact, made);
    EXPECT_EQ(searched.choice, 4u);
    EXPECT_LT(searched.firstCount + searched.completeCount, 8u) << "bisection, not a sweep";
    const std::vector<FitVerdict> verdicts = searched.search.verdicts();
    EXPECT_EQ(verdicts[3].kind, Kind::kBreaks) << "the cheaper neighbour must have been measured";
    EXPECT_EQ(verdicts[4].kind, Kind::kHolds);
    EXPECT_EQ(verdicts[6].kind, Kind::kDominated);
    EXPECT_EQ(verdicts[6].by, 4u);
    EXPECT_EQ(verdicts[1].kind, Kind::kErrorOfFiner);
}

TEST(FitSearch, OneCellBeyondTheBoundExcludesAModel) {
    const FitSpace space = gridOf({3}, {{true, true}});
    const std::vector<Made> made{{1, {0.01, 0.03}}, {2, {0.01, 0.02}}, {3, {0.0, 0.0}}};
    const Searched searched(space, kExact, made);
    EXPECT_EQ(searched.choice, 1u) << "a bound is held when it is met exactly";
    EXPECT_EQ(searched.search.observation(0)->error, 0.03);
}

TEST(FitSearch, WithoutAModelThatKeepsTheBoundTheFinestWasMeasured) {
    const FitSpace space = gridOf({4, 3}, {{true, true}, {true, true}});
    std::vector<Made> made;
    for (const FitModel& m : space.models)
        made.push_back({1.0 + m.at[0] + m.at[1], {1.0 / (1 + m.at[0] + m.at[1])}});
    const Searched searched(space, kExact, made);
    EXPECT_EQ(searched.choice, SIZE_MAX);
    ASSERT_NE(searched.search.observation(11), nullptr);
    EXPECT_EQ(searched.search.observation(11)->error, 1.0 / 6);
    EXPECT_EQ(searched.firstCount, 4u) << "coarsest, finest, and the finest's neighbours";
}

TEST(FitSearch, KnownCostsRuleOutUnmeasured) {
    FitSpace space = gridOf({2}, {{true, true}});
    space.laws.push_back({{true, true}});
    for (int k = 0; k < 3; ++k)
        space.models.push_back({1, {k}, {1, k}, 4.0 + k});
    const std::vector<Made> made{{3, {0.05}}, {4, {0.01}}, {4, {0}}, {5, {0}}, {6, {0}}};
    const Searched searched(space, kExact, made);
    EXPECT_EQ(searched.choice, 1u);
    for (size_t model = 2; model < 5; ++model) {
        EXPECT_EQ(searched.search.observation(model), nullptr);
        EXPECT_EQ(searched.search.verdicts()[model].kind, Kind::kKnownCost)
            << "an equal cost cannot win where it is less simple";
    }
}

TEST(FitSearch, EqualCostsAreDecidedBySimplicity) {
    // No law orders the axis: all are measured; 1 and 2 cost the same.
    const FitSpace space = gridOf({4}, {{false, false}});
    const std::vector<Made> made{{3, {0}}, {2, {0}}, {2, {0}}, {1, {1}}};
    EXPECT_EQ(Searched(space, kExact, made).choice, 1u);
}

TEST(FitSearch, AViolatedErrorLawIsRejectedAndItsExcludedModelsAreMeasured) {
    const FitSpace space = gridOf({5}, {{true, true}});
    // The finest breaks the bound, which by the law rules out all others; but the coarsest errs
    // less than it.
    const std::vector<Made> seen{{1, {0.4}}, {2, {0.5}}, {3, {0.01}}, {4, {0.6}}, {5, {0.7}}};
    const Searched searched(space, kExact, seen);
    EXPECT_TRUE(searched.search.errorLaw(0).isGivenUp);
    EXPECT_GT(searched.search.errorLaw(0).violationCount, 0u);
    EXPECT_EQ(searched.choice, 2u);
    // Coarsest and finest obey it; the neighbour of the least error does not.
    std::vector<Made> hidden = seen;
    hidden[0].errors = {0.9};
    const Searched second(space, kExact, hidden);
    EXPECT_TRUE(second.search.errorLaw(0).isGivenUp);
    EXPECT_EQ(second.choice, 2u);
}

TEST(FitSearch, ANeighbourThatALawWronglyRuledOutIsFound) {
    // Rank 1 of the second axis: the finest errs 0.5 and the coarsest 0.9, so that nothing between
    // them seems to hold the bound; but the middle one does, beside the choice and cheaper.
    const FitSpace space = gridOf({3, 2}, {{true, true}, {false, false}});
    const std::vector<Made> made{{3, {0.9}},  {1, {0.9}}, {5, {0.01}},
                                 {2, {0.01}}, {6, {0.0}}, {4, {0.5}}};
    const Searched searched(space, kExact, made);
    EXPECT_EQ(searched.choice, 3u);
    EXPECT_TRUE(searched.search.errorLaw(0).isGivenUp);
}

TEST(FitSearch, TheChoiceEqualsThatOfMeasuringAllModels) {
    // Random tables that obey the laws: errors and costs are sums of random steps along the axes of
    // the laws, and free along the others.
    const uint64_t seed = 20260917;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
    size_t measured = 0, all = 0, held = 0;
    for (int round = 0; round < 300; ++round) {
        const std::vector<int> sizes{1 + int(random() % 5), 1 + int(random() % 3),
                                     1 + int(random() % 3), 1 + int(random() % 3)};
        // As the program's: both laws, both, cost alone, none.
        const std::vector<FitLaw> laws{{true, true}, {true, true}, {true, false}, {false, false}};
        FitSpace space = gridOf(sizes, laws);
        std::vector<std::vector<double>> costSteps(3), errorSteps(2);
        for (size_t axis = 0; axis < 3; ++axis)
            for (int k = 0; k < sizes[axis]; ++k)
                costSteps[axis].push_back(k == 0 ? 0 : uniform());
        std::vector<std::vector<double>> errors(size_t(sizes[2] * sizes[3]));
        std::vector<Made> made;
        for (const FitModel& m : space.models) {
            double cost = 1;
            for (size_t axis = 0; axis < 3; ++axis)
                for (int k = 0; k <= m.at[axis]; ++k)
                    cost += costSteps[axis][size_t(k)];
            made.push_back({cost + 0.7 * m.at[3], {}});
            for (int cell = 0; cell < 3; ++cell) {
                // Falls along axes 0 and 1; of the others any value.
                std::mt19937_64 other(seed + uint64_t(round * 100 + m.at[2] * 10 + m.at[3]));
                const double scale = std::uniform_real_distribution<double>(0.2, 1)(other);
                made.back().errors.push_back(scale * (1 + 0.1 * cell) *
                                             std::pow(0.6, m.at[0] + 0.7 * m.at[1]));
            }
        }
        const double bound = 0.05 + 0.6 * uniform();
        const Searched searched(space, {bound, 0, 0, 0}, made);
        const size_t expected = bruteForce(space, bound, made);
        ASSERT_EQ(searched.choice, expected) << "round " << round;
        for (const FitVerdict& verdict : searched.search.verdicts())
            ASSERT_NE(verdict.kind, Kind::kOpen);
        EXPECT_FALSE(searched.search.costLaw(0).isGivenUp);
        EXPECT_FALSE(searched.search.errorLaw(0).isGivenUp);
        held += expected != SIZE_MAX ? 1 : 0;
        measured += searched.firstCount + searched.completeCount;
        all += made.size() * 2;
    }
    EXPECT_GT(held, 100u);
    EXPECT_LT(held, 300u);
    EXPECT_LT(double(measured), 0.5 * double(all)) << "the search should save measurements";
}

TEST(FitSearch, WithViolatedLawsAllModelsConcernedAreMeasured) {
    // No law at all: what is chosen is the least, whatever the table.
    const uint64_t seed = 4;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
    for (int round = 0; round < 100; ++round) {
        const FitSpace space = gridOf({4, 3}, {{false, false}, {false, false}});
        std::vector<Made> made;
        for (size_t m = 0; m < space.models.size(); ++m)
            made.push_back({double(random() % 6), {uniform(), uniform()}});
        const double bound = uniform();
        ASSERT_EQ(Searched(space, {bound, 0, 0, 0}, made).choice, bruteForce(space, bound, made))
            << "round " << round;
    }
}

TEST(FitSearch, NoiseWithinTheSlackKeepsACheaperModelOpen) {
    // In the first cell 1 seems dearer than 0 by a fifth; with a slack of a quarter it is held
    // open.
    const FitSpace space = gridOf({2}, {{false, false}});
    FitSearch search(space, {0.02, 0.1, 0.25, 0.25});
    search.record(0, {0, 0, 10, 10, true});
    search.record(1, {0, 0, 13, 12, false});
    EXPECT_EQ(search.next(), (std::vector<FitRequest>{{1, true}}));
    search.record(1, {0, 0, 13, 12.6, false});
    EXPECT_TRUE(search.next().empty()) << "12.6 / 1.25 is over 10";
}

TEST(ChooseLeast, TakesTheSimplestWithinOneStandardErrorOfTheCheapest) {
    const FitSpace space = gridOf({4}, {{false, false}});
    // 0 is simplest but too dear; 1 is dearer than 3 by less than hypot(0.3, 0.4) = 0.5.
    EXPECT_EQ(
        chooseLeast(space, {{0, 11.0, 0.3}, {1, 10.45, 0.3}, {2, 10.2, 0.1}, {3, 10.0, 0.4}}).model,
        1u);
    EXPECT_EQ(chooseLeast(space, {{1, 10.51, 0.3}, {3, 10.0, 0.4}}).model, 3u);
    // Without noise equal means equal.
    EXPECT_EQ(chooseLeast(space, {{2, 5, 0}, {1, 5, 0}, {0, 5.0001, 0}}).model, 1u);
}

} // namespace shadowdag
