// SPDX-License-Identifier: Apache-2.0
// The text of a glTF document before tinygltf parses it: what tinygltf does not bound, and what it
// would refuse although this reader can read it.
#pragma once

#include "scenes/gltf_reader.h"

#include "scenes/data_uri.h"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace shadowdag::gltf {

/// The lists of a document, in the order in which tinygltf reads them.
constexpr std::array<std::string_view, 13> kLists = {
    "buffers", "bufferViews", "accessors",  "meshes", "nodes",    "scenes", "materials",
    "images",  "textures",    "animations", "skins",  "samplers", "cameras"};

/// What the scan of a document's text finds.
struct JsonSummary {
    struct Buffer {
        std::string uri;
        uint64_t byteLength = 0;
        bool isAbsent = false; ///< EXT_meshopt_compression: what is unpacked would go there
    };
    std::vector<Buffer> buffers;
    std::vector<DataUri> dataUris; ///< of buffers and images; the URI "data:I" stands for the I-th
    std::array<uint64_t, kLists.size()> elementCounts{}; ///< objects in each list
};

/// Scans the text and returns its buffers and the data within it. Throws Error kInput beyond a
/// depth of 256 levels, two million objects, or a memory for them of 64 MiB and 64 times the text.
/// Changes the text in place:
///  - data URIs of buffers and images, which are decoded, become short ones;
///  - values of "extras", which may hold anything and are not used, become 0;
///  - a buffer without "uri" of EXT_meshopt_compression, which has no data, becomes one of a byte;
///  - the key "indices" of primitives of KHR_draco_mesh_compression gets another name, because
///    their accessors have no data: unpackDraco adds it.
/// Text that is not JSON passes through; the parser reports it.
JsonSummary screenJson(const Document& document, char* text, size_t length);

} // namespace shadowdag::gltf
