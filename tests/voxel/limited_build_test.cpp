// SPDX-License-Identifier: Apache-2.0
#include "voxel/limited_build.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tests/voxel/failing_allocation.h"
#include "tests/voxel/soup.h"
#include "voxel/voxelize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <memory>
#include <optional>
#include <utility>

namespace shadowdag {
namespace {

using testing::HasSubstr;

struct PartScene {
    Soup soup;
    VoxelGrid grid;
    AssetProvenance provenance{"soup", "0123", "0.1", ""};
    TemporaryDirectory directory;

    explicit PartScene(uint32_t resolutionLog2 = 10) {
        std::mt19937 random(41);
        soup = randomSoup(150, 1.0f, random);
        grid = gridAround(soup.bounds(), resolutionLog2);
    }
    CountedDag build(const ScratchFolder& folder, double checkpointSeconds,
                     uint64_t memoryBytes = 0, const Progress& progress = {}) const {
        return voxelizeLimited(soup.view(), soup.all(), grid, provenance, folder,
                               {memoryBytes, checkpointSeconds}, progress);
    }
    bool hasScratch() const { return std::filesystem::exists(directory / "a.svdag.scratch"); }
};

template <class F> std::string messageOf(const F& f, ErrorKind kind) {
    try {
        f();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), kind) << error.what();
        return error.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return "";
}

TEST(LimitedBuild, IsTheDagOfABuildInMemoryWithItsNumbers) {
    for (const uint32_t log2 : {1u, 5u, 8u, 9u, 10u}) {
        const PartScene scene(log2);
        const Dag expected = voxelize(scene.soup.view(), scene.soup.all(), scene.grid);
        const DagStats stats = computeDagStats(expected);
        for (const double checkpoint : {0.0, 1e6}) {
            CountedDag built;
            {
                const ScratchFolder folder(scene.directory / "a.svdag", false);
                built = scene.build(folder, checkpoint);
                EXPECT_TRUE(scene.hasScratch());
            }
            EXPECT_FALSE(scene.hasScratch());
            EXPECT_EQ(built.dag.words, expected.words) << log2;
            EXPECT_EQ(built.dag.rootAddress, expected.rootAddress);
            EXPECT_EQ(built.dag.grid, expected.grid);
            EXPECT_EQ(built.stats.voxelCount, stats.voxelCount) << log2;
            EXPECT_EQ(built.stats.nodeCounts, stats.nodeCounts) << log2;
            EXPECT_EQ(built.stats.svoNodeCounts, stats.svoNodeCounts) << log2;
            EXPECT_EQ(built.stats.leafCount, stats.leafCount) << log2;
            EXPECT_EQ(built.stats.tracedBytes, stats.tracedBytes) << log2;
        }
    }
}

TEST(LimitedBuild, NoTriangleGivesAnEmptyDag) {
    PartScene scene;
    scene.soup.which.clear();
    const ScratchFolder folder(scene.directory / "a.svdag", false);
    EXPECT_TRUE(scene.build(folder, 0).dag.empty());
}

TEST(LimitedBuild, PartsEqualPartsBuiltInMemory) {
    const PartScene scene;
    std::vector<PartReader> parts;
    for (uint32_t k = 1; k <= 3; ++k) {
        const std::string a = scene.directory / ("a" + std::to_string(k) + ".svpart"),
                          b = scene.directory / ("b" + std::to_string(k) + ".svpart");
        const ScratchFolder folder(b, false);
        voxelizePart(scene.soup.view(), scene.soup.all(), scene.grid, scene.provenance, k, 3, a);
        voxelizePartLimited(scene.soup.view(), scene.soup.all(), scene.grid, scene.provenance, k, 3,
                            b, folder, {0, 0});
        EXPECT_TRUE(readText(a) == readText(b)) << k;
        parts.emplace_back(b);
    }
    const ScratchFolder folder(scene.directory / "a.svdag", false);
    EXPECT_EQ(mergePartsLimited(parts, folder, {}).dag.words,
              voxelize(scene.soup.view(), scene.soup.all(), scene.grid).words);
}

TEST(LimitedBuild, ContinuesAnInterruptedBuild) {
    const PartScene scene;
    const Dag expected = voxelize(scene.soup.view(), scene.soup.all(), scene.grid);
    const std::string output = scene.directory / "a.svdag";
    struct Stop {};
    for (const double stopAt : {0.2, 0.5, 0.9}) {
        try {
            const ScratchFolder folder(output, true);
            scene.build(folder, 0, 0, [&](double fraction) {
                if (fraction >= stopAt)
                    throw Stop();
            });
            ADD_FAILURE();
        } catch (const Stop&) {
        }
        EXPECT_TRUE(scene.hasScratch());
    }
    // What is done is not done again: the first number heard of the build is past the last stop.
    EXPECT_THAT(messageOf([&] { ScratchFolder(output, false); }, ErrorKind::kUsage),
                HasSubstr("a.svdag.scratch holds the files of an unfinished voxelize; continue it "
                          "with voxelize --resume, or remove the folder"));
    PartScene other;
    other.provenance.sceneHash = "4567";
    {
        EXPECT_THAT(messageOf(
                        [&] {
                            const ScratchFolder folder(output, true);
                            other.build(folder, 0);
                        },
                        ErrorKind::kUsage), // as before the work
                    HasSubstr("a.svdag.scratch holds the files of an unfinished voxelize, another "
                              "build, of soup at 1024^3: scene hash 0123 against 4567; delete the "
                              "folder, or choose another output to keep that build resumable"));
    }
    double first = 0;
    {
        const ScratchFolder folder(output, true);
        EXPECT_THAT(messageOf([&] { ScratchFolder(output, true); }, ErrorKind::kResource),
                    HasSubstr("is in use by another process"));
        const CountedDag built = scene.build(folder, 0, 0, [&](double fraction) {
            if (first == 0)
                first = fraction;
        });
        EXPECT_EQ(built.dag.words, expected.words);
    }
    EXPECT_GT(first, 0.8);
    EXPECT_FALSE(scene.hasScratch());
}

/// Stops a build, which can be resumed, once half of it is done.
void stopHalfway(const PartScene& scene, const std::string& output) {
    struct Stop {};
    EXPECT_THROW(
        {
            const ScratchFolder folder(output, true);
            scene.build(folder, 0, 0, [](double fraction) {
                if (fraction >= 0.5)
                    throw Stop();
            });
        },
        Stop);
}

// Whatever was half added then is in no part, and nothing is in two.
TEST(LimitedBuild, IsResumedAfterMemoryEndedAtAnyAllocation) {
    const PartScene scene;
    const std::string output = scene.directory / "a.svdag";
    const Dag expected = voxelize(scene.soup.view(), scene.soup.all(), scene.grid);
    const auto build = [&] {
        const ScratchFolder folder(output, true);
        return scene.build(folder, 1e-3).dag;
    };
    test::failAllocation(0);
    EXPECT_EQ(build().words, expected.words);
    const long whole = test::allocationCount();
    std::mt19937 random(std::random_device{}());
    int endedCount = 0;
    for (int i = 0; i < 20 && !HasFailure(); ++i) {
        const long failing = std::uniform_int_distribution<long>(1, whole)(random);
        SCOPED_TRACE("allocation " + std::to_string(failing) + " of " + std::to_string(whole));
        test::failAllocation(failing);
        try {
            static_cast<void>(build());
        } catch (const std::bad_alloc&) {
            ++endedCount;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource) << error.what();
            ++endedCount;
        }
        test::failAllocation(0);
        EXPECT_EQ(build().words, expected.words);
    }
    EXPECT_GT(endedCount, 8);
}

