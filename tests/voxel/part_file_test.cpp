// SPDX-License-Identifier: Apache-2.0
#include "voxel/part_file.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tests/voxel/soup.h"
#include "voxel/voxelize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <random>

namespace shadowdag {
namespace {

using testing::HasSubstr;

constexpr uint32_t kLog2 = 10; // 64 tasks

/// A few large and many small triangles over a grid of 2^kLog2.
Soup testSoup(uint32_t seed) {
    std::mt19937 random(seed);
    Soup soup;
    const auto point = [&](float reach, const glm::vec3& centre) {
        glm::vec3 p;
        for (int a = 0; a < 3; ++a)
            p[a] = centre[a] + reach * (float(random() % 2000) / 1000 - 1);
        return p;
    };
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 centre = point(512, glm::vec3(512));
        const float reach = i % 20 == 0 ? 600.0f : 20.0f;
        soup.add(point(reach, centre), point(reach, centre), point(reach, centre));
    }
    return soup;
}

struct Build {
    Soup soup;
    VoxelGrid grid;
    AssetProvenance provenance{"soup", "0123", "0.1", ""};
    TemporaryDirectory directory;

    explicit Build(uint32_t seed = 5) : soup(testSoup(seed)) { grid.resolutionLog2 = kLog2; }

    PartReader part(uint32_t part, uint32_t count, const std::string& name = "") {
        const std::string path =
            directory / (name.empty() ? std::to_string(part) + ".svpart" : name);
        voxelizePart(soup.view(), soup.all(), grid, provenance, part, count, path);
        return PartReader(path);
    }
    std::vector<PartReader> parts(uint32_t count) {
        std::vector<PartReader> all;
        for (uint32_t k = 1; k <= count; ++k)
            all.push_back(part(k, count));
        return all;
    }
};

std::string refusal(const std::vector<PartReader>& parts, const std::string& version = "0.1") {
    try {
        checkParts(parts, version, {});
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    return "";
}

TEST(PartFile, AnyNumberOfPartsGivesTheDagOfOneBuild) {
    Build build;
    const Dag whole = voxelize(build.soup.view(), build.soup.all(), build.grid);
    const DagStats stats = computeDagStats(whole);
    for (const uint32_t count : {1u, 2u, 3u, 7u, 64u, 100u}) {
        std::vector<PartReader> parts = build.parts(count);
        std::shuffle(parts.begin(), parts.end(), std::mt19937(count));
        EXPECT_EQ(refusal(parts), "") << count;
        const Dag merged = mergeParts(parts);
        EXPECT_EQ(merged.words, whole.words) << count;
        EXPECT_EQ(merged.rootAddress, whole.rootAddress);
        EXPECT_EQ(merged.grid, whole.grid);
        OctreeCounts counts;
        for (const PartReader& part : parts)
            counts += part.header().counts;
        EXPECT_EQ(counts.voxelCount, stats.voxelCount) << count;
        // Statistics name levels from the root down.
        for (uint32_t level = 1; level <= taskLevelOf(build.grid); ++level)
            EXPECT_EQ(counts.cellCount[level], stats.svoNodeCounts[kLog2 - level]) << level;
    }
}

/// Lets no file of the process grow beyond a size, as a full disk would, until it is destroyed.
class FileSizeLimit {
public:
    explicit FileSizeLimit(uint64_t bytes) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        struct rlimit limit = before_;
        limit.rlim_cur = bytes;
        std::signal(SIGXFSZ, SIG_IGN); // a write then fails with EFBIG
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

private:
    struct rlimit before_ {};
};

// As a build does whose disk was full: another thread writes what the first could not.
TEST(PartFile, AFailedWriteCanBeRepeated) {
    Build build;
    VoxelTasks tasks(build.soup.view(), build.soup.all(), build.grid, {});
    DagBuilder merged(tasks.level());
    std::vector<Subtree> subtrees;
    for (size_t i = 0; i < tasks.count(); ++i) {
        DagBuilder builder(tasks.level());
        const uint32_t address = tasks.build(i, builder, nullptr, [] {});
        subtrees.push_back({tasks.cell(i), merged.addSubtree(builder, tasks.level(), address)});
    }
    const PartHeader header{build.grid, build.provenance, 1, 1, tasks.count(), 0, {}, {}};
    const std::vector<Subtree> before = subtrees;
    writePart(header, merged, subtrees, build.directory / "whole.svpart");
    const std::string whole = readText(build.directory / "whole.svpart");
    for (const size_t bytes : {size_t(0), size_t(100), whole.size() / 2, whole.size() - 1}) {
        subtrees = before;
        {
            const FileSizeLimit limit(bytes);
            EXPECT_THROW(writePart(header, merged, subtrees, build.directory / "part.svpart"),
                         Error)
                << bytes;
        }
        EXPECT_FALSE(std::filesystem::exists(build.directory / "part.svpart")) << bytes;
        writePart(header, merged, subtrees, build.directory / "part.svpart");
        EXPECT_EQ(readText(build.directory / "part.svpart"), whole) << bytes;
        std::filesystem::remove(build.directory / "part.svpart");
    }
}

TEST(PartFile, APipeIsRefusedAtOnce) {
    const TemporaryDirectory directory;
    const std::string pipe = directory / "p.svpart";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    try {
        PartReader part(pipe);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_THAT(error.what(), HasSubstr("p.svpart: is a pipe, where a regular file is read"));
    }
}

TEST(PartFile, IsTheSameForAnyRun) {
    Build build;
    build.part(2, 3, "a.svpart");
    build.part(2, 3, "b.svpart");
    EXPECT_EQ(readText(build.directory / "a.svpart"), readText(build.directory / "b.svpart"));
}

TEST(PartFile, SharesAreAboutEvenAndCoverAllTasks) {
    Build build;
    const VoxelTasks tasks(build.soup.view(), build.soup.all(), build.grid, {});
    double all = 0, largest = 0;
    for (size_t i = 0; i < tasks.count(); ++i) {
        all += tasks.work(i);
        largest = std::max(largest, tasks.work(i));
    }
    for (const uint32_t count : {1u, 2u, 5u, 200u}) {
        size_t next = 0;
        for (uint32_t k = 1; k <= count; ++k) {
            const auto [first, last] = tasks.share(k, count);
            EXPECT_EQ(first, next);
            EXPECT_LE(first, last);
            next = last;
            double work = 0;
            for (size_t i = first; i < last; ++i)
                work += tasks.work(i);
            EXPECT_LE(work, all / count + largest) << k << " of " << count;
        }
        EXPECT_EQ(next, tasks.count());
    }
}

TEST(PartFile, MissingRepeatedAndForeignPartsAreNamed) {
    Build build, other(6), finer;
    other.provenance.sceneHash = "4567";
    finer.grid.resolutionLog2 = kLog2 + 1;
    std::vector<PartReader> parts = build.parts(4);
    EXPECT_THAT(refusal(parts, "0.2"), HasSubstr("was built by version 0.1, this is 0.2"));
    parts.pop_back();
    EXPECT_THAT(refusal(parts), HasSubstr("number 4 is missing"));
    parts.push_back(build.part(2, 4, "again.svpart"));
    EXPECT_THAT(refusal(parts), HasSubstr("again.svpart: is part 2 of 4, as "));
    parts.pop_back();
    parts.push_back(other.part(4, 4));
    EXPECT_THAT(refusal(parts), HasSubstr("4.svpart: belongs to another build than "));
    EXPECT_THAT(refusal(parts), HasSubstr("scene hash 4567 against 0123"));
    parts.pop_back();
    parts.push_back(finer.part(4, 4));
    EXPECT_THAT(refusal(parts), HasSubstr("resolution 2048 against 1024"));
    parts.pop_back();
    parts.push_back(build.part(4, 5, "five.svpart"));
    EXPECT_THAT(refusal(parts), HasSubstr("number of parts 5 against 4"));
}

TEST(PartFile, EveryTruncationAndBitFlipIsRefused) {
    Build build;
    const std::string path = build.directory / "1.svpart", bad = build.directory / "bad.svpart";
    build.part(1, 40);
    const std::string good = readText(path);
    const auto isRefused = [&](const std::string& bytes) {
        writeText(bad, bytes);
        try {
            const PartReader reader(bad);
            reader.verify({});
            reader.subtrees();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(), HasSubstr("bad.svpart"));
            return true;
        }
        return false;
    };
    ASSERT_FALSE(isRefused(good));
    std::mt19937 random(77);
    for (size_t length = 0; length < good.size(); length += 1 + good.size() / 200)
        EXPECT_TRUE(isRefused(good.substr(0, length))) << length;
    EXPECT_TRUE(isRefused(good + "x"));
    for (int i = 0; i < 1000; ++i) {
        std::string flipped = good;
        // Half of them in the header.
        const size_t at = random() % (i % 2 ? good.size() : 700);
        flipped[at] = char(flipped[at] ^ (1 << random() % 8));
        EXPECT_TRUE(isRefused(flipped)) << at;
    }
}

TEST(PartFile, MorePartsThanThereCanBeAreRefusedByFileAndNumber) {
    Build build;
    build.part(1, 1);
    std::string bytes = readText(build.directory / "1.svpart");
    const auto word = [&](size_t at) { return reinterpret_cast<uint32_t*>(bytes.data() + at); };
    constexpr size_t kHeaderBytesAt = 12, kPartCountAt = 56;
    ASSERT_EQ(*word(kPartCountAt), 1u);
    const std::string path = build.directory / "many.svpart";
    for (const uint32_t count : {kMaxPartCount + 1, ~0u}) {
        *word(kPartCountAt) = count;
        const size_t hashed = *word(kHeaderBytesAt) - 16;
        const auto hash = contentHash(reinterpret_cast<const uint8_t*>(bytes.data()), hashed);
        std::copy(hash.begin(), hash.end(), bytes.begin() + std::ptrdiff_t(hashed));
        writeText(path, bytes);
        try {
            checkParts({PartReader(path)}, "0.1", {});
            ADD_FAILURE() << "nothing was thrown";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("many.svpart"),
                                                     HasSubstr("one of " + std::to_string(count) +
                                                               " parts, there are at most 65536")));
        }
    }
}

} // namespace
} // namespace shadowdag
