// SPDX-License-Identifier: Apache-2.0
// Bottom-up agglomeration of triangles into batches: in each round every cluster finds the
// neighbour, along the Morton curve, with which its union box has the shortest diagonal, and pairs
// that choose each other merge. Source of the rounds: Meister and Bittner, Parallel Locally-Ordered
// Clustering for BVH Construction, TVCG 2018; of the dissimilarity: Olsson et al. 2015, sec. VI-B1.
// Deviations: their tree merges the best pair of all (Walter et al., Fast Agglomerative Clustering
// for Rendering, RT 2008), ours the pairs that are best for both ends; and by default clusters that
// together would exceed a batch never merge, which gives fuller batches than a cut through a
// finished tree (BatchCut, BATCHES.md).
#include "scenes/batches.h"

#include "cuda/parallel_for.h"
#include "cuda/scan_sort.h"
#include "scenes/morton.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace shadowdag {
namespace {

/// How many clusters to either side along the curve are candidates.
constexpr uint32_t kSearchRadius = 8;

/// A triangle, or a merge of two nodes.
struct TreeNode {
    uint32_t index : 31;
    uint32_t isLeaf : 1;
};

struct Cluster {
    Box box;
    uint32_t count; ///< triangles
    uint32_t instance;
    TreeNode node;
};

struct Merge {
    TreeNode child[2];
    uint32_t count; ///< triangles
};

float diagonalSquared(const Box& a, const Box& b) {
    const glm::vec3 e = glm::max(a.max, b.max) - glm::min(a.min, b.min);
    return glm::dot(e, e);
}

bool canMerge(const Cluster& a, const Cluster& b, uint64_t maxTriangleCount) {
    return a.instance == b.instance && uint64_t(a.count) + b.count <= maxTriangleCount;
}

/// Writes to partner[i] the admissible neighbour with the shortest union diagonal; i itself for
/// none. Ties go to the smaller index, so that some pair always agrees and every round makes
/// progress.
void findPartners(const std::vector<Cluster>& clusters, uint64_t maxTriangleCount,
                  std::vector<uint32_t>& partner) {
    const size_t count = clusters.size();
    partner.resize(count);
    cpuParallelRanges(count, 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const Cluster& a = clusters[i];
            const size_t from = i > kSearchRadius ? i - kSearchRadius : 0;
            const size_t to = std::min(count, i + kSearchRadius + 1);
            float best = std::numeric_limits<float>::infinity();
            size_t bestPair = 0;
            uint32_t found = uint32_t(i);
            for (size_t j = from; j < to; ++j) {
                const Cluster& b = clusters[j];
                if (j == i || !canMerge(a, b, maxTriangleCount))
                    continue;
                // Equal lengths are ordered by the pair, the same from both ends; otherwise a ring
                // of equal neighbours (a regular grid) would choose in a circle.
                const float d = diagonalSquared(a.box, b.box);
                const size_t pair = std::min(i, j) * 2 * kSearchRadius + (i < j ? j - i : i - j);
                if (d < best || (d == best && (found == i || pair < bestPair))) {
                    best = d;
                    bestPair = pair;
                    found = uint32_t(j);
                }
            }
            partner[i] = found;
        }
    });
}

/// Of clusters that would merge, a smaller share than one in so many that do is a chain.
constexpr size_t kChainShare = 64;
/// So few clusters may merge one by one.
constexpr size_t kChainLength = 256;

