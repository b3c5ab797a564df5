// SPDX-License-Identifier: Apache-2.0
// Layout of a .svdag file, version 1, little endian, no padding:
//
//     8  magic 53 56 44 41 47 0d 0a 1a ("SVDAG", then what a text-mode copy would damage)
//     4  version             4  resolutionLog2
//     24 originWorld (3 f64) 8  voxelSizeWorld (f64)
//     32 counts: inner nodes, pointers, references, leaves (4 u64; all 0 if there is no voxel)
//     4  packing: 0 streams, 1 streams in zstd frames, 2 compact        8  bytes of the payload
//     16 XXH3-128 of the payload as stored
//     4 x (4 length, bytes)  provenance: scene name, scene hash, program version, options
//     16 XXH3-128 of all before
//        payload: the streams of asset_encoding.h, or the bytes of compact_encoding.h
#include "voxel/asset.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "cuda/uninitialized.h"
#include "scenes/content_hash.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"
#include "voxel/asset_encoding.h"
#include "voxel/byte_stream.h"
#include "voxel/compact_encoding.h"

#define ZSTD_STATIC_LINKING_ONLY // for what a level's tables take
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>

namespace shadowdag {
namespace {

constexpr uint8_t kMagic[8] = {0x53, 0x56, 0x44, 0x41, 0x47, 0x0d, 0x0a, 0x1a};
constexpr uint32_t kVersion = 1;
constexpr uint32_t kPackingNone = 0, kPackingZstd = 1, kPackingCompact = 2;
// The largest ratio of unpacked size to payload that the reader accepts. It bounds the memory that
// a damaged file can make it allocate. The writer stores a payload unpacked if it would shrink
// more.
constexpr uint64_t kMaxUnpackRatio = 16;
// Levels above 12 gain a few percent for several times the time.
constexpr int kZstdLevel = 12;

// Content of a zstd frame: frames are unpacked by several threads.
constexpr size_t kPieceBytes = size_t(2) << 20;

using Hash = Checksum;

/// The parts of a file after its header.
struct Payload {
    uint32_t packing = kPackingNone;
    EncodedCounts counts;
    std::vector<uint8_t> bytes;
};

/// Returns the bytes in zstd, a frame for each piece; empty if zstd fails.
std::vector<uint8_t> pack(const std::vector<uint8_t>& bytes) {
    std::vector<uint8_t> packed;
    packed.reserve(ZSTD_compressBound(bytes.size()));
    for (size_t first = 0; first < bytes.size(); first += kPieceBytes) {
        const size_t size = std::min(kPieceBytes, bytes.size() - first), at = packed.size();
        packed.resize(at + ZSTD_compressBound(size));
        const size_t got = ZSTD_compress(packed.data() + at, packed.size() - at,
                                         bytes.data() + first, size, kZstdLevel);
        if (ZSTD_isError(got))
            return {};
        packed.resize(at + got);
    }
    return packed;
}

Payload makePayload(const Dag& dag, AssetPacking packing) {
    Payload payload;
    if (packing == AssetPacking::kCompact) {
        payload.packing = kPackingCompact;
        payload.bytes = encodeCompact(dag, payload.counts);
        return payload;
    }
    payload.bytes = encodeDag(dag, payload.counts);
    const size_t size = payload.bytes.size();
    std::vector<uint8_t> packed = pack(payload.bytes);
    if (!packed.empty() && packed.size() < size && packed.size() * kMaxUnpackRatio >= size) {
        payload.packing = kPackingZstd;
        payload.bytes = std::move(packed);
    }
    return payload;
}

/// One zstd frame of a payload and where its content belongs.
struct Piece {
    View<const uint8_t> packed;
    uint64_t offset, size;
};

/// Unpacks the zstd frames of a payload to `bytes`, on the CPU threads. Throws Error kInput.
void unpack(View<const uint8_t> payload, View<uint8_t> bytes, const ByteReader& in) {
    const auto fail = [&](size_t code) {
        in.fail("its payload does not unpack to " + std::to_string(bytes.count) + " bytes" +
                (ZSTD_isError(code) ? std::string(": ") + ZSTD_getErrorName(code) : std::string()));
    };
    std::vector<Piece> pieces;
    uint64_t offset = 0;
    for (size_t at = 0; at < payload.count;) {
        const uint8_t* first = payload.data + at;
        const size_t packed = ZSTD_findFrameCompressedSize(first, payload.count - at);
        if (ZSTD_isError(packed))
            fail(packed);
        const unsigned long long size = ZSTD_getFrameContentSize(first, packed);
        // Unknown and invalid sizes are the largest numbers.
        if (size == 0 || size > bytes.count - offset)
            fail(0);
        pieces.push_back({{first, packed}, offset, size});
        offset += size;
        at += packed;
    }
    if (offset != bytes.count)
        fail(0);
    std::vector<size_t> got(pieces.size());
    cpuParallelRanges(pieces.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            got[i] = ZSTD_decompress(bytes.data + pieces[i].offset, pieces[i].size,
                                     pieces[i].packed.data, pieces[i].packed.count);
    });
    for (size_t i = 0; i < pieces.size(); ++i)
        if (got[i] != pieces[i].size)
            fail(got[i]);
}

} // namespace

