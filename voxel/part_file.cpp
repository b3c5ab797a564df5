// SPDX-License-Identifier: Apache-2.0
// Layout of a .svpart file, version 1, little endian, no padding:
//
//     8  magic 53 56 50 52 54 0d 0a 1a ("SVPRT", then what a text-mode copy would damage)
//     4  version             4  bytes of the header, from the magic to its checksum inclusive
//     4  resolutionLog2      24 originWorld (3 f64)      8  voxelSizeWorld (f64)
//     4  part (from 1)       4  parts
//     8  tasks of all parts  8  subtrees of this one
//     8  voxels              18 x 8  octree cells of this part by level, 2^0 first
//     18 x (8 nodes, 8 children)     unique nodes by level, 2^0 first
//     4 x (4 length, bytes)  provenance: scene name, scene hash, program version, options
//     16 XXH3-128 of all before
//        payload: the nodes of each level (node_stream.h), that of tasks first, leaves last; then
//        8 (Morton number of the cell) + 4 (number of its root, or ~0) a subtree
//     16 XXH3-128 of the payload
#include "voxel/part_file.h"

#include "cuda/error.h"
#include "voxel/byte_stream.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace shadowdag {
namespace {

constexpr uint8_t kMagic[8] = {0x53, 0x56, 0x50, 0x52, 0x54, 0x0d, 0x0a, 0x1a};
constexpr uint32_t kVersion = 1;
constexpr uint64_t kSubtreeBytes = 12;
// Four texts and the fixed fields.
constexpr uint32_t kMaxHeaderBytes = 4 * (kMaxTextBytes + 4) + 1024;
constexpr size_t kFlushBytes = size_t(1) << 18;

/// Returns "1, 2, 5 and 3 more".
std::string listed(const std::vector<uint32_t>& numbers) {
    std::string text;
    for (size_t i = 0; i < numbers.size() && i < 8; ++i)
        text += (i ? ", " : "") + std::to_string(numbers[i]);
    return numbers.size() > 8 ? text + " and " + std::to_string(numbers.size() - 8) + " more"
                              : text;
}

} // namespace

uint64_t PartHeader::payloadByteCount() const {
    uint64_t bytes = kSubtreeBytes * subtreeCount;
    for (uint32_t level = kLeafLog2; level <= taskLevelOf(grid); ++level)
        bytes += levels[level].byteCount(level);
    return bytes;
}

std::string partsDiffer(const PartHeader& a, const PartHeader& b) {
    const auto differ = [](const std::string& what, const std::string& x, const std::string& y) {
        return what + " " + x + " against " + y;
    };
    if (a.provenance.sceneHash != b.provenance.sceneHash)
        return differ("scene hash", a.provenance.sceneHash, b.provenance.sceneHash);
    if (a.grid.resolutionLog2 != b.grid.resolutionLog2)
        return differ("resolution", std::to_string(a.grid.resolution()),
                      std::to_string(b.grid.resolution()));
    if (!(a.grid == b.grid))
        return "another grid of the same resolution";
    if (a.provenance.options != b.provenance.options)
        return differ("options", "'" + a.provenance.options + "'",
                      "'" + b.provenance.options + "'");
    if (a.provenance.programVersion != b.provenance.programVersion)
        return differ("program version", a.provenance.programVersion, b.provenance.programVersion);
    if (a.partCount != b.partCount)
        return differ("number of parts", std::to_string(a.partCount), std::to_string(b.partCount));
    if (a.taskCount != b.taskCount)
        return differ("number of tasks", std::to_string(a.taskCount), std::to_string(b.taskCount));
    return "";
}

std::string otherBuildOf(const PartHeader& found, const PartHeader& own) {
    std::string difference = partsDiffer(found, own);
    if (difference.empty() && found.part != own.part)
        difference = "part " + std::to_string(found.part) + " against " + std::to_string(own.part);
    return difference.empty() ? ""
                              : "another build, of " + found.provenance.sceneName + " at " +
                                    std::to_string(found.grid.resolution()) + "^3: " + difference;
}