/// Pairs clusters of a chain: where each of many prefers the one before it, as in a pile of equal
/// boxes, only the first two choose each other, and rounds times clusters would be quadratic. Those
/// that were not chosen then take, in order, the admissible one after them with the shortest union
/// diagonal. At least one in 2 * kSearchRadius + 1 of the clusters that would merge does so.
/// Nothing else changes in rounds without a chain.
void breakChains(const std::vector<Cluster>& clusters, uint64_t maxTriangleCount,
                 std::vector<uint32_t>& partner) {
    const size_t count = clusters.size();
    size_t wouldCount = 0, doCount = 0;
    for (size_t i = 0; i < count; ++i) {
        wouldCount += partner[i] != i;
        doCount += partner[i] != i && partner[partner[i]] == i;
    }
    if (wouldCount <= kChainLength || doCount >= wouldCount / kChainShare)
        return;
    std::vector<uint8_t> isFree(count);
    for (size_t i = 0; i < count; ++i)
        isFree[i] = partner[partner[i]] != i;
    for (size_t i = 0; i < count; ++i) {
        if (!isFree[i])
            continue;
        float best = std::numeric_limits<float>::infinity();
        size_t found = i;
        for (size_t j = i + 1; j < std::min(count, i + kSearchRadius + 1); ++j)
            if (isFree[j] && canMerge(clusters[i], clusters[j], maxTriangleCount)) {
                const float d = diagonalSquared(clusters[i].box, clusters[j].box);
                if (d < best) {
                    best = d;
                    found = j;
                }
            }
        partner[i] = uint32_t(found);
        partner[found] = uint32_t(i);
        isFree[i] = isFree[found] = 0;
    }
}

std::vector<uint8_t> movingInstances(const World& world) {
    std::vector<uint8_t> isMoving;
    for (const Instance& instance : world.instances())
        isMoving.push_back(instance.isMoving);
    return isMoving;
}

/// Calls visit(node, its triangle count) depth first, first child first; it returns whether to
/// descend below an inner node.
template <class Visit>
void forNodes(const std::vector<Merge>& merges, TreeNode root, const Visit& visit) {
    std::vector<TreeNode> stack{root};
    while (!stack.empty()) {
        const TreeNode node = stack.back();
        stack.pop_back();
        if (!visit(node, node.isLeaf ? 1u : merges[node.index].count) || node.isLeaf)
            continue;
        stack.push_back(merges[node.index].child[1]);
        stack.push_back(merges[node.index].child[0]);
    }
}

} // namespace

BatchSet::BatchSet(const World& world, const BatchOptions& options)
    : BatchSet(world.triangles(), world.triangleInstance(), options, movingInstances(world)) {}

BatchSet::BatchSet(const TriangleView& geometry, const std::vector<uint32_t>& triangleInstance,
                   const BatchOptions& options, const std::vector<uint8_t>& isInstanceMoving)
    : maxTriangleCount_(options.maxTriangleCount) {
    if (maxTriangleCount_ < 1 || maxTriangleCount_ > kMaxBatchTriangleCount)
        throw Error(ErrorKind::kUsage, "batches of " + std::to_string(maxTriangleCount_) +
                                           " triangles: choose 1 to " +
                                           std::to_string(kMaxBatchTriangleCount));
    const size_t count = geometry.count();
    SDAG_ASSERT(triangleInstance.size() == count);
    static_assert(UINT32_MAX / 3 < 1u << 31, "TreeNode::index"); // vertices have 32 bits
    if (count > UINT32_MAX / 3)
        throw Error(ErrorKind::kResource,
                    std::to_string(count) + " triangles are more than batches can index; use fewer "
                                            "instances");
    std::vector<Box> triangleBoxes(count);
    cpuParallelRanges(count, 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            for (int corner = 0; corner < 3; ++corner)
                triangleBoxes[i].add(geometry.vertex(i, corner));
    });
    Box bounds;
    for (const Box& box : triangleBoxes)
        bounds.add(box);

    // By instance, then along the Morton curve, then by index: two stable sorts.
    std::vector<uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::vector<uint64_t> codes(count);
    cpuParallelRanges(count, 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            codes[i] = mortonCode(triangleBoxes[i].center(), bounds);
    });
    sortPairs(Backend::kCpu, viewOf(codes), viewOf(order));
    std::vector<uint32_t> instances(count);
    for (size_t i = 0; i < count; ++i)
        instances[i] = triangleInstance[order[i]];
    sortPairs(Backend::kCpu, viewOf(instances), viewOf(order));

    std::vector<Cluster> clusters(count), next;
    for (size_t i = 0; i < count; ++i)
        clusters[i] = {triangleBoxes[order[i]], 1, instances[i], {order[i], 1}};
    std::vector<Merge> merges;
    merges.reserve(count);
    std::vector<uint32_t> partner;
    const uint64_t mergeLimit =
        options.cut == BatchCut::kSubtree ? ~0ull : uint64_t(maxTriangleCount_);
    for (bool merged = true; merged;) {
        merged = false;
        findPartners(clusters, mergeLimit, partner);
        breakChains(clusters, mergeLimit, partner);
        next.clear();
        for (size_t i = 0; i < clusters.size(); ++i) {
            const size_t j = partner[i];
            if (j == i || partner[j] != i) {
                next.push_back(clusters[i]);
            } else if (i < j) {
                Cluster both = clusters[i];
                both.box.add(clusters[j].box);
                both.count += clusters[j].count;
                both.node = {uint32_t(merges.size()), 0};
                merges.push_back({{clusters[i].node, clusters[j].node}, both.count});
                next.push_back(both);
                merged = true;
            }
        }
        clusters.swap(next);
    }

    triangles_.reserve(count);
    const auto addBatch = [&](TreeNode batch, uint32_t triangleCount, uint32_t instance) {
        batches_.push_back({uint32_t(triangles_.size()), triangleCount, instance});
        boxes_.emplace_back();
        forNodes(merges, batch, [&](TreeNode node, uint32_t) {
            if (node.isLeaf) {
                triangles_.push_back(node.index);
                boxes_.back().add(triangleBoxes[node.index]);
            }
            return true;
        });
    };
    for (const Cluster& root : clusters)
        forNodes(merges, root.node, [&](TreeNode node, uint32_t triangleCount) {
            const bool fits = triangleCount <= maxTriangleCount_;
            if (fits)
                addBatch(node, triangleCount, root.instance);
            return !fits;
        });
    gatherVertices(geometry);
    isUpdateCancelled_.assign(batches_.size(), 0);
    std::vector<uint8_t> isMover(batches_.size(), 0);
    if (!isInstanceMoving.empty())
        for (size_t b = 0; b < batches_.size(); ++b)
            isMover[b] = isInstanceMoving[batches_[b].instance] != 0;
    bvh_.build(viewOf(boxes_), std::move(isMover));
}

