// SPDX-License-Identifier: Apache-2.0
#include "voxel/limited_build.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "voxel/level_merge.h"

#include <algorithm>
#include <bitset>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <new>
#include <set>
#include <system_error>

namespace shadowdag {
namespace {

using Clock = std::chrono::steady_clock;

/// The share of the progress bar for building. Merging has the rest and does not report progress.
constexpr double kBuildShare = 0.95;

std::string doingAt(const std::string& doing, const VoxelGrid& grid) {
    return doing + " at " + std::to_string(grid.resolution()) + "^3";
}

/// Thrown internally when a task exceeds its share of memory; the task is then built again alone.
struct TaskTooLarge {};

/// Builds the tasks of a part into part files of the scratch folder.
class SpillingBuild {
public:
    SpillingBuild(VoxelTasks& tasks, const PartHeader& header, const ScratchFolder& folder,
                  const BuildLimits& limits, const MemoryLimit& limit, const Progress& progress)
        : tasks_(tasks), header_(header), folder_(folder), limits_(limits), limit_(limit),
          progress_(progress), merged_(tasks.level()) {}

    /// Returns the part files, earlier and new ones.
    std::vector<PartReader> run(size_t first, size_t last) {
        const std::set<uint64_t> done = findDone();
        std::vector<size_t> open;
        for (size_t i = first; i < last; ++i) {
            workAll_ += tasks_.work(i);
            if (done.contains(tasks_.cell(i))) {
                workDone_ += tasks_.work(i);
                tasks_.release(i);
            } else {
                open.push_back(i);
            }
        }
        // Of the memory left for building, the subtrees waiting to be written get a third, writing
        // them another third, and the threads share the last.
        available_ = limit_.available();
        taskShare_ = available_ / 3 / uint64_t(std::max(1, threadCount()));
        cpuParallelRanges(open.size(), 1, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i)
                buildTask(open[i], taskShare_, true);
        });
        std::sort(tooLarge_.begin(), tooLarge_.end());
        for (const size_t task : tooLarge_) {
            spill();
            buildTask(task, limit_.available() / 2, false);
        }
        spill();
        // An empty part still has a file: LevelMerge needs one.
        if (parts_.empty())
            writeSpill();
        merged_ = DagBuilder(tasks_.level());
        return std::move(parts_);
    }

private:
    /// Reads what is in the folder; returns the cells that are done.
    std::set<uint64_t> findDone() {
        std::set<uint64_t> done;
        for (const std::string& path : folder_.files(".svpart")) {
            PartReader part = openPart(path);
            folder_.refuseOtherBuild(part.header(), header_);
            for (const Subtree& subtree : part.subtrees())
                if (!done.insert(subtree.cell).second)
                    throw Error(ErrorKind::kInput,
                                path + " contains work that another part contains, too; delete it "
                                       "and resume again");
            spillCount_ = std::max(spillCount_, numberOf(path) + 1);
            parts_.push_back(std::move(part));
            folder_.noteFinishedPart();
        }
        return done;
    }