PartWriter::PartWriter(const PartHeader& header, const std::string& path) : out_(path) {
    ByteWriter h;
    h.put(kMagic);
    h.put(kVersion);
    const AssetProvenance& p = header.provenance;
    const std::string* texts[] = {&p.sceneName, &p.sceneHash, &p.programVersion, &p.options};
    // The bytes before the texts do not depend on them.
    uint32_t headerBytes = 16 + 4 + 24 + 8 + 8 + 16 + 8 + 18 * 8 + 18 * 16 + 16;
    for (const std::string* text : texts)
        headerBytes += 4 + uint32_t(std::min<size_t>(text->size(), kMaxTextBytes));
    h.put(headerBytes);
    h.put(header.grid.resolutionLog2);
    h.put(header.grid.originWorld);
    h.put(header.grid.voxelSizeWorld);
    h.put(header.part);
    h.put(header.partCount);
    h.put(header.taskCount);
    h.put(header.subtreeCount);
    h.put(header.counts.voxelCount);
    h.put(header.counts.cellCount);
    h.put(header.levels);
    for (const std::string* text : texts)
        h.text(*text);
    SDAG_ASSERT(h.data().size() + sizeof(Checksum) == headerBytes);
    const Checksum hash = contentHash(h.data().data(), h.data().size());
    out_.write(h.data().data(), h.data().size());
    out_.write(hash.data(), hash.size());
    byteCount_ = headerBytes;
    payloadLeft_ = header.payloadByteCount();
    buffer_.reserve(kFlushBytes + 64);
}

void PartWriter::inner(uint32_t level, uint32_t mask, const uint32_t* children) {
    NodeWords node;
    node.words[0] = mask;
    node.count = 1 + uint32_t(std::popcount(mask));
    std::copy(children, children + node.count - 1, node.words + 1);
    appendNode(level, node, buffer_);
    if (buffer_.size() >= kFlushBytes)
        flush();
}

void PartWriter::leaf(uint64_t voxels) {
    appendNode(kLeafLog2, {{uint32_t(voxels), uint32_t(voxels >> 32)}, 2}, buffer_);
    if (buffer_.size() >= kFlushBytes)
        flush();
}

void PartWriter::flush() {
    hasher_.add(buffer_.data(), buffer_.size());
    out_.write(buffer_.data(), buffer_.size());
    byteCount_ += buffer_.size();
    payloadLeft_ -= buffer_.size();
    buffer_.clear();
}

uint64_t PartWriter::finish(const std::vector<Subtree>& subtrees) {
    for (const Subtree& subtree : subtrees) {
        const auto put = [&](const auto& value) {
            const auto* first = reinterpret_cast<const uint8_t*>(&value);
            buffer_.insert(buffer_.end(), first, first + sizeof value);
        };
        put(subtree.cell);
        put(subtree.address);
    }
    flush();
    SDAG_ASSERT(payloadLeft_ == 0);
    const Checksum hash = hasher_.hash();
    out_.write(hash.data(), hash.size());
    out_.commit();
    return byteCount_ + hash.size();
}

PartHeader writePart(PartHeader header, const DagBuilder& builder, std::vector<Subtree> subtrees,
                     const std::string& path) {
    const uint32_t taskLevel = taskLevelOf(header.grid);
    for (uint32_t level = kLeafLog2; level <= taskLevel; ++level)
        header.levels[level] = builder.counts(level);
    header.subtreeCount = subtrees.size();
    PartWriter writer(header, path);
    visitSubtrees(builder, taskLevel, subtrees, writer);
    writer.finish(subtrees);
    return header;
}