void BatchSet::update(const World& world, const std::vector<uint32_t>& movedInstances,
                      StageTimes* stages) {
    update(world.triangles(), movedInstances, stages);
}

void BatchSet::update(const TriangleView& geometry, const std::vector<uint32_t>& movedInstances,
                      StageTimes* stages) {
    StageTimes ignored;
    StageTimes& times = stages ? *stages : ignored;
    {
        const StageTimer timer(Backend::kCpu, times, "batch boxes");
        updateBoxes(geometry, movedInstances);
    }
    const StageTimer timer(Backend::kCpu, times, "batch hierarchy");
    if (!movedBatches_.empty())
        updateCounts_.hierarchy = bvh_.update(viewOf(boxes_), movedBatches_);
}

/// Finds the batches that moved, and their boxes.
void BatchSet::updateBoxes(const TriangleView& geometry,
                           const std::vector<uint32_t>& movedInstances) {
    movedBatches_.clear();
    movedBoxesBefore_.clear();
    updateCounts_ = {};
    std::vector<uint32_t> compared;
    for (const uint32_t instance : movedInstances) {
        // Batches ascend by instance.
        const auto first =
            std::lower_bound(batches_.begin(), batches_.end(), instance,
                             [](const Batch& b, uint32_t value) { return b.instance < value; });
        for (auto batch = first; batch != batches_.end() && batch->instance == instance; ++batch)
            compared.push_back(uint32_t(batch - batches_.begin()));
    }
    std::sort(compared.begin(), compared.end());
    compared.erase(std::unique(compared.begin(), compared.end()), compared.end());
    updateCounts_.comparedBatchCount = uint32_t(compared.size());
    std::vector<Box> boxes(compared.size());
    std::vector<uint8_t> isMoved(compared.size());
    try {
        parallelFor<CpuTag>(
            compared.size(),
            [&](size_t i) {
                isMoved[i] = keepPositions(geometry, compared[i], boxes[i]) ||
                             isUpdateCancelled_[compared[i]];
            },
            16);
    } catch (...) { // cancelled: the next update finds all of them moved
        for (const uint32_t batch : compared)
            isUpdateCancelled_[batch] = 1;
        throw;
    }
    for (size_t i = 0; i < compared.size(); ++i) {
        isUpdateCancelled_[compared[i]] = 0;
        if (!isMoved[i])
            continue;
        movedBatches_.push_back(compared[i]);
        movedBoxesBefore_.push_back(boxes_[compared[i]]);
        boxes_[compared[i]] = boxes[i];
    }
    updateCounts_.boxCount = uint32_t(movedBatches_.size());
}

