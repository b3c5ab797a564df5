// SPDX-License-Identifier: Apache-2.0
// Unpacks buffer views of EXT_meshopt_compression, and checks what unpacks others. Source: Khronos,
// glTF 2.0 extension EXT_meshopt_compression.
#include "scenes/gltf_reader.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

namespace shadowdag::gltf {

namespace {

// A constant vertex attribute takes a bit for eight bytes, a strip of triangles a byte for twelve;
// what a scene packs best, a flat grid, is below. Some room for tiny files.
constexpr uint64_t kUnpackLimit = 64, kUnpackFreeBytes = 16u << 20;

/// How a view is packed.
struct MeshoptView {
    uint64_t buffer, byteOffset, byteLength, byteStride, count;
    std::string mode, filter;
};

std::string textOr(const tinygltf::Value& object, const char* key, const char* otherwise) {
    return object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>()
                                                         : otherwise;
}

MeshoptView readView(const Document& document, const tinygltf::Value& extension,
                     const std::string& place) {
    const auto number = [&](const char* key, std::optional<uint64_t> otherwise = {}) {
        return wholeNumber(document, extension, key, place, otherwise);
    };
    const MeshoptView view{number("buffer"),
                           number("byteOffset", 0),
                           number("byteLength"),
                           number("byteStride"),
                           number("count"),
                           textOr(extension, "mode", ""),
                           textOr(extension, "filter", "NONE")};
    const uint64_t stride = view.byteStride;
    const bool isAttributes = view.mode == "ATTRIBUTES";
    if (!isAttributes && view.mode != "TRIANGLES" && view.mode != "INDICES")
        fail(document, place,
             "mode '" + view.mode.substr(0, 40) +
                 "' does not exist; ATTRIBUTES, TRIANGLES and INDICES do");
    if (isAttributes ? stride % 4 != 0 || stride < 4 || stride > 256 : stride != 2 && stride != 4)
        fail(document, place,
             "byteStride " + std::to_string(stride) + " does not fit mode " + view.mode);
    if (view.count == 0 || view.count > UINT32_MAX ||
        (view.mode == "TRIANGLES" && view.count % 3 != 0))
        fail(document, place,
             "count " + std::to_string(view.count) + " does not fit mode " + view.mode);
    const bool fits =
        view.filter == "NONE" || (isAttributes && ((view.filter == "OCTAHEDRAL" && stride <= 8) ||
                                                   (view.filter == "QUATERNION" && stride == 8) ||
                                                   view.filter == "EXPONENTIAL"));
    if (!fits)
        fail(document, place,
             "filter '" + view.filter.substr(0, 40) + "' does not fit mode " + view.mode +
                 " with byteStride " + std::to_string(stride));
    return view;
}

/// Returns whether the bytes could be unpacked into `to`.
bool unpackView(const MeshoptView& view, const uint8_t* from, std::vector<unsigned char>& to) {
    const size_t count = view.count, stride = view.byteStride, bytes = view.byteLength;
    if (view.mode == "TRIANGLES")
        return meshopt_decodeIndexBuffer(to.data(), count, stride, from, bytes) == 0;
    if (view.mode == "INDICES")
        return meshopt_decodeIndexSequence(to.data(), count, stride, from, bytes) == 0;
    if (meshopt_decodeVertexBuffer(to.data(), count, stride, from, bytes) != 0)
        return false;
    if (view.filter == "OCTAHEDRAL")
        meshopt_decodeFilterOct(to.data(), count, stride);
    else if (view.filter == "QUATERNION")
        meshopt_decodeFilterQuat(to.data(), count, stride);
    else if (view.filter == "EXPONENTIAL")
        meshopt_decodeFilterExp(to.data(), count, stride);
    return true;
}

} // namespace

uint64_t wholeNumber(const Document& document, const tinygltf::Value& object, const char* key,
                     const std::string& place, std::optional<uint64_t> otherwise) {
    if (otherwise && !object.Has(key))
        return *otherwise;
    const double value =
        object.Has(key) && object.Get(key).IsNumber() ? object.Get(key).GetNumberAsDouble() : -1.0;
    if (!(value >= 0.0 && value <= 0x1p53 && value == std::floor(value)))
        fail(document, place, std::string("'") + key + "' is missing, or no whole number from 0");
    return uint64_t(value);
}

const uint8_t* partOfBuffer(const Document& document, uint64_t buffer, uint64_t byteOffset,
                            uint64_t byteLength, const std::string& place) {
    const auto& buffers = document.model.buffers;
    if (buffer >= buffers.size())
        fail(document, place,
             "refers to buffer " + std::to_string(buffer) + " of " +
                 std::to_string(buffers.size()));
    const std::vector<unsigned char>& bytes = buffers[buffer].data;
    if (byteOffset > bytes.size() || byteLength > bytes.size() - byteOffset)
        fail(document, place,
             std::to_string(byteLength) + " bytes at " + std::to_string(byteOffset) +
                 " end beyond buffer " + std::to_string(buffer) + " of " +
                 std::to_string(bytes.size()) + " bytes");
    return bytes.data() + byteOffset;
}

void UnpackedBytes::add(uint64_t from, uint64_t to, const std::string& place) {
    from_ = std::min(inputBytes_, from_ + std::min(from, inputBytes_));
    to_ = to > UINT64_MAX - to_ ? UINT64_MAX : to_ + to;
    if (to_ > kUnpackFreeBytes + kUnpackLimit * from_)
        fail(document_, place,
             std::to_string(from) + " bytes claim to unpack to " + std::to_string(to) +
                 "; the counts are wrong");
    document_.inputBytes += to / 4; // they may grow by a quarter of what others may
}

void unpackMeshopt(Document& document) {
    UnpackedBytes unpacked(document);
    for (size_t v = 0; v < document.model.bufferViews.size(); ++v) {
        const auto& extensions = document.model.bufferViews[v].extensions;
        const auto found = extensions.find(kMeshoptCompression);
        if (found == extensions.end())
            continue;
        const std::string place =
            "bufferViews/" + std::to_string(v) + "/extensions/" + kMeshoptCompression;
        const MeshoptView view = readView(document, found->second, place);
        const uint8_t* const from =
            partOfBuffer(document, view.buffer, view.byteOffset, view.byteLength, place);
        unpacked.add(view.byteLength, view.count * view.byteStride, place);
        tinygltf::Buffer buffer;
        buffer.data.resize(view.count * view.byteStride);
        if (!unpackView(view, from, buffer.data))
            fail(document, place, "its bytes cannot be unpacked; the file is damaged");
        tinygltf::BufferView& target = document.model.bufferViews[v];
        target.buffer = int(document.model.buffers.size());
        target.byteOffset = 0;
        target.byteLength = buffer.data.size();
        document.model.buffers.push_back(std::move(buffer));
    }
}

} // namespace shadowdag::gltf
