// SPDX-License-Identifier: Apache-2.0
// Checksums of bytes: XXH3, 128 bits. Not cryptographic: it detects accidental damage, not
// manipulation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace shadowdag {

/// Returns the XXH3-128 hash of the bytes, canonical (big endian) order: the same on every machine.
std::array<uint8_t, 16> contentHash(const void* data, size_t byteCount);

/// Returns a hash as 32 hexadecimal digits.
std::string hashText(const std::array<uint8_t, 16>& hash);

/// The same as contentHash for bytes that arrive in pieces; the pieces' lengths do not matter.
class ContentHasher {
public:
    ContentHasher();
    ~ContentHasher();
    ContentHasher(ContentHasher&&) noexcept;
    ContentHasher& operator=(ContentHasher&&) noexcept;

    void add(const void* data, size_t byteCount);
    /// Returns the hash of all bytes added so far.
    std::array<uint8_t, 16> hash() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