// The remedies for parts of `--part` do not stand beside it.
TEST(LimitedBuild, OfADamagedPartOneRemedyIsNamed) {
    const PartScene scene;
    const std::string output = scene.directory / "a.svdag";
    stopHalfway(scene, output);
    std::string part;
    for (const auto& entry : std::filesystem::directory_iterator(output + ".scratch"))
        if (entry.path().extension() == ".svpart")
            part = entry.path().string();
    ASSERT_NE(part, "");
    const std::string whole = readText(part);
    for (const size_t at : {size_t(0), whole.size() - 1, whole.size()}) {
        std::string damaged = whole;
        damaged.resize(at < whole.size() ? whole.size() : at - 1);
        if (at < whole.size())
            damaged[at] = char(~damaged[at]);
        writeText(part, damaged);
        const std::string message = messageOf(
            [&] {
                const ScratchFolder folder(output, true);
                scene.build(folder, 0);
            },
            ErrorKind::kInput);
        EXPECT_THAT(message, testing::EndsWith("; delete " + part +
                                               " and resume again: only its share is built anew"));
        EXPECT_THAT(message, testing::Not(HasSubstr("build it again")));
    }
    std::filesystem::remove(part);
    const ScratchFolder folder(output, true);
    EXPECT_EQ(scene.build(folder, 0).dag.words,
              voxelize(scene.soup.view(), scene.soup.all(), scene.grid).words);
}

