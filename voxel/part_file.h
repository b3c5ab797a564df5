// SPDX-License-Identifier: Apache-2.0
// The part file (.svpart): a share of a voxelization, merged in itself, with the data needed to
// join it with the others.
#pragma once

#include "cuda/progress.h"
#include "scenes/content_hash.h"
#include "scenes/output_file.h"
#include "voxel/asset.h"
#include "voxel/node_stream.h"
#include "voxel/voxel_tasks.h"

#include <string>
#include <vector>

namespace shadowdag {

/// More parts than this would share more nodes than they differ in.
constexpr uint32_t kMaxPartCount = 65536;

/// The header of a part.
struct PartHeader {
    VoxelGrid grid;
    AssetProvenance provenance;
    uint32_t part = 1;                          ///< 1..partCount
    uint32_t partCount = 1;                     ///< of how many
    uint64_t taskCount = 0;                     ///< of all parts together
    uint64_t subtreeCount = 0;                  ///< tasks in this one
    OctreeCounts counts;                        ///< what this part's subtrees hold before merging
    LevelCounts levels[kMaxResolutionLog2 + 1]; ///< [level], leaves to tasks; 0 elsewhere

    /// Returns the bytes of the streams of nodes and of the subtrees after them.
    uint64_t payloadByteCount() const;
};

/// Returns the first difference that shows that `a` and `b` are not parts of one build (names
/// ignored), as "scene hash 1.. against 2..", or "" if they are.
std::string partsDiffer(const PartHeader& a, const PartHeader& b);

/// Returns what a part belongs to, as "another build, of atrium at 512^3: scene hash 1.. against
/// 2..", unless it is a part of the same share of the same build as `own`: then "".
std::string otherBuildOf(const PartHeader& found, const PartHeader& own);

/// Writes a part as a whole or not at all: nodes come first, in the order of NodeSink, as many as
/// the header says. Throws Error kResource.
class PartWriter : public NodeSink {
public:
    PartWriter(const PartHeader& header, const std::string& path);

    void inner(uint32_t level, uint32_t mask, const uint32_t* children) override;
    void leaf(uint64_t voxels) override;
    /// Ends the file. Subtrees' addresses are numbers of nodes in the level of tasks, or kNoNode.
    /// Returns the file's size in bytes.
    uint64_t finish(const std::vector<Subtree>& subtrees);

private:
    void flush();

    OutputFile out_;
    ContentHasher hasher_;
    std::vector<uint8_t> buffer_;
    uint64_t byteCount_ = 0;
    uint64_t payloadLeft_ = 0;
};

/// Hands the nodes of subtrees in `source` (a DagBuilder or LevelMerge) to `sink` and gives the
/// subtrees the numbers of their roots for addresses.
template <class Source>
void visitSubtrees(const Source& source, uint32_t level, std::vector<Subtree>& subtrees,
                   NodeSink& sink) {
    std::vector<uint32_t> roots;
    for (const Subtree& subtree : subtrees)
        roots.push_back(subtree.address);
    roots = source.visit(level, roots, sink);
    for (size_t i = 0; i < subtrees.size(); ++i)
        subtrees[i].address = roots[i];
}

/// Writes the whole content of a builder (of top level taskLevelOf()) as a part; `subtrees` are
/// ascending in cell, their addresses the builder's. Changes neither, so that a write that failed
/// can be repeated. Returns the header with the counts.
PartHeader writePart(PartHeader header, const DagBuilder& builder, std::vector<Subtree> subtrees,
                     const std::string& path);

/// Reads a part: its header at once, verified; the rest level by level on request. Keeps no file
/// open.
class PartReader {
public:
    /// Throws Error kInput naming file, place and value.
    explicit PartReader(const std::string& path);

    const PartHeader& header() const { return header_; }
    const std::string& path() const { return path_; }
    /// Reads the whole file and compares the checksum; Error kInput. `progress` is called with 0.
    void verify(const Progress& progress) const;
    /// Returns a reader of the nodes of one level, from the leaves to the level of tasks.
    NodeReader level(uint32_t level) const;
    /// Returns the subtrees, ascending in cell; addresses as in PartWriter::finish.
    std::vector<Subtree> subtrees() const;

private:
    uint64_t levelOffset(uint32_t level) const;

    std::string path_; // reopened for each read, so that many parts need no open files
    PartHeader header_;
    uint64_t payloadOffset_ = 0;
};

/// Checks that the files are all parts of one build, each once, undamaged. Throws Error kInput
/// naming the bad file, or the parts that are missing. @param programVersion the running program's;
/// a part of another version may differ
void checkParts(const std::vector<PartReader>& parts, const std::string& programVersion,
                const Progress& progress);

} // namespace shadowdag
