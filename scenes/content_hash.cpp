// SPDX-License-Identifier: Apache-2.0
#include "scenes/content_hash.h"

#include <xxhash.h>

#include <cstring>

namespace shadowdag {

std::array<uint8_t, 16> contentHash(const void* data, size_t byteCount) {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits(data, byteCount));
    std::array<uint8_t, 16> hash;
    std::memcpy(hash.data(), canonical.digest, hash.size());
    return hash;
}

} // namespace shadowdag
