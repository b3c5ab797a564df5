// SPDX-License-Identifier: Apache-2.0
// Files of named arrays, to exchange data with other programs: our own, which can be mapped into
// memory, and numpy's .npz. docs/rays.md describes both. Readers refuse anything damaged, naming
// file, offset and what is wrong.
#pragma once

#include "cuda/error.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace shadowdag {

/// The elements of an array; the numbers are those of the file.
enum class ArrayType : uint32_t { kUint8 = 1, kUint32 = 2, kUint64 = 3, kFloat = 4, kDouble = 5 };

/// Returns the bytes of an element.
size_t bytesOf(ArrayType type);

/// A table of elements, row by row.
struct NamedArray {
    std::string name; ///< 1 to kMaxArrayName of a-z, 0-9 and '_'
    ArrayType type = ArrayType::kUint8;
    uint32_t columns = 1; ///< at least 1
    uint64_t rows = 0;
    std::vector<uint8_t> bytes; ///< rows * columns * bytesOf(type), little endian

    /// Returns element i of all; `T` must be the type's.
    template <class T> T at(uint64_t i) const {
        T value;
        std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
        return value;
    }
};

constexpr size_t kMaxArrayName = 23;
constexpr size_t kMaxArrayCount = 64;
constexpr uint64_t kMaxArrayFileBytes = uint64_t(1) << 36;

/// Returns the CRC-32 of bytes (ISO 3309, as zip and zlib have it), going on from another.
uint32_t crc32(const void* data, size_t byteCount, uint32_t before = 0);

/// Returns an array of `count` elements from memory.
template <class T>
NamedArray makeArray(const std::string& name, ArrayType type, const T* data, uint64_t rows,
                     uint32_t columns = 1) {
    NamedArray array{name, type, columns, rows, {}};
    array.bytes.resize(size_t(rows) * columns * bytesOf(type));
    if (!array.bytes.empty())
        std::memcpy(array.bytes.data(), data, array.bytes.size());
    return array;
}

/// Returns a file of arrays. @param kind eight characters, what the file is
std::string encodeArrays(std::string_view kind, const std::vector<NamedArray>& arrays);
/// Returns the arrays of a file. Throws Error kInput, beginning with `path`.
std::vector<NamedArray> decodeArrays(std::string_view kind, const std::string& content,
                                     const std::string& path);

/// Returns an uncompressed .npz. Throws Error kResource where it would exceed 4 GiB.
std::string encodeNpz(const std::vector<NamedArray>& arrays);
/// Returns the arrays of an .npz: of one or two axes, uncompressed, of the types above; bool is
/// kUint8, whole numbers with sign are kDouble, and a text is kUint8 with its bytes in UTF-8.
/// Throws Error kInput, beginning with `path`.
std::vector<NamedArray> decodeNpz(const std::string& content, const std::string& path);

/// Returns the content of a file of arrays: .npz by its first bytes, else of `kind`. Throws as the
/// decoders do, and Error kInput for a file that cannot be read.
std::vector<NamedArray> readArrays(std::string_view kind, const std::string& path);

/// Returns the array of a name. Throws Error kInput naming `path`, if there is none or it has
/// another type or number of columns.
const NamedArray& requireArray(const std::vector<NamedArray>& arrays, const std::string& path,
                               const std::string& name, ArrayType type, uint32_t columns);
/// Returns the array of a name, null if there is none.
const NamedArray* findArray(const std::vector<NamedArray>& arrays, const std::string& name);

/// What to do about most faults of a file.
constexpr const char* kWriteAgain = "write the file again, as docs/rays.md describes it";

/// Returns an Error kInput about a ray set or its answers (docs/rays.md): path, fault, remedy.
Error arrayError(const std::string& path, const std::string& what,
                 const std::string& remedy = kWriteAgain);

/// Reads whole values out of a file's content; what lies beyond its end is refused.
class ContentReader {
public:
    ContentReader(const std::string& content, const std::string& path)
        : content_(content), path_(path) {}

    [[noreturn]] void refuse(uint64_t offset, const std::string& what,
                             const std::string& remedy = kWriteAgain) const;
    /// Throws unless [offset, offset + count) lies in the file. @param what is read there
    void require(uint64_t offset, uint64_t count, const char* what) const;
    template <class T> T get(uint64_t offset, const char* what) const {
        require(offset, sizeof(T), what);
        T value;
        std::memcpy(&value, content_.data() + offset, sizeof(T));
        return value;
    }
    std::string_view text(uint64_t offset, uint64_t count, const char* what) const {
        require(offset, count, what);
        return std::string_view(content_).substr(offset, count);
    }
    uint64_t size() const { return content_.size(); }

private:
    const std::string& content_;
    const std::string& path_;
};

} // namespace shadowdag
