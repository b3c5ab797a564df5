// SPDX-License-Identifier: Apache-2.0
// Layout of a .svdag file, version 1, little endian, no padding:
//
//     8  magic 53 56 44 41 47 0d 0a 1a ("SVDAG", then what a text-mode copy would damage)
//     4  version             4  resolutionLog2
//     24 originWorld (3 f64) 8  voxelSizeWorld (f64)
//     32 counts: inner nodes, pointers, references, leaves (4 u64; all 0: no voxel)
//     4  packing: 0 as is, 1 zstd                       8  bytes of the payload
//     16 XXH3-128 of the payload as it stands
//     4 x (4 length, bytes)  provenance: scene name, scene hash, program version, options
//     16 XXH3-128 of all before
//        payload: the streams of asset_encoding.h
#include "voxel/asset.h"

#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "scenes/output_file.h"
#include "voxel/asset_encoding.h"

#include <zstd.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>

namespace shadowdag {
namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they stand in memory");

constexpr uint8_t kMagic[8] = {0x53, 0x56, 0x44, 0x41, 0x47, 0x0d, 0x0a, 0x1a};
constexpr uint32_t kVersion = 1;
constexpr uint32_t kPackingNone = 0, kPackingZstd = 1;
constexpr uint32_t kMaxTextBytes = 4096;
// What a file may unpack to, relative to its payload: bounds what is allocated on its word. The writer leaves what would
// shrink more as it is.
constexpr uint64_t kMaxUnpackRatio = 16;
// Levels above 12 gain a few percent for several times the time.
constexpr int kZstdLevel = 12;

class HeaderWriter {
public:
    template <class T> void put(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes(&value, sizeof(T));
    }
    void text(const std::string& s) {
        const std::string cut = s.substr(0, kMaxTextBytes);
        put(uint32_t(cut.size()));
        bytes(cut.data(), cut.size());
    }
    void bytes(const void* data, size_t count) {
        const auto* first = static_cast<const uint8_t*>(data);
        data_.insert(data_.end(), first, first + count);
    }
    const std::vector<uint8_t>& data() const { return data_; }

private:
    std::vector<uint8_t> data_;
};

/// Reads a file from its start, never past its end.
class FileReader {
public:
    explicit FileReader(const std::string& path) : path_(path), stream_(path, std::ios::binary | std::ios::ate) {
        if (!stream_)
            fail("cannot be opened; check the name and its permissions");
        const std::streamoff size = stream_.tellg();
        if (size < 0)
            fail("is not a regular file");
        size_ = uint64_t(size);
        stream_.seekg(0);
    }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput, "asset " + path_ + ": " + what);
    }
    void bytes(void* out, uint64_t count, const char* what) {
        if (count > size_ - offset_)
            fail("ends at byte " + std::to_string(size_) + " inside " + what + " (byte " + std::to_string(offset_) +
                 ", " + std::to_string(count) + " bytes); the file is cut off, copy or build it again");
        stream_.read(static_cast<char*>(out), std::streamsize(count));
        if (!stream_)
            fail("cannot be read at byte " + std::to_string(offset_));
        offset_ += count;
    }
    /// Reads what belongs to the header and remembers it for the checksum.
    void headerBytes(void* out, uint64_t count, const char* what) {
        bytes(out, count, what);
        const auto* first = static_cast<const uint8_t*>(out);
        header_.insert(header_.end(), first, first + count);
    }
    template <class T> T take(const char* what) {
        T value;
        headerBytes(&value, sizeof(T), what);
        return value;
    }
    std::string text(const char* what) {
        const uint32_t count = take<uint32_t>(what);
        if (count > kMaxTextBytes)
            fail(std::string(what) + " claims " + std::to_string(count) + " bytes, more than " +
                 std::to_string(kMaxTextBytes) + "; the file is damaged");
        std::string s(count, '\0');
        headerBytes(s.data(), count, what);
        return s;
    }
    const std::vector<uint8_t>& header() const { return header_; }
    uint64_t left() const { return size_ - offset_; }

private:
    std::string path_;
    std::ifstream stream_;
    uint64_t size_ = 0, offset_ = 0;
    std::vector<uint8_t> header_;
};

using Hash = std::array<uint8_t, 16>;

