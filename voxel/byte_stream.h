// SPDX-License-Identifier: Apache-2.0
// Reading and writing the headers of assets and part files as bytes. Little endian, no padding.
#pragma once

#include "cuda/error.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace shadowdag {

static_assert(std::endian::native == std::endian::little,
              "values are copied in their byte order in memory");

/// A checksum as contentHash() returns it.
using Checksum = std::array<uint8_t, 16>;

/// Texts in headers are cut to this many bytes.
constexpr uint32_t kMaxTextBytes = 4096;

class ByteWriter {
public:
    template <class T> void put(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes(&value, sizeof(T));
    }
    /// Length (4 bytes), then the text.
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

/// Reads bytes from the start, never past the end. Throws Error kInput; messages begin with `name`.
class ByteReader {
public:
    /// @param bytes outlives the reader
    /// @param name what the file is and where, as in "asset a.svdag"
    ByteReader(const std::vector<uint8_t>& bytes, const std::string& name)
        : bytes_(bytes), name_(name) {}

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput, name_ + ": " + what);
    }
    const uint8_t* take(uint64_t count, const char* what) {
        if (count > left())
            fail("ends at byte " + std::to_string(bytes_.size()) + " inside " + what + " (byte " +
                 std::to_string(offset_) + ", " + std::to_string(count) +
                 " bytes); the file is cut off, copy or build it again");
        const uint8_t* at = bytes_.data() + offset_;
        offset_ += count;
        return at;
    }
    template <class T> T take(const char* what) {
        T value;
        std::memcpy(&value, take(sizeof(T), what), sizeof(T));
        return value;
    }
    std::string text(const char* what) {
        const uint32_t count = take<uint32_t>(what);
        if (count > kMaxTextBytes)
            fail(std::string(what) + " claims " + std::to_string(count) + " bytes, more than " +
                 std::to_string(kMaxTextBytes) + "; the file is damaged");
        const uint8_t* at = take(count, what);
        return std::string(at, at + count);
    }
    uint64_t offset() const { return offset_; }
    uint64_t left() const { return bytes_.size() - offset_; }

private:
    const std::vector<uint8_t>& bytes_;
    const std::string name_;
    uint64_t offset_ = 0;
};

} // namespace shadowdag
