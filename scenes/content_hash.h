// SPDX-License-Identifier: Apache-2.0
// Checksums of bytes: XXH3, 128 bits. Not cryptographic: it finds accidents, not attackers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace shadowdag {

/// Returns the XXH3-128 hash of the bytes, canonical (big endian) order: the same on every machine.
std::array<uint8_t, 16> contentHash(const void* data, size_t byteCount);

} // namespace shadowdag
