// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/array_file.h"

#include "cuda/macros.h"
#include "scenes/input_file.h"

#include <algorithm>
#include <bit>

namespace shadowdag {

namespace {

static_assert(std::endian::native == std::endian::little, "files are written as memory has them");

constexpr uint32_t kVersion = 1;
constexpr uint64_t kAlignment = 64; ///< of sections, so that a mapped file's arrays are aligned
constexpr size_t kHeaderBytes = 32, kEntryBytes = 64;

/// The head of a file; the entries of its arrays follow.
struct FileHeader {
    char kind[8];
    uint32_t version, arrayCount;
    uint64_t fileBytes;
    uint32_t crc; ///< of this with 0 here, and of all entries
    uint32_t zero;
};
static_assert(sizeof(FileHeader) == kHeaderBytes);

struct FileEntry {
    char name[kMaxArrayName + 1]; ///< the rest is 0
    uint32_t type, columns;
    uint64_t rows, offset, bytes;
    uint32_t crc; ///< of the array's bytes
    uint32_t zero;
};
static_assert(sizeof(FileEntry) == kEntryBytes);

uint64_t aligned(uint64_t offset) {
    return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

bool isName(const std::string& name) {
    return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    });
}

constexpr std::array<uint32_t, 256> makeCrcTable() {
    std::array<uint32_t, 256> table{};
    for (uint32_t i = 0; i < 256; ++i) {
        uint32_t value = i;
        for (int bit = 0; bit < 8; ++bit)
            value = value & 1u ? 0xedb88320u ^ (value >> 1) : value >> 1;
        table[i] = value;
    }
    return table;
}
constexpr std::array<uint32_t, 256> kCrcTable = makeCrcTable();

/// Reads an entry and its array. @param end of what was read before; receives this array's
NamedArray readEntry(const ContentReader& reader, uint64_t at, uint64_t& end) {
    const auto entry = reader.get<FileEntry>(at, "an array's entry");
    if (entry.name[kMaxArrayName] != 0)
        reader.refuse(at, "an array's name is longer than " + std::to_string(kMaxArrayName));
    NamedArray array;
    array.name = entry.name;
    if (!isName(array.name))
        reader.refuse(at, "an array's name has other characters than a-z, 0-9 and '_'");
    const std::string which = "array \"" + array.name + "\": ";
    if (entry.type < uint32_t(ArrayType::kUint8) || entry.type > uint32_t(ArrayType::kDouble))
        reader.refuse(at + 24, which + "type " + std::to_string(entry.type) + " is none of 1 to 5");
    array.type = ArrayType(entry.type);
    array.columns = entry.columns;
    array.rows = entry.rows;
    if (entry.columns == 0)
        reader.refuse(at + 28, which + "has 0 columns");
    const uint64_t rowBytes = uint64_t(entry.columns) * bytesOf(array.type);
    if (entry.rows > kMaxArrayFileBytes / rowBytes || entry.rows * rowBytes != entry.bytes)
        reader.refuse(at + 48, which + std::to_string(entry.bytes) + " bytes are not those of " +
                                   std::to_string(entry.rows) + " rows");
    if (entry.offset != aligned(end))
        reader.refuse(at + 40, which + "starts at " + std::to_string(entry.offset) + ", not at " +
                                   std::to_string(aligned(end)));
    const std::string_view bytes = reader.text(entry.offset, entry.bytes, "the bytes of an array");
    for (const char c : reader.text(end, entry.offset - end, "the space before an array"))
        if (c != 0)
            reader.refuse(end, "the space before array \"" + array.name + "\" is not 0");
    if (crc32(bytes.data(), bytes.size()) != entry.crc)
        reader.refuse(entry.offset, which + "its checksum is another", "copy the file again");
    array.bytes.assign(bytes.begin(), bytes.end());
    end = entry.offset + entry.bytes;
    return array;
}

} // namespace

size_t bytesOf(ArrayType type) {
    switch (type) {
    case ArrayType::kUint8:
        return 1;
    case ArrayType::kUint32:
    case ArrayType::kFloat:
        return 4;
    case ArrayType::kUint64:
    case ArrayType::kDouble:
        break;
    }
    return 8;
}

uint32_t crc32(const void* data, size_t byteCount, uint32_t before) {
    uint32_t crc = ~before;
    const auto* const bytes = static_cast<const uint8_t*>(data);
    for (size_t i = 0; i < byteCount; ++i)
        crc = kCrcTable[(crc ^ bytes[i]) & 255u] ^ (crc >> 8);
    return ~crc;
}

