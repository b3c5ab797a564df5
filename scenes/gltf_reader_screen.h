// SPDX-License-Identifier: Apache-2.0
// The text of a glTF document before tinygltf parses it: what tinygltf does not bound, and what it
// would refuse although this reader can read it.
#pragma once

#include "scenes/gltf_reader.h"

#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag::gltf {

/// What the scan of a document's text finds.
struct JsonSummary {
    struct Buffer {
        std::string uri;
        uint64_t byteLength = 0;
        bool isAbsent = false; ///< EXT_meshopt_compression: what is unpacked would go there
    };
    std::vector<Buffer> buffers;
};

/// Scans the text and returns its buffers. Throws Error kInput beyond a depth of 256 levels or two
/// million objects. Changes the text in place:
///  - values of "extras", which may hold anything and are not used, become 0;
///  - a buffer without "uri" of EXT_meshopt_compression, which has no data, becomes one of a byte;
///  - the key "indices" of primitives of KHR_draco_mesh_compression gets another name, because
///    their accessors have no data: unpackDraco adds it.
/// Text that is not JSON passes through; the parser reports it.
JsonSummary screenJson(const Document& document, char* text, size_t length);

} // namespace shadowdag::gltf