PartReader::PartReader(const std::string& path) : path_(path) {
    const ReadableFile file(path, "part");
    std::vector<uint8_t> bytes(size_t(std::min<uint64_t>(file.byteCount(), kMaxHeaderBytes)));
    file.read(0, bytes.data(), bytes.size());
    ByteReader in(bytes, "part " + path);
    if (bytes.size() < sizeof(kMagic) || std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0)
        in.fail("has no .svpart signature; it is another kind of file or was damaged by a "
                "text-mode copy");
    in.take(sizeof(kMagic), "the magic");
    const auto version = in.take<uint32_t>("the version");
    if (version != kVersion)
        in.fail("has version " + std::to_string(version) + ", this program reads " +
                std::to_string(kVersion) + "; build it again with this program");
    const auto headerBytes = in.take<uint32_t>("the header size");
    if (headerBytes > kMaxHeaderBytes || headerBytes < sizeof(Checksum))
        in.fail("claims a header of " + std::to_string(headerBytes) +
                " bytes; the file is damaged, copy or build it again");
    header_.grid.resolutionLog2 = in.take<uint32_t>("the resolution");
    header_.grid.originWorld = in.take<glm::dvec3>("the origin");
    header_.grid.voxelSizeWorld = in.take<double>("the voxel size");
    header_.part = in.take<uint32_t>("the part");
    header_.partCount = in.take<uint32_t>("the number of parts");
    header_.taskCount = in.take<uint64_t>("the number of tasks");
    header_.subtreeCount = in.take<uint64_t>("the number of subtrees");
    header_.counts.voxelCount = in.take<uint64_t>("the number of voxels");
    std::memcpy(header_.counts.cellCount,
                in.take(sizeof header_.counts.cellCount, "the numbers of cells"),
                sizeof header_.counts.cellCount);
    static_assert(sizeof header_.levels == 18 * 16);
    std::memcpy(header_.levels, in.take(sizeof header_.levels, "the numbers of nodes"),
                sizeof header_.levels);
    header_.provenance.sceneName = in.text("the scene name");
    header_.provenance.sceneHash = in.text("the scene hash");
    header_.provenance.programVersion = in.text("the program version");
    header_.provenance.options = in.text("the options");
    const uint64_t hashedBytes = in.offset();
    if (in.take<Checksum>("the header checksum") != contentHash(bytes.data(), hashedBytes) ||
        in.offset() != headerBytes)
        in.fail(
            "its header does not match its checksum; the file is damaged, copy or build it again");
    payloadOffset_ = headerBytes;
    if (header_.partCount > kMaxPartCount)
        in.fail("is one of " + std::to_string(header_.partCount) + " parts, there are at most " +
                std::to_string(kMaxPartCount) + "; the file is damaged, build it again");

    // The following holds for every file with an intended checksum; no sum can wrap.
    const VoxelGrid& grid = header_.grid;
    bool isSound = grid.resolutionLog2 <= kMaxResolutionLog2 && grid.voxelSizeWorld > 0 &&
                   std::isfinite(grid.voxelSizeWorld) && header_.part >= 1 &&
                   header_.part <= header_.partCount && header_.subtreeCount <= header_.taskCount &&
                   header_.subtreeCount <= file.byteCount();
    for (uint32_t level = 0; level <= kMaxResolutionLog2 && isSound; ++level) {
        const LevelCounts& counts = header_.levels[level];
        const bool isUsed = level >= kLeafLog2 && level <= taskLevelOf(grid);
        isSound = counts.nodeCount < (isUsed ? uint64_t(kNoNode) : 1) &&
                  counts.pointerCount <= (isUsed && level > kLeafLog2 ? 8 * counts.nodeCount : 0);
    }
    if (!isSound)
        in.fail("its header contradicts itself; the file is damaged, build it again");
    const uint64_t wanted = headerBytes + header_.payloadByteCount() + sizeof(Checksum);
    if (file.byteCount() != wanted)
        in.fail("should be " + std::to_string(wanted) + " bytes, is " +
                std::to_string(file.byteCount()) + "; copy or build it again");
}

void PartReader::verify(const Progress& progress) const {
    const ReadableFile file(path_, "part");
    ContentHasher hasher;
    std::vector<uint8_t> buffer(size_t(1) << 20);
    uint64_t left = header_.payloadByteCount(), offset = payloadOffset_;
    while (left > 0) {
        if (progress)
            progress(0);
        const size_t count = size_t(std::min<uint64_t>(left, buffer.size()));
        file.read(offset, buffer.data(), count);
        hasher.add(buffer.data(), count);
        offset += count;
        left -= count;
    }
    Checksum stored;
    file.read(offset, stored.data(), stored.size());
    if (stored != hasher.hash())
        throw Error(ErrorKind::kInput, "part " + path_ +
                                           ": its nodes do not match their checksum; the file is "
                                           "damaged, copy or build it again");
}

