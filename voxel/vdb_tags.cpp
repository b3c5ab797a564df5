// SPDX-License-Identifier: Apache-2.0
#include "voxel/vdb_tags.h"

#include "cuda/error.h"
#include "scenes/content_hash.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

namespace shadowdag {
namespace {

std::string tagName(const char* name) {
    return kVdbTagPrefix + std::string(name);
}

/// Returns the shortest text that reads back as the same number.
std::string exactText(double value) {
    char text[32];
    return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

/// Returns the checksum over voxels and tags but its own, as 32 hex digits.
std::string checksumOf(const Dag& dag, VdbTags tags) {
    tags.erase(tagName("checksum"));
    std::string bytes = packTags(tags);
    const auto wordsHash = contentHash(dag.words.data(), dag.words.size() * sizeof(uint32_t));
    bytes.append(wordsHash.begin(), wordsHash.end());
    return hashText(contentHash(bytes.data(), bytes.size()));
}

/// Reads tags by name; messages begin with `name`.
class TagReader {
public:
    TagReader(const VdbTags& tags, const std::string& name) : tags_(tags), name_(name) {}

    const std::string& text(const char* tag) const {
        const auto found = tags_.find(tagName(tag));
        if (found == tags_.end())
            throw Error(ErrorKind::kInput, name_ + ": was exported by this program, but its " +
                                               tagName(tag) + " is missing; export it again");
        return found->second;
    }
    template <class T> T number(const char* tag) const {
        const std::string& from = text(tag);
        T value{};
        const auto [end, error] = std::from_chars(from.data(), from.data() + from.size(), value);
        if (error != std::errc() || end != from.data() + from.size())
            throw Error(ErrorKind::kInput, name_ + ": its " + tagName(tag) + " is '" + from +
                                               "', not a number; export it again");
        return value;
    }

private:
    const VdbTags& tags_;
    const std::string& name_;
};

} // namespace

VdbTags tagsOf(const Asset& asset) {
    const VoxelGrid& grid = asset.dag.grid;
    VdbTags tags = {{tagName("resolution"), std::to_string(grid.resolution())},
                    {tagName("origin_world_x"), exactText(grid.originWorld.x)},
                    {tagName("origin_world_y"), exactText(grid.originWorld.y)},
                    {tagName("origin_world_z"), exactText(grid.originWorld.z)},
                    {tagName("voxel_size_world"), exactText(grid.voxelSizeWorld)},
                    {tagName("scene"), asset.provenance.sceneName},
                    {tagName("scene_hash"), asset.provenance.sceneHash},
                    {tagName("program_version"), asset.provenance.programVersion},
                    {tagName("options"), asset.provenance.options}};
    tags[tagName("checksum")] = checksumOf(asset.dag, tags);
    return tags;
}

Asset assetOf(const VdbTags& tags, const std::string& name) {
    const TagReader read(tags, name);
    Asset asset;
    const auto resolution = read.number<uint32_t>("resolution");
    if (!std::has_single_bit(resolution) || resolution > 1u << kMaxResolutionLog2)
        throw Error(ErrorKind::kInput, name + ": its " + tagName("resolution") + " is " +
                                           std::to_string(resolution) +
                                           ", not a power of two up to 131072; export it again");
    VoxelGrid& grid = asset.dag.grid;
    grid.resolutionLog2 = uint32_t(std::countr_zero(resolution));
    grid.originWorld = {read.number<double>("origin_world_x"),
                        read.number<double>("origin_world_y"),
                        read.number<double>("origin_world_z")};
    grid.voxelSizeWorld = read.number<double>("voxel_size_world");
    if (!(grid.voxelSizeWorld > 0) || !std::isfinite(grid.voxelSizeWorld) ||
        !std::isfinite(grid.originWorld.x + grid.originWorld.y + grid.originWorld.z))
        throw Error(ErrorKind::kInput, name + ": its " + tagName("origin_world") + " or " +
                                           tagName("voxel_size_world") +
                                           " is not finite and positive; export it again");
    asset.provenance = {read.text("scene"), read.text("scene_hash"), read.text("program_version"),
                        read.text("options")};
    read.text("checksum");
    return asset;
}

std::string packTags(const VdbTags& tags) {
    std::string bytes;
    const auto append = [&](const std::string& text) {
        const uint32_t count = uint32_t(text.size());
        bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
        bytes += text;
    };
    for (const auto& [name, text] : tags) {
        append(name);
        append(text);
    }
    return bytes;
}

VdbTags unpackTags(const std::string& bytes, const std::string& name) {
    size_t at = 0;
    const auto take = [&] {
        uint32_t count = 0;
        if (bytes.size() - at >= sizeof count)
            std::memcpy(&count, bytes.data() + at, sizeof count);
        if (bytes.size() - at < sizeof count || bytes.size() - at - sizeof count < count)
            throw Error(ErrorKind::kInput, name + ": its tags end at byte " + std::to_string(at) +
                                               " inside a text; the file is damaged");
        const std::string text = bytes.substr(at + sizeof count, count);
        at += sizeof count + count;
        return text;
    };
    VdbTags tags;
    while (at < bytes.size()) {
        const std::string key = take();
        tags[key] = take();
    }
    return tags;
}

} // namespace shadowdag
