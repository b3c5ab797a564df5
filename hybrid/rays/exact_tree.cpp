// SPDX-License-Identifier: Apache-2.0
// Building, level by level: what costs is asking which children a triangle touches, and that is
// asked of all triangles of a level at once.
#include "hybrid/rays/exact_tree.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "voxel/triangle_voxels.h"

#include <algorithm>
#include <string>

namespace shadowdag {
namespace {

struct Cell {
    glm::ivec3 corner;
    size_t first, count; ///< of this level's items
    uint32_t entryWord;  ///< where its entry goes; kNoNode: the root's
};

uint32_t append(std::vector<uint32_t>& words, size_t count) {
    const size_t address = words.size();
    if (address + count >= kTriangleListTag)
        throw Error(ErrorKind::kResource,
                    "lists of triangles near voxels outgrow 2^31 words; use a lower resolution, "
                    "or trace without exact confirmation");
    words.resize(address + count);
    return uint32_t(address);
}

} // namespace

TriangleTree buildTriangleTree(const TriangleView& triangles, View<const uint32_t> which,
                               const VoxelGrid& grid) {
    TriangleTree tree;
    std::vector<uint32_t> items(which.begin(), which.end()), nextItems;
    std::vector<uint8_t> touched;
    std::vector<Cell> cells, next;
    if (!items.empty())
        cells.push_back({glm::ivec3(0), 0, items.size(), kNoNode});
    const auto setEntry = [&](const Cell& cell, uint32_t entry) {
        (cell.entryWord == kNoNode ? tree.rootEntry : tree.words[cell.entryWord]) = entry;
    };
    for (uint32_t level = std::max(grid.resolutionLog2, kLeafLog2); !cells.empty(); --level) {
        // Cells that are not divided.
        std::vector<Cell> divided;
        for (const Cell& cell : cells) {
            if (level > kLeafLog2 && cell.count > kMaxListLength) {
                divided.push_back(cell);
                continue;
            }
            const uint32_t list = append(tree.words, 1 + cell.count);
            setEntry(cell, list | kTriangleListTag);
            tree.words[list] = uint32_t(cell.count);
            std::copy_n(items.begin() + ptrdiff_t(cell.first), cell.count,
                        tree.words.begin() + list + 1);
        }
        const int half = level > 0 ? 1 << (level - 1) : 0;
        const auto childCorner = [half](const Cell& cell, uint32_t c) {
            return cell.corner + glm::ivec3(c & 1, c >> 1 & 1, c >> 2) * half;
        };
        // Which of the eight children each triangle touches.
        touched.assign(items.size(), 0);
        std::vector<uint32_t> cellOfItem(items.size(), kNoNode);
        for (uint32_t d = 0; d < divided.size(); ++d)
            std::fill_n(cellOfItem.begin() + ptrdiff_t(divided[d].first), divided[d].count, d);
        parallelFor<CpuTag>(items.size(), [&](size_t i) {
            if (cellOfItem[i] == kNoNode)
                return;
            const Cell& cell = divided[cellOfItem[i]];
            const glm::vec3 corners[3] = {triangles.vertex(items[i], 0),
                                          triangles.vertex(items[i], 1),
                                          triangles.vertex(items[i], 2)};
            const TriangleSetup setup = setupTriangle(grid, corners);
            for (uint32_t c = 0; c < 8; ++c)
                touched[i] |= uint8_t(touchesCube(setup, childCorner(cell, c), half) << c);
        });
        next.clear();
        nextItems.clear();
        for (const Cell& cell : divided) {
            uint32_t mask = 0;
            for (size_t i = cell.first; i < cell.first + cell.count; ++i)
                mask |= touched[i];
            const uint32_t node = append(tree.words, 1 + bitCount32(mask));
            setEntry(cell, node);
            tree.words[node] = mask;
            uint32_t entryWord = node;
            for (uint32_t c = 0; c < 8; ++c) {
                if ((mask >> c & 1) == 0)
                    continue;
                const size_t first = nextItems.size();
                for (size_t i = cell.first; i < cell.first + cell.count; ++i)
                    if (touched[i] >> c & 1)
                        nextItems.push_back(items[i]);
                next.push_back(
                    {childCorner(cell, c), first, nextItems.size() - first, ++entryWord});
            }
        }
        cells.swap(next);
        items.swap(nextItems);
    }
    return tree;
}

} // namespace shadowdag