    /// Returns a finished part after reading all of it; of a damaged one the message says how to go
    /// on.
    PartReader openPart(const std::string& path) const {
        try {
            PartReader part(path);
            part.verify(progress_);
            return part;
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kInput)
                throw;
            const std::string text = error.what(); // it ends with a remedy for parts of --part
            throw Error(error.kind(), text.substr(0, text.rfind("; ")) + "; delete " + path +
                                          " and resume again: only its share is built anew");
        }
    }

    static uint32_t numberOf(const std::string& path) {
        const std::string name = path.substr(path.find_last_of('/') + 1);
        return uint32_t(std::strtoul(name.c_str(), nullptr, 10));
    }

    void buildTask(size_t task, uint64_t shareBytes, bool isRetried) {
        DagBuilder builder(tasks_.level());
        OctreeCounts counts;
        uint32_t address = kNoNode;
        uint64_t neededBytes = 0;
        try {
            address = tasks_.build(task, builder, &counts, [&] {
                neededBytes = builder.byteCount();
                if (limit_.isSet() && neededBytes > shareBytes)
                    throw TaskTooLarge();
                const std::lock_guard<std::mutex> lock(mutex_);
                report();
            });
        } catch (const TaskTooLarge&) {
            if (!isRetried)
                limit_.fail(2 * (neededBytes - shareBytes), false);
            const std::lock_guard<std::mutex> lock(mutex_);
            tooLarge_.push_back(task);
            return;
        }
        const std::lock_guard<std::mutex> lock(mutex_);
        if (isHalfAdded_)
            return; // another thread has failed and ends the build
        if (limit_.isSet() && merged_.byteCount() + builder.byteCount() > available_ / 3)
            spill();
        isHalfAdded_ = true; // if memory ends here, merged_ has nodes of no subtree, and is no part
        subtrees_.push_back(
            {tasks_.cell(task), merged_.addSubtree(builder, tasks_.level(), address)});
        counts_ += counts;
        isHalfAdded_ = false;
        workDone_ += tasks_.work(task);
        tasks_.release(task);
        const double seconds = std::chrono::duration<double>(Clock::now() - spilled_).count();
        if (seconds >= limits_.checkpointSeconds)
            spill();
        report();
    }

    void report() const {
        if (progress_)
            progress_(kBuildShare * std::min(1.0, workDone_ / workAll_));
    }

    void spill() {
        if (!subtrees_.empty())
            writeSpill();
    }

    void writeSpill() {
        std::sort(subtrees_.begin(), subtrees_.end(),
                  [](const Subtree& a, const Subtree& b) { return a.cell < b.cell; });
        PartHeader header = header_;
        header.counts = counts_;
        const std::string path = folder_.partPath(spillCount_++);
        DagBuilder empty(tasks_.level()); // not later: nothing may fail between part and clear()
        writePart(header, merged_, subtrees_, path);
        try {
            parts_.emplace_back(path);
        } catch (...) { // the subtrees are still here, and may be written again
            std::error_code ignored;
            std::filesystem::remove(path, ignored);
            throw;
        }
        folder_.noteFinishedPart();
        merged_ = std::move(empty); // frees what it held
        subtrees_.clear();
        counts_ = {};
        spilled_ = Clock::now();
    }

    VoxelTasks& tasks_;
    const PartHeader& header_;
    const ScratchFolder& folder_;
    const BuildLimits& limits_;
    const MemoryLimit& limit_;
    const Progress& progress_;
    double workAll_ = 0, workDone_ = 0;
    uint64_t available_ = 0, taskShare_ = 0;
    uint32_t spillCount_ = 0;
    std::vector<PartReader> parts_;
    std::mutex mutex_; // guards what follows
    DagBuilder merged_;
    std::vector<Subtree> subtrees_;
    std::vector<size_t> tooLarge_;
    OctreeCounts counts_;
    bool isHalfAdded_ = false; ///< a subtree is in merged_ and not in subtrees_
    Clock::time_point spilled_ = Clock::now();
};

/// Writes nodes as the words of a Dag. The address of a child is known once the level below is
/// complete: until then its number is stored instead.
class DagSink : public NodeSink {
public:
    DagSink(Dag& dag, uint64_t wordCount) : words_(dag.words) { words_.reserve(wordCount); }

    void inner(uint32_t level, uint32_t mask, const uint32_t* children) override {
        begin(level);
        addresses_.push_back(uint32_t(words_.size()));
        words_.push_back(mask);
        words_.insert(words_.end(), children, children + bitCount32(mask));
    }
    void leaf(uint64_t voxels) override {
        begin(kLeafLog2);
        addresses_.push_back(uint32_t(words_.size()));
        words_.push_back(uint32_t(voxels));
        words_.push_back(uint32_t(voxels >> 32));
        for (int octant = 0; octant < 8; ++octant)
            octants_.set(voxels >> (8 * octant) & 0xff);
    }
    /// Call once, last. Returns how many different 2^3 cells there are.
    uint64_t finish() {
        begin(0);
        octants_.reset(0);
        return octants_.count();
    }

private:
    void begin(uint32_t level) {
        if (level == level_)
            return;
        // The level above the one that is complete now.
        for (size_t a = aboveBegin_; a < levelBegin_;) {
            const uint32_t count = bitCount32(words_[a]);
            for (uint32_t i = 1; i <= count; ++i)
                words_[a + i] = addresses_[words_[a + i]];
            a += 1 + count;
        }
        aboveBegin_ = levelBegin_;
        levelBegin_ = words_.size();
        std::vector<uint32_t>().swap(addresses_);
        level_ = level;
    }

    std::vector<uint32_t>& words_;
    std::vector<uint32_t> addresses_; // of the nodes of the level being written
    uint32_t level_ = kNoNode;
    size_t aboveBegin_ = 0, levelBegin_ = 0;
    std::bitset<256> octants_;
};