Asset parseAsset(const std::vector<uint8_t>& bytes, const std::string& name) {
    ByteReader in(bytes, "asset " + name);
    if (std::memcmp(in.take(sizeof(kMagic), "the magic"), kMagic, sizeof(kMagic)) != 0)
        in.fail("has no .svdag signature; it is another kind of file or was damaged by a "
                "text-mode copy");
    const auto version = in.take<uint32_t>("the version");
    if (version != kVersion)
        in.fail("has version " + std::to_string(version) + ", this program reads " +
                std::to_string(kVersion) + "; build it again with this program");
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
    const uint64_t headerBytes = in.offset();
    if (in.take<Hash>("the header checksum") != contentHash(bytes.data(), headerBytes))
        in.fail(
            "its header does not match its checksum; the file is damaged, copy or build it again");

    if (grid.resolutionLog2 > kMaxResolutionLog2)
        in.fail("its resolution 2^" + std::to_string(grid.resolutionLog2) + " is above 2^" +
                std::to_string(kMaxResolutionLog2));
    if (!(grid.voxelSizeWorld > 0) || !std::isfinite(grid.voxelSizeWorld) ||
        !std::isfinite(grid.originWorld.x + grid.originWorld.y + grid.originWorld.z))
        in.fail("its transform is not finite or its voxel size " +
                std::to_string(grid.voxelSizeWorld) + " not positive");
    if (payloadBytes != in.left())
        in.fail("its payload should be " + std::to_string(payloadBytes) +
                " bytes, the file holds " + std::to_string(in.left()) + "; copy or build it again");
    if (packing > kPackingCompact)
        in.fail("its packing " + std::to_string(packing) + " is unknown");
    const uint64_t unpackLimit =
        packing == kPackingZstd ? payloadBytes * kMaxUnpackRatio : payloadBytes;
    // Compare each count with the limit by itself first, so that their sum cannot wrap.
    // decodeCompact checks its own counts.
    if (packing != kPackingCompact &&
        (counts.innerCount > unpackLimit || counts.pointerCount > 8 * counts.innerCount ||
         counts.referenceCount > counts.pointerCount || counts.leafCount > unpackLimit ||
         counts.byteCount() > unpackLimit ||
         (packing == kPackingNone && counts.byteCount() != payloadBytes) ||
         counts.wordCount() >= kNoNode))
        in.fail("its counts (" + std::to_string(counts.innerCount) + " inner nodes, " +
                std::to_string(counts.pointerCount) + " pointers, " +
                std::to_string(counts.referenceCount) + " references, " +
                std::to_string(counts.leafCount) + " leaves) do not fit a payload of " +
                std::to_string(payloadBytes) + " bytes");
    const uint8_t* payload = in.take(payloadBytes, "the payload");
    if (payloadHash != contentHash(payload, payloadBytes))
        in.fail(
            "its payload does not match its checksum; the file is damaged, copy or build it again");
    if (packing == kPackingCompact) {
        asset.dag = decodeCompact({payload, payload + payloadBytes}, counts, grid, "asset " + name);
        return asset;
    }
    if (packing == kPackingNone) {
        asset.dag = decodeDag({payload, payloadBytes}, counts, grid, "asset " + name);
        return asset;
    }
    UninitializedVector<uint8_t> streams(counts.byteCount());
    asset.dag = decodeDag({streams.data(), streams.size()}, counts, grid, "asset " + name, [&] {
        unpack({payload, payloadBytes}, {streams.data(), streams.size()}, in);
    });
    return asset;
}

uint64_t writingBytes(AssetPacking packing, uint64_t wordCount, uint64_t largestLevelWords) {
    // Compact: one number per word of the largest level, the file (less than a byte per word; twice
    // that while it grows), and the coder's tables.
    if (packing == AssetPacking::kCompact)
        return 4 * largestLevelWords + 3 * wordCount + (uint64_t(8) << 20);
    // Fast: the streams (under three bytes per word); beside them first one number per word and two
    // lists of nodes, later their packed form and zstd's tables, which are smaller for short
    // streams.
    const uint64_t streams = 3 * wordCount;
    const uint64_t tables =
        ZSTD_estimateCCtxSize_usingCParams(ZSTD_getCParams(kZstdLevel, streams, 0));
    return streams + std::max(4 * wordCount + 8 * largestLevelWords, streams + tables);
}

uint64_t writeAsset(const Asset& asset, const std::string& path, AssetPacking packing) {
    const Payload payload = makePayload(asset.dag, packing);

    ByteWriter header;
    header.put(kMagic);
    header.put(kVersion);
    header.put(asset.dag.grid.resolutionLog2);
    header.put(asset.dag.grid.originWorld);
    header.put(asset.dag.grid.voxelSizeWorld);
    header.put(payload.counts);
    header.put(payload.packing);
    header.put(uint64_t(payload.bytes.size()));
    header.put(contentHash(payload.bytes.data(), payload.bytes.size()));
    header.text(asset.provenance.sceneName);
    header.text(asset.provenance.sceneHash);
    header.text(asset.provenance.programVersion);
    header.text(asset.provenance.options);
    const Hash headerHash = contentHash(header.data().data(), header.data().size());

    OutputFile out(path);
    out.write(header.data().data(), header.data().size());
    out.write(headerHash.data(), headerHash.size());
    out.write(payload.bytes.data(), payload.bytes.size());
    out.commit();
    return header.data().size() + headerHash.size() + payload.bytes.size();
}

bool beginsAsAsset(const std::string& path) {
    uint8_t magic[sizeof kMagic] = {};
    std::ifstream file = openInput(path);
    file.read(reinterpret_cast<char*>(magic), sizeof magic);
    return std::memcmp(magic, kMagic, sizeof kMagic) == 0;
}

Asset readAsset(const std::string& path) {
    try {
        std::string why;
        const auto bytes = readInputBytes(path, {~uint64_t(0)}, why);
        if (!bytes)
            throw Error(ErrorKind::kInput,
                        "asset " + path + ": " + why + "; check the name and its permissions");
        return parseAsset(*bytes, path);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, "asset " + path + ": not enough memory to load it");
    }
}

} // namespace shadowdag