TEST(LimitedBuild, AFolderOfAnotherBuildIsDescribedBeforeTheWork) {
    const PartScene scene;
    const std::string output = scene.directory / "a.svdag";
    stopHalfway(scene, output);
    const PartHeader same{scene.grid, scene.provenance, 1, 1, 0, 0, {}, {}};
    PartHeader otherScene = same, coarser = same, share = same;
    otherScene.provenance.sceneHash = "4567";
    coarser.grid.resolutionLog2 = 9;
    share.partCount = 2;
    for (const auto& [own, difference] : {std::pair{otherScene, "scene hash 0123 against 4567"},
                                          std::pair{coarser, "resolution 1024 against 512"},
                                          std::pair{share, "number of parts 1 against 2"}})
        for (const bool resume : {false, true})
            EXPECT_THAT(messageOf([&] { ScratchFolder(output, resume, &own); }, ErrorKind::kUsage),
                        testing::AllOf(HasSubstr("a.svdag.scratch holds the files of an unfinished "
                                                 "voxelize, another build, of soup at 1024^3: " +
                                                 std::string(difference) +
                                                 "; delete the folder, or choose another output"),
                                       testing::Not(HasSubstr("--resume"))));
    EXPECT_THAT(removeAbandonedScratch(output, coarser), HasSubstr("another build"));
    EXPECT_THAT(messageOf([&] { ScratchFolder(output, false, &same); }, ErrorKind::kUsage),
                HasSubstr("continue it with voxelize --resume"));
    const ScratchFolder folder(output, true, &same);
    EXPECT_EQ(scene.build(folder, 0).dag.words,
              voxelize(scene.soup.view(), scene.soup.all(), scene.grid).words);
}

// main.cpp advises --resume where it is so.
TEST(LimitedBuild, FinishedPartsThatStayAreRemembered) {
    const PartScene scene;
    const std::string output = scene.directory / "a.svdag";
    const PartHeader own{scene.grid, scene.provenance, 1, 1, 0, 0, {}, {}};
    {
        const ScratchFolder folder(output, false, &own);
        scene.build(folder, 0);
        EXPECT_FALSE(hasFinishedParts()); // they are removed at its end
    }
    {
        const ScratchFolder folder(output, true, &own);
        EXPECT_FALSE(hasFinishedParts());
    }
    stopHalfway(scene, output);
    EXPECT_TRUE(hasFinishedParts());
    clearFinishedParts(); // of another process
    {
        const ScratchFolder folder(output, true, &own);
        EXPECT_TRUE(hasFinishedParts()) << "before they are read";
        scene.build(folder, 0);
    }
    EXPECT_FALSE(hasFinishedParts());
    EXPECT_FALSE(scene.hasScratch());
}

TEST(LimitedBuild, WorkThatTwoPartsContainIsRefused) {
    const PartScene scene;
    const std::string output = scene.directory / "a.svdag";
    stopHalfway(scene, output);
    const std::string part = output + ".scratch/00000000.svpart",
                      again = output + ".scratch/00000777.svpart";
    std::filesystem::copy_file(part, again);
    const ScratchFolder folder(output, true);
    EXPECT_THAT(messageOf([&] { scene.build(folder, 0); }, ErrorKind::kInput),
                HasSubstr("contains work that another part contains, too; delete it"));
    std::filesystem::remove(again);
    EXPECT_EQ(scene.build(folder, 0).dag.words,
              voxelize(scene.soup.view(), scene.soup.all(), scene.grid).words);
}

TEST(LimitedBuild, WithoutResumeAnExceptionLeavesNoFiles) {
    const PartScene scene;
    struct Stop {};
    EXPECT_THROW(
        {
            const ScratchFolder folder(scene.directory / "a.svdag", false);
            scene.build(folder, 0, 0, [](double fraction) {
                if (fraction > 0.5)
                    throw Stop();
            });
        },
        Stop);
    EXPECT_FALSE(scene.hasScratch());
}

/// Allows `count` more open files than the process has until the result ends.
std::shared_ptr<rlimit> allowFiles(rlim_t count) {
    const int next = open("/dev/null", O_RDONLY | O_CLOEXEC);
    close(next);
    const auto restore = [](rlimit* before) {
        setrlimit(RLIMIT_NOFILE, before);
        delete before;
    };
    std::shared_ptr<rlimit> before(new rlimit{}, restore);
    getrlimit(RLIMIT_NOFILE, before.get());
    const rlimit few{rlim_t(next) + count, before->rlim_max};
    setrlimit(RLIMIT_NOFILE, &few);
    return before;
}