MovedBatchRanges BatchSet::movedRanges() const {
    MovedBatchRanges ranges;
    if (movedBatches_.empty())
        return ranges;
    for (const uint32_t batch : movedBatches_)
        if (!ranges.boxes.empty() && ranges.boxes.back().first + ranges.boxes.back().count == batch)
            ++ranges.boxes.back().count;
        else
            ranges.boxes.push_back({batch, 1});
    if (updateCounts_.hierarchy.isBuilt) {
        const WideBvhView all = bvh_.view();
        ranges.bvhBoxes = {{0, all.boxes.count}};
        ranges.bvhItems = {{0, all.items.count}};
    } else {
        ranges.bvhBoxes = bvh_.movingBoxes();
        ranges.bvhItems = bvh_.movingItems();
    }
    return ranges;
}

void BatchSet::gatherVertices(const TriangleView& geometry) {
    firstVertex_.assign(batches_.size() + 1, 0);
    corners_.resize(triangles_.size());
    std::vector<uint32_t> ofCorners(3 * triangles_.size()); // of each batch the first are used
    parallelFor<CpuTag>(
        batches_.size(),
        [&](size_t b) {
            const Batch& batch = batches_[b];
            uint32_t* const found = &ofCorners[3 * size_t(batch.first)];
            // A table of the vertices found, at most three quarters full, by multiplicative hashes:
            // Knuth, The Art of Computer Programming 3, sec. 6.4.
            constexpr uint32_t kSlotsLog2 = 11, kSlots = 1u << kSlotsLog2, kFree = 0xffff,
                               kKnuth = 2654435761u;
            static_assert(3 * kMaxBatchTriangleCount <= kSlots / 4 * 3);
            std::array<uint16_t, kSlots> table;
            table.fill(kFree);
            uint32_t count = 0;
            for (uint32_t i = 0; i < batch.count; ++i)
                for (int corner = 0; corner < 3; ++corner) {
                    const uint32_t vertex = geometry.triangles[triangles_[batch.first + i]][corner];
                    uint32_t slot = vertex * kKnuth >> (32 - kSlotsLog2);
                    while (table[slot] != kFree && found[table[slot]] != vertex)
                        slot = (slot + 1) % kSlots;
                    if (table[slot] == kFree) {
                        found[count] = vertex;
                        table[slot] = uint16_t(count++);
                    }
                    corners_[batch.first + i].of[corner] = table[slot];
                }
            firstVertex_[b] = count;
        },
        16);
    std::exclusive_scan(firstVertex_.begin(), firstVertex_.end(), firstVertex_.begin(), 0u);
    vertices_.resize(firstVertex_.back());
    positions_.assign(vertices_.size() + BatchVerticesView::kPadding, glm::vec3(0.0f));
    parallelFor<CpuTag>(
        batches_.size(),
        [&](size_t b) {
            const uint32_t* const found = &ofCorners[3 * size_t(batches_[b].first)];
            for (uint32_t v = firstVertex_[b]; v < firstVertex_[b + 1]; ++v) {
                vertices_[v] = found[v - firstVertex_[b]];
                positions_[v] = geometry.positions[vertices_[v]];
            }
        },
        64);
}

bool BatchSet::keepPositions(const TriangleView& geometry, uint32_t batch, Box& box) {
    bool isMoved = false;
    for (uint32_t v = firstVertex_[batch]; v < firstVertex_[batch + 1]; ++v) {
        const glm::vec3 now = geometry.positions[vertices_[v]];
        isMoved |= positions_[v] != now;
        positions_[v] = now;
        box.add(now);
    }
    return isMoved;
}

BatchView BatchSet::view() const {
    return {viewOf(batches_),
            viewOf(boxes_),
            viewOf(triangles_),
            bvh_.view(),
            maxTriangleCount_,
            {},
            {viewOf(firstVertex_), viewOf(positions_), viewOf(corners_)}};
}

} // namespace shadowdag
