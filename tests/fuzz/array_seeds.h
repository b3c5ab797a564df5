// SPDX-License-Identifier: Apache-2.0
// Files of arrays for fuzz targets: read as the program reads them, and with checksums that fit.
#pragma once

#include "tools/workspace/array_file.h"

#include <algorithm>
#include <cstring>
#include <string>

namespace shadowdag::fuzz {

/// Returns the arrays of a file's bytes, as readArrays does.
inline std::vector<NamedArray> readBytes(std::string_view kind, const uint8_t* data, size_t size) {
    const std::string content(data, data + size);
    return content.starts_with("PK") ? decodeNpz(content, "file")
                                     : decodeArrays(kind, content, "file");
}

/// Returns a file of our own form with the length and the checksums of its content; others as they
/// are. The layout is that of docs/rays.md.
inline std::string withFittingSums(const std::string& content) {
    constexpr size_t kHeader = 32, kEntry = 64;
    std::string file = content;
    if (file.size() < kHeader || file.starts_with("PK"))
        return file;
    uint32_t count = 0;
    std::memcpy(&count, file.data() + 12, 4);
    const uint64_t length = file.size();
    std::memcpy(file.data() + 16, &length, 8);
    count = uint32_t(std::min<size_t>(count, (file.size() - kHeader) / kEntry));
    for (uint32_t i = 0; i < count; ++i) {
        char* const entry = file.data() + kHeader + i * kEntry;
        uint64_t offset = 0, bytes = 0;
        std::memcpy(&offset, entry + 40, 8);
        std::memcpy(&bytes, entry + 48, 8);
        if (offset > file.size() || bytes > file.size() - offset)
            continue;
        const uint32_t sum = crc32(file.data() + offset, bytes);
        std::memcpy(entry + 56, &sum, 4);
    }
    std::memset(file.data() + 24, 0, 4);
    const uint32_t sum = crc32(file.data(), kHeader + count * kEntry);
    std::memcpy(file.data() + 24, &sum, 4);
    return file;
}

} // namespace shadowdag::fuzz