TEST(LimitedBuild, TheFolderIsRemovedWhereNoMoreFilesCanBeOpened) {
    const PartScene scene;
    std::optional<ScratchFolder> folder(std::in_place, scene.directory / "a.svdag", false);
    writeText(*folder / "map-0-2", "unfinished");
    {
        const auto limited = allowFiles(0);
        folder.reset();
    }
    EXPECT_FALSE(scene.hasScratch());
}

TEST(LimitedBuild, AFolderThatCannotBeUsedIsRemoved) {
    const PartScene scene;
    int refusedCount = 0;
    for (rlim_t count = 0; count < 4; ++count)
        for (const bool resume : {false, true}) {
            {
                const auto limited = allowFiles(count);
                try {
                    const ScratchFolder folder(scene.directory / "a.svdag", resume);
                } catch (const Error& error) {
                    EXPECT_EQ(error.kind(), ErrorKind::kResource);
                    ++refusedCount;
                }
            }
            EXPECT_FALSE(scene.hasScratch()) << count;
        }
    EXPECT_EQ(refusedCount, 4); // without a file for the lock, and for the listing
}

TEST(LimitedBuild, FilesOfAKilledMergeDoNotMatter) {
    const PartScene scene;
    const std::filesystem::path left = scene.directory / "a.svdag.scratch";
    for (const bool resume : {false, true}) {
        std::filesystem::create_directory(left);
        for (const char* name : {"lock", "level-2.nodes", "map-0-2", "00000003.svpart.tmp-12-0"})
            writeText((left / name).string(), "damaged");
        {
            const ScratchFolder folder(scene.directory / "a.svdag", resume);
            EXPECT_THAT(folder.files(""), testing::ElementsAre((left / "lock").string()));
            EXPECT_FALSE(scene.build(folder, 0).dag.empty());
        }
        EXPECT_FALSE(scene.hasScratch());
    }
}

// Which would create, or lock, a file elsewhere.
TEST(LimitedBuild, ALockThatIsALinkIsNotFollowed) {
    const PartScene scene;
    const std::filesystem::path left = scene.directory / "a.svdag.scratch";
    const std::string elsewhere = scene.directory / "elsewhere";
    std::filesystem::create_directory(left);
    std::filesystem::create_symlink(elsewhere, left / "lock");
    EXPECT_THAT(
        messageOf([&] { ScratchFolder(scene.directory / "a.svdag", false); }, ErrorKind::kResource),
        HasSubstr("cannot make the folder " + left.string() +
                  " for unfinished work: Too many levels of symbolic links; choose another place"));
    EXPECT_FALSE(std::filesystem::exists(elsewhere));
    EXPECT_TRUE(std::filesystem::is_symlink(left / "lock"));
}

TEST(LimitedBuild, ForeignFilesAreReportedAndKept) {
    const PartScene scene;
    const std::filesystem::path left = scene.directory / "a.svdag.scratch";
    for (const char* name : {"notes.txt", "level-.nodes", "map-1-2.txt", "mine.svpart",
                             "1.svpart.tmp-1", "1.svpart.tmp-x-0", "1.nodes.tmp-1-0"}) {
        std::filesystem::create_directory(left);
        writeText((left / name).string(), "mine");
        for (const bool resume : {false, true})
            EXPECT_THAT(messageOf([&] { ScratchFolder(scene.directory / "a.svdag", resume); },
                                  ErrorKind::kUsage),
                        HasSubstr(std::string("contains '") + name + "', which no build wrote"));
        EXPECT_EQ(readText((left / name).string()), "mine");
        EXPECT_FALSE(std::filesystem::exists(left / "lock"));
        std::filesystem::remove_all(left);
    }
    {
        const ScratchFolder folder(scene.directory / "a.svdag", false);
        writeText(folder / "notes.txt", "mine"); // while it builds
        scene.build(folder, 0);
    }
    EXPECT_EQ(readText((left / "notes.txt").string()), "mine");
    EXPECT_FALSE(std::filesystem::exists(left / "lock"));
}

TEST(LimitedBuild, ALimitThatIsTooLowIsReportedWithTheNeed) {
    const PartScene scene;
    const ScratchFolder folder(scene.directory / "a.svdag", false);
    EXPECT_THAT(messageOf([&] { scene.build(folder, 0, 1 << 20); }, ErrorKind::kResource),
                testing::AllOf(HasSubstr("voxelizing at 1024^3 under --memory-limit 1M needs "
                                         "more than "),
                               HasSubstr("; allow more")));
}

} // namespace
} // namespace shadowdag