Asset readUnguarded(const std::string& path) {
    FileReader in(path);
    uint8_t magic[8];
    in.headerBytes(magic, sizeof(magic), "the magic");
    if (std::memcmp(magic, kMagic, sizeof(magic)) != 0)
        in.fail("does not begin as an .svdag file does; it is something else or was damaged by a text-mode copy");
    const auto version = in.take<uint32_t>("the version");
    if (version != kVersion)
        in.fail("has version " + std::to_string(version) + ", this program reads " + std::to_string(kVersion) +
                "; build it again with this program");
    VoxelGrid grid;
    grid.resolutionLog2 = in.take<uint32_t>("the resolution");
    grid.originWorld = in.take<glm::dvec3>("the origin");
    grid.voxelSizeWorld = in.take<double>("the voxel size");
    const auto counts = in.take<EncodedCounts>("the counts");
    const auto packing = in.take<uint32_t>("the packing");
    const auto payloadBytes = in.take<uint64_t>("the payload size");
    const auto payloadHash = in.take<Hash>("the payload checksum");
    Asset asset;
    asset.provenance.sceneName = in.text("the scene name");
    asset.provenance.sceneHash = in.text("the scene hash");
    asset.provenance.programVersion = in.text("the program version");
    asset.provenance.options = in.text("the options");
    Hash headerHash;
    in.bytes(headerHash.data(), headerHash.size(), "the header checksum");
    if (headerHash != contentHash(in.header().data(), in.header().size()))
        in.fail("its header does not match its checksum; the file is damaged, copy or build it again");

    if (grid.resolutionLog2 > kMaxResolutionLog2)
        in.fail("its resolution 2^" + std::to_string(grid.resolutionLog2) + " is over 2^" +
                std::to_string(kMaxResolutionLog2));
    if (!(grid.voxelSizeWorld > 0) || !std::isfinite(grid.voxelSizeWorld) ||
        !std::isfinite(grid.originWorld.x + grid.originWorld.y + grid.originWorld.z))
        in.fail("its transform is not finite or its voxel size " + std::to_string(grid.voxelSizeWorld) +
                " not positive");
    if (payloadBytes != in.left())
        in.fail("its payload should be " + std::to_string(payloadBytes) + " bytes, the file holds " +
                std::to_string(in.left()) + "; copy or build it again");
    const uint64_t unpackLimit = packing == kPackingZstd ? payloadBytes * kMaxUnpackRatio : payloadBytes;
    // Each count alone against the limit first, so that their sum cannot wrap.
    if (packing > kPackingZstd)
        in.fail("its packing " + std::to_string(packing) + " is unknown");
    if (counts.innerCount > unpackLimit || counts.pointerCount > 8 * counts.innerCount ||
        counts.referenceCount > counts.pointerCount || counts.leafCount > unpackLimit ||
        counts.byteCount() > unpackLimit || (packing == kPackingNone && counts.byteCount() != payloadBytes) ||
        counts.wordCount() >= kNoNode)
        in.fail("its counts (" + std::to_string(counts.innerCount) + " inner nodes, " +
                std::to_string(counts.pointerCount) + " pointers, " + std::to_string(counts.referenceCount) +
                " references, " + std::to_string(counts.leafCount) + " leaves) do not fit a payload of " +
                std::to_string(payloadBytes) + " bytes");
    std::vector<uint8_t> payload(payloadBytes);
    in.bytes(payload.data(), payloadBytes, "the payload");
    if (payloadHash != contentHash(payload.data(), payload.size()))
        in.fail("its payload does not match its checksum; the file is damaged, copy or build it again");
    if (packing == kPackingZstd) {
        std::vector<uint8_t> streams(counts.byteCount());
        const size_t got = ZSTD_decompress(streams.data(), streams.size(), payload.data(), payload.size());
        if (ZSTD_isError(got) || got != streams.size())
            in.fail("its payload does not unpack to " + std::to_string(streams.size()) + " bytes" +
                    (ZSTD_isError(got) ? std::string(": ") + ZSTD_getErrorName(got) : std::string()));
        payload.swap(streams);
    }
    asset.dag = decodeDag(payload, counts, grid, "asset " + path);
    return asset;
}

} // namespace

uint64_t writeAsset(const Asset& asset, const std::string& path) {
    EncodedCounts counts;
    const std::vector<uint8_t> streams = encodeDag(asset.dag, counts);
    std::vector<uint8_t> packed(ZSTD_compressBound(streams.size()));
    const size_t got = ZSTD_compress(packed.data(), packed.size(), streams.data(), streams.size(), kZstdLevel);
    const bool isPacked = !ZSTD_isError(got) && got < streams.size() && got * kMaxUnpackRatio >= streams.size();
    packed.resize(isPacked ? got : 0);
    const std::vector<uint8_t>& payload = isPacked ? packed : streams;

    HeaderWriter header;
    header.put(kMagic);
    header.put(kVersion);
    header.put(asset.dag.grid.resolutionLog2);
    header.put(asset.dag.grid.originWorld);
    header.put(asset.dag.grid.voxelSizeWorld);
    header.put(counts);
    header.put(isPacked ? kPackingZstd : kPackingNone);
    header.put(uint64_t(payload.size()));
    header.put(contentHash(payload.data(), payload.size()));
    header.text(asset.provenance.sceneName);
    header.text(asset.provenance.sceneHash);
    header.text(asset.provenance.programVersion);
    header.text(asset.provenance.options);
    const Hash headerHash = contentHash(header.data().data(), header.data().size());

    OutputFile out(path);
    out.write(header.data().data(), header.data().size());
    out.write(headerHash.data(), headerHash.size());
    out.write(payload.data(), payload.size());
    out.commit();
    return header.data().size() + headerHash.size() + payload.size();
}

Asset readAsset(const std::string& path) {
    try {
        return readUnguarded(path);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, "asset " + path + ": not enough memory to load it");
    }
}

} // namespace shadowdag
