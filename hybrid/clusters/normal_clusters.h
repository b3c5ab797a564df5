// SPDX-License-Identifier: Apache-2.0
// Divides clusters by the cells of their samples' geometric normals (Nk clustering). Source:
// Olsson, Billeter, Assarsson, Clustered Deferred and Forward Shading, HPG 2012, sec. 3.2; Olsson
// et al. 2015, sec. V-F. They sort keys of position and normal at once; here a cluster by position
// is divided in its own list, so that the grid's tables do not grow with k.
#pragma once

#include "hybrid/clusters/clusters.h"
#include "voxel/bits.h"

namespace shadowdag {

/// A set of normal cells.
struct NormalCellSet {
    static constexpr uint32_t kWordCount = 6 * kMaxNormalCellsPerEdge * kMaxNormalCellsPerEdge / 32;
    uint32_t words[kWordCount] = {};

    SDAG_HD void add(uint32_t cell) { words[cell / 32] |= 1u << (cell % 32); }
    SDAG_HD uint32_t count() const {
        uint32_t sum = 0;
        for (const uint32_t word : words)
            sum += bitCount32(word);
        return sum;
    }
};

/// Finds the normal cell of every sample of a cluster, and counts how many cells there are.
struct CountNormalCells {
    GBufferView gbuffer;
    ClusterView clusters;             ///< by position
    uint32_t k;                       ///< 1..kMaxNormalCellsPerEdge
    View<uint32_t> normalCellOfEntry; ///< by entry of clusters.samples
    View<uint32_t> partCount;

    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        NormalCellSet found;
        for (uint32_t i = clusters.sampleStart[cluster]; i < clusters.sampleStart[cluster + 1];
             ++i) {
            const uint32_t cell = normalCellOf(gbuffer.normalWorld[clusters.samples[i]], k);
            normalCellOfEntry[i] = cell;
            found.add(cell);
        }
        partCount[cluster] = found.count();
    }
};

/// Writes the parts of a cluster, ascending by normal cell, samples in the order they had.
struct SplitByNormals {
    ClusterView clusters; ///< by position; clusterOfSample not read
    View<const uint32_t> normalCellOfEntry;
    View<const uint32_t> partStart; ///< clusterCount + 1: the scan of partCount
    View<uint32_t> cell;            ///< these two by part
    View<uint32_t> normalCell;
    View<uint32_t> sampleStart; ///< partCount + 1
    View<uint32_t> samples;
    View<uint32_t> clusterOfSample;

    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        const uint32_t begin = clusters.sampleStart[cluster];
        const uint32_t end = clusters.sampleStart[cluster + 1];
        NormalCellSet found;
        for (uint32_t i = begin; i < end; ++i)
            found.add(normalCellOfEntry[i]);
        uint32_t part = partStart[cluster], out = begin;
        for (uint32_t w = 0; w < NormalCellSet::kWordCount; ++w)
            for (uint32_t left = found.words[w]; left != 0; left &= left - 1) {
                const uint32_t wanted = w * 32 + lowestBit32(left);
                cell[part] = clusters.cell[cluster];
                normalCell[part] = wanted;
                sampleStart[part] = out;
                for (uint32_t i = begin; i < end; ++i)
                    if (normalCellOfEntry[i] == wanted) {
                        samples[out++] = clusters.samples[i];
                        clusterOfSample[clusters.samples[i]] = part;
                    }
                ++part;
            }
        if (cluster + 1 == clusters.count())
            sampleStart[part] = out;
    }
};

} // namespace shadowdag