CountedDag joinToDag(const std::vector<PartReader>& parts, const ScratchFolder& folder,
                     AssetPacking packing, const MemoryLimit& limit,
                     const std::function<void()>& check) {
    const VoxelGrid& grid = parts.front().header().grid;
    const uint32_t rootLevel = rootLevelOf(grid);
    OctreeCounts octree;
    for (const PartReader& part : parts)
        octree += part.header().counts;
    LevelMerge merge(parts, folder, limit, check);
    const uint32_t root = merge.joinAbove(octree);

    CountedDag result;
    result.dag.grid = grid;
    DagStats& stats = result.stats;
    stats.nodeCounts.assign(rootLevel, 0);
    stats.svoNodeCounts.assign(rootLevel, 0);
    if (root == kNoNode)
        return result;
    uint64_t wordCount = 0, largestLevelWords = 0, mostNodes = 0;
    for (uint32_t level = kLeafLog2; level <= rootLevel; ++level) {
        const LevelCounts& counts = merge.counts(level);
        const uint64_t words =
            level == kLeafLog2 ? 2 * counts.nodeCount : counts.nodeCount + counts.pointerCount;
        wordCount += words;
        largestLevelWords = std::max(largestLevelWords, words);
        mostNodes = std::max(mostNodes, counts.nodeCount);
    }
    if (wordCount >= kNoNode)
        throwTooManyWords();
    // The words; then the larger of what numbering and what writeAsset() needs.
    limit.requireLast(
        4 * wordCount +
        std::max(12 * mostNodes + (4 << 20), writingBytes(packing, wordCount, largestLevelWords)));
    DagSink sink(result.dag, wordCount);
    merge.visit(rootLevel, {root}, sink);
    result.dag.rootAddress = 0;
    stats.nodeCounts[rootLevel - 1] = sink.finish();
    SDAG_ASSERT(result.dag.words.size() == wordCount);
    stats.voxelCount = octree.voxelCount;
    stats.leafCount = merge.counts(kLeafLog2).nodeCount;
    stats.tracedBytes = 4 * wordCount;
    for (uint32_t level = 1; level <= rootLevel; ++level) {
        stats.svoNodeCounts[rootLevel - level] = octree.cellCount[level];
        if (level >= kLeafLog2)
            stats.nodeCounts[rootLevel - level] = merge.counts(level).nodeCount;
    }
    return result;
}

std::function<void()> checkOf(const Progress& progress, double fraction) {
    return [&progress, fraction] {
        if (progress)
            progress(fraction);
    };
}

} // namespace

CountedDag voxelizeLimited(const TriangleView& triangles, View<const uint32_t> which,
                           const VoxelGrid& grid, const AssetProvenance& provenance,
                           const ScratchFolder& folder, const BuildLimits& limits,
                           const Progress& progress) {
    try {
        const MemoryLimit limit = limits.memoryBytes
                                      ? MemoryLimit(limits.memoryBytes, doingAt("voxelizing", grid))
                                      : MemoryLimit();
        std::vector<PartReader> parts;
        {
            VoxelTasks tasks(triangles, which, grid, progress);
            const PartHeader header{grid, provenance, 1, 1, tasks.count(), 0, {}, {}};
            parts =
                SpillingBuild(tasks, header, folder, limits, limit, progress).run(0, tasks.count());
        }
        CountedDag result =
            joinToDag(parts, folder, limits.packing, limit, checkOf(progress, kBuildShare));
        if (progress)
            progress(1);
        return result;
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("voxelizing", grid);
    }
}

PartHeader voxelizePartLimited(const TriangleView& triangles, View<const uint32_t> which,
                               const VoxelGrid& grid, const AssetProvenance& provenance,
                               uint32_t part, uint32_t partCount, const std::string& path,
                               const ScratchFolder& folder, const BuildLimits& limits,
                               const Progress& progress) {
    try {
        const MemoryLimit limit = limits.memoryBytes
                                      ? MemoryLimit(limits.memoryBytes, doingAt("voxelizing", grid))
                                      : MemoryLimit();
        PartHeader header{grid, provenance, part, partCount, 0, 0, {}, {}};
        std::vector<PartReader> parts;
        {
            VoxelTasks tasks(triangles, which, grid, progress);
            const auto [first, last] = tasks.share(part, partCount);
            header.taskCount = tasks.count();
            parts = SpillingBuild(tasks, header, folder, limits, limit, progress).run(first, last);
        }
        LevelMerge merge(parts, folder, limit, checkOf(progress, kBuildShare));
        const uint32_t taskLevel = taskLevelOf(grid);
        for (const PartReader& p : parts)
            header.counts += p.header().counts;
        for (uint32_t level = kLeafLog2; level <= taskLevel; ++level)
            header.levels[level] = merge.counts(level);
        std::vector<Subtree> subtrees = merge.subtrees();
        header.subtreeCount = subtrees.size();
        PartWriter writer(header, path);
        visitSubtrees(merge, taskLevel, subtrees, writer);
        writer.finish(subtrees);
        if (progress)
            progress(1);
        return header;
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("voxelizing", grid);
    }
}

CountedDag mergePartsLimited(const std::vector<PartReader>& parts, const ScratchFolder& folder,
                             const BuildLimits& limits, const Progress& progress) {
    const VoxelGrid& grid = parts.front().header().grid;
    try {
        const MemoryLimit limit = limits.memoryBytes
                                      ? MemoryLimit(limits.memoryBytes, doingAt("merging", grid))
                                      : MemoryLimit();
        return joinToDag(parts, folder, limits.packing, limit, checkOf(progress, 0));
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("merging", grid);
    }
}

} // namespace shadowdag