std::string encodeArrays(std::string_view kind, const std::vector<NamedArray>& arrays) {
    FileHeader header{};
    std::copy_n(kind.begin(), std::min(kind.size(), sizeof header.kind), header.kind);
    header.version = kVersion;
    header.arrayCount = uint32_t(arrays.size());
    std::vector<FileEntry> entries;
    uint64_t end = kHeaderBytes + arrays.size() * kEntryBytes;
    for (const NamedArray& array : arrays) {
        SDAG_ASSERT(isName(array.name) && array.name.size() <= kMaxArrayName);
        FileEntry entry{};
        array.name.copy(entry.name, kMaxArrayName);
        entry.type = uint32_t(array.type);
        entry.columns = array.columns;
        entry.rows = array.rows;
        entry.offset = aligned(end);
        entry.bytes = array.bytes.size();
        entry.crc = crc32(array.bytes.data(), array.bytes.size());
        end = entry.offset + entry.bytes;
        entries.push_back(entry);
    }
    header.fileBytes = end;
    header.crc = crc32(entries.data(), entries.size() * kEntryBytes, crc32(&header, kHeaderBytes));
    std::string content(end, '\0');
    std::memcpy(content.data(), &header, kHeaderBytes);
    for (size_t i = 0; i < arrays.size(); ++i) {
        std::memcpy(content.data() + kHeaderBytes + i * kEntryBytes, &entries[i], kEntryBytes);
        std::copy(arrays[i].bytes.begin(), arrays[i].bytes.end(),
                  content.begin() + ptrdiff_t(entries[i].offset));
    }
    return content;
}

std::vector<NamedArray> decodeArrays(std::string_view kind, const std::string& content,
                                     const std::string& path) {
    const ContentReader reader(content, path);
    auto header = reader.get<FileHeader>(0, "the header");
    if (std::string_view(header.kind, sizeof header.kind) != kind)
        reader.refuse(0, "it does not begin with \"" + std::string(kind) + "\"");
    if (header.version != kVersion)
        reader.refuse(8, "version " + std::to_string(header.version) + "; this program reads " +
                             std::to_string(kVersion));
    if (header.arrayCount > kMaxArrayCount)
        reader.refuse(12, std::to_string(header.arrayCount) + " arrays; " +
                              std::to_string(kMaxArrayCount) + " at most");
    if (header.fileBytes != content.size())
        reader.refuse(16, "the file has " + std::to_string(content.size()) + " bytes, not " +
                              std::to_string(header.fileBytes));
    const uint32_t crc = header.crc;
    header.crc = 0;
    uint64_t end = kHeaderBytes + header.arrayCount * kEntryBytes;
    const std::string_view table =
        reader.text(kHeaderBytes, end - kHeaderBytes, "the table of arrays");
    if (crc32(table.data(), table.size(), crc32(&header, kHeaderBytes)) != crc)
        reader.refuse(24, "the header's checksum is another", "copy the file again");
    std::vector<NamedArray> arrays;
    for (uint32_t i = 0; i < header.arrayCount; ++i) {
        NamedArray array = readEntry(reader, kHeaderBytes + i * kEntryBytes, end);
        if (findArray(arrays, array.name))
            reader.refuse(kHeaderBytes + i * kEntryBytes,
                          "array \"" + array.name + "\" occurs twice");
        arrays.push_back(std::move(array));
    }
    if (end != content.size())
        reader.refuse(end, "bytes follow the last array");
    return arrays;
}

std::vector<NamedArray> readArrays(std::string_view kind, const std::string& path) {
    std::string why;
    const std::optional<std::string> content = readInput(path, {kMaxArrayFileBytes}, why);
    if (!content)
        throw Error(ErrorKind::kInput, path + ": " + why + "; give a file of docs/rays.md");
    return content->starts_with("PK") ? decodeNpz(*content, path)
                                      : decodeArrays(kind, *content, path);
}

const NamedArray* findArray(const std::vector<NamedArray>& arrays, const std::string& name) {
    const auto found = std::find_if(arrays.begin(), arrays.end(),
                                    [&](const NamedArray& array) { return array.name == name; });
    return found == arrays.end() ? nullptr : &*found;
}

const NamedArray& requireArray(const std::vector<NamedArray>& arrays, const std::string& path,
                               const std::string& name, ArrayType type, uint32_t columns) {
    const NamedArray* array = findArray(arrays, name);
    if (!array)
        throw arrayError(path, "has no array \"" + name + "\"");
    if (array->type != type || array->columns != columns)
        throw arrayError(
            path, "array \"" + name + "\" has type " + std::to_string(uint32_t(array->type)) +
                      " and " + std::to_string(array->columns) + " columns; it needs type " +
                      std::to_string(uint32_t(type)) + " and " + std::to_string(columns));
    return *array;
}

Error arrayError(const std::string& path, const std::string& what, const std::string& remedy) {
    return Error(ErrorKind::kInput, path + ": " + what + "; " + remedy);
}

void ContentReader::refuse(uint64_t offset, const std::string& what,
                           const std::string& remedy) const {
    throw arrayError(path_, "at byte " + std::to_string(offset) + ": " + what, remedy);
}

void ContentReader::require(uint64_t offset, uint64_t count, const char* what) const {
    if (offset > content_.size() || count > content_.size() - offset)
        refuse(offset, std::string("the file ends before ") + what + " does");
}

} // namespace shadowdag