uint64_t PartReader::levelOffset(uint32_t level) const {
    uint64_t offset = payloadOffset_;
    for (uint32_t l = taskLevelOf(header_.grid); l > level; --l)
        offset += header_.levels[l].byteCount(l);
    return offset;
}

NodeReader PartReader::level(uint32_t level) const {
    return NodeReader(std::make_shared<ReadableFile>(path_, "part"), levelOffset(level), level,
                      header_.levels[level],
                      level > kLeafLog2 ? header_.levels[level - 1].nodeCount : 0);
}

std::vector<Subtree> PartReader::subtrees() const {
    std::vector<uint8_t> bytes(size_t(kSubtreeBytes * header_.subtreeCount));
    const ReadableFile file(path_, "part");
    file.read(levelOffset(kLeafLog2) + header_.levels[kLeafLog2].byteCount(kLeafLog2), bytes.data(),
              bytes.size());
    ByteReader in(bytes, "part " + path_);
    const uint32_t taskLevel = taskLevelOf(header_.grid);
    const uint64_t cellLimit = uint64_t(1) << (3 * (rootLevelOf(header_.grid) - taskLevel));
    std::vector<Subtree> subtrees;
    for (uint64_t i = 0; i < header_.subtreeCount; ++i) {
        const auto cell = in.take<uint64_t>("a cell");
        const auto address = in.take<uint32_t>("a root");
        if (cell >= cellLimit || (!subtrees.empty() && cell <= subtrees.back().cell) ||
            (address != kNoNode && address >= header_.levels[taskLevel].nodeCount))
            in.fail("subtree " + std::to_string(i) + " (cell " + std::to_string(cell) + ", root " +
                    std::to_string(address) +
                    ") is out of range; the file is damaged, build it "
                    "again");
        subtrees.push_back({cell, address});
    }
    return subtrees;
}

void checkParts(const std::vector<PartReader>& parts, const std::string& programVersion,
                const Progress& progress) {
    const PartHeader& first = parts.front().header();
    std::map<uint32_t, const PartReader*> byNumber;
    for (const PartReader& part : parts) {
        const PartHeader& header = part.header();
        if (header.provenance.programVersion != programVersion)
            throw Error(ErrorKind::kInput, "part " + part.path() + ": was built by version " +
                                               header.provenance.programVersion + ", this is " +
                                               programVersion +
                                               "; build and merge with one version");
        const std::string difference = partsDiffer(header, first);
        if (!difference.empty())
            throw Error(ErrorKind::kInput, "part " + part.path() +
                                               ": belongs to another build "
                                               "than " +
                                               parts.front().path() + ": " + difference);
        const auto [there, isNew] = byNumber.emplace(header.part, &part);
        if (!isNew)
            throw Error(ErrorKind::kInput, "part " + part.path() + ": is part " +
                                               std::to_string(header.part) + " of " +
                                               std::to_string(header.partCount) + ", as " +
                                               there->second->path() + "; give each part once");
    }
    std::vector<uint32_t> missing;
    for (uint32_t part = 1; part <= first.partCount; ++part)
        if (!byNumber.contains(part))
            missing.push_back(part);
    if (!missing.empty())
        throw Error(ErrorKind::kInput, "of the " + std::to_string(first.partCount) + " parts of " +
                                           first.provenance.sceneName + " number " +
                                           listed(missing) + (missing.size() > 1 ? " are" : " is") +
                                           " missing; build them with --part k/" +
                                           std::to_string(first.partCount) +
                                           " and give all to merge");
    uint64_t subtreeCount = 0;
    for (const PartReader& part : parts)
        subtreeCount += part.header().subtreeCount;
    if (subtreeCount != first.taskCount)
        throw Error(ErrorKind::kInput,
                    "part " + parts.front().path() + " and the other parts hold " +
                        std::to_string(subtreeCount) + " of " + std::to_string(first.taskCount) +
                        " tasks; they are damaged, build them again");
    for (const PartReader& part : parts)
        part.verify(progress);
}

} // namespace shadowdag
