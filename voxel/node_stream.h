// SPDX-License-Identifier: Apache-2.0
// Streams of nodes between tables, files and encoders: one level at a time, never a whole DAG.
#pragma once

#include "voxel/dag.h"

#include <bit>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// A node as the tables of dag_builder.h hold it, children named by their number in the level
/// below.
struct NodeWords {
    uint32_t words[9]; ///< leaf: low and high voxels; inner: child mask, then children
    uint32_t count = 0;
};

/// How many nodes a level has and how many children they have together (0 for leaves).
struct LevelCounts {
    uint64_t nodeCount = 0;
    uint64_t pointerCount = 0;

    /// Returns the bytes of the level in a stream: 8 a leaf; 1 (child mask) and 4 a child an inner
    /// node.
    uint64_t byteCount(uint32_t level) const {
        return level == kLeafLog2 ? 8 * nodeCount : nodeCount + 4 * pointerCount;
    }
};

/// Receives the nodes of a DAG, or of subtrees that share nodes, in canonical order: level by level
/// from the top to the leaves, a level in order of first visits. A node's number is its position in
/// its level. May throw to end the traversal.
class NodeSink {
public:
    virtual ~NodeSink() = default;
    /// @param children numbers, as many as `mask` has bits
    virtual void inner(uint32_t level, uint32_t mask, const uint32_t* children) = 0;
    virtual void leaf(uint64_t voxels) = 0;
};

/// Appends a node to a stream of its level.
inline void appendNode(uint32_t level, const NodeWords& node, std::vector<uint8_t>& bytes) {
    const auto put = [&](const uint32_t* words, uint32_t count) {
        const auto* first = reinterpret_cast<const uint8_t*>(words);
        bytes.insert(bytes.end(), first, first + 4 * size_t(count));
    };
    if (level == kLeafLog2)
        return put(node.words, 2);
    bytes.push_back(uint8_t(node.words[0]));
    put(node.words + 1, node.count - 1);
}

/// A regular file open for reading, closed by the destructor. Throws Error kInput when it is not
/// one or cannot be opened, kResource for too many open files.
class ReadableFile {
public:
    /// @param what names the file's kind in messages, as in "part"
    ReadableFile(const std::string& path, const std::string& what);
    ~ReadableFile();
    ReadableFile(ReadableFile&& other) noexcept;
    ReadableFile& operator=(ReadableFile&& other) noexcept;

    int fd() const { return fd_; }
    uint64_t byteCount() const { return byteCount_; }
    /// Returns kind and path, for messages.
    const std::string& name() const { return name_; }
    /// Reads `count` bytes at `offset`; Error kInput if the file ends before that.
    void read(uint64_t offset, void* data, size_t count) const;

private:
    int fd_ = -1;
    uint64_t byteCount_ = 0;
    std::string name_;
};

/// Reads a stream of nodes in a file in order. Holds only a buffer.
class NodeReader {
public:
    /// @param file shared; open while a reader uses it
    /// @param offset where the level's stream begins in it
    /// @param childLimit children's numbers must be below it
    NodeReader(std::shared_ptr<const ReadableFile> file, uint64_t offset, uint32_t level,
               const LevelCounts& counts, uint64_t childLimit);

    /// Reads the next node and returns true, or false after the last. Throws Error kInput naming
    /// the file if the stream does not contain that many nodes and children in range, kResource if
    /// it cannot be read.
    bool next(NodeWords& node);

private:
    const uint8_t* take(size_t count);
    [[noreturn]] void fail(const std::string& what) const;

    std::shared_ptr<const ReadableFile> file_;
    uint64_t offset_, bytesLeft_;
    uint32_t level_;
    uint64_t nodesLeft_, childLimit_;
    std::vector<uint8_t> buffer_;
    size_t at_ = 0, end_ = 0;
};

} // namespace shadowdag
