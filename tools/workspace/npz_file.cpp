// SPDX-License-Identifier: Apache-2.0
// numpy's .npz: a zip of .npy files. Sources: NumPy Enhancement Proposal 1, "A Simple File Format
// for NumPy Arrays"; PKWARE, APPNOTE, sections 4.3 and 4.4. What numpy.savez writes is read;
// compressed archives are not.
#include "cuda/error.h"
#include "tools/workspace/array_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace shadowdag {

namespace {

constexpr uint32_t kLocalSignature = 0x04034b50, kCentralSignature = 0x02014b50,
                   kEndSignature = 0x06054b50;
constexpr uint64_t kLocalBytes = 30, kCentralBytes = 46, kEndBytes = 22;
constexpr std::string_view kNumpy = "\x93NUMPY";

void put(std::string& out, uint64_t value, int byteCount) {
    for (int i = 0; i < byteCount; ++i)
        out.push_back(char(value >> (8 * i) & 255u));
}

std::string npyOf(const NamedArray& array) {
    const char* const types[] = {"|u1", "<u4", "<u8", "<f4", "<f8"};
    std::string shape = "(" + std::to_string(array.rows) + ",";
    shape += array.columns > 1 ? " " + std::to_string(array.columns) + ")" : ")";
    std::string text = std::string("{'descr': '") + types[size_t(array.type) - 1] +
                       "', 'fortran_order': False, 'shape': " + shape + ", }";
    constexpr size_t kBefore = 10; // magic, version, length
    text.append(63 - (kBefore + text.size()) % 64, ' ');
    text += '\n';
    std::string npy(kNumpy);
    put(npy, 1, 2); // version 1.0
    put(npy, text.size(), 2);
    return npy + text + std::string(array.bytes.begin(), array.bytes.end());
}

/// The element of an array as .npy names it.
struct NpyType {
    char kind; ///< u, i, f, b, or U for text
    size_t bytes;
};

/// The dictionary of a .npy: three keys in the form that numpy writes.
class NpyHeader {
public:
    NpyHeader(const ContentReader& reader, std::string_view text, uint64_t offset)
        : reader_(reader), text_(text), offset_(offset) {}

    NpyType type() const {
        const std::string_view quoted = valueOf("'descr':");
        const size_t end = quoted.size() > 1 ? quoted.find('\'', 1) : std::string_view::npos;
        if (end == std::string_view::npos || quoted[0] != '\'' || end < 4)
            refuse("'descr' is no text of a type");
        NpyType type{quoted[2], 0};
        const std::string_view digits = quoted.substr(3, end - 3);
        const auto [last, failed] =
            std::from_chars(digits.data(), digits.data() + digits.size(), type.bytes);
        const bool isOrdered = quoted[1] == '<' || quoted[1] == '|';
        const bool isKnown = type.kind == 'U'   ? type.bytes <= 65536
                             : type.kind == 'b' ? type.bytes == 1
                             : type.kind == 'f' ? type.bytes == 4 || type.bytes == 8
                             : type.kind == 'u'
                                 ? type.bytes == 1 || type.bytes == 4 || type.bytes == 8
                                 : type.kind == 'i' && (type.bytes == 4 || type.bytes == 8);
        if (failed != std::errc() || last != digits.data() + digits.size() || !isOrdered ||
            !isKnown)
            refuse("type " + std::string(quoted.substr(0, end + 1)) +
                   "; known are '<f4', '<f8', '|u1', '<u4', '<u8', '<i4', '<i8', '|b1' and texts");
        return type;
    }
    bool isFortran() const { return valueOf("'fortran_order':").starts_with("True"); }
    std::vector<uint64_t> shape() const {
        const std::string_view from = valueOf("'shape':");
        const size_t end = from.find(')');
        if (!from.starts_with('(') || end == std::string_view::npos)
            refuse("'shape' is no list of lengths");
        std::vector<uint64_t> lengths;
        for (size_t at = 1; at < end;) {
            if (from[at] == ' ' || from[at] == ',') {
                ++at;
                continue;
            }
            uint64_t length = 0;
            const auto [last, failed] =
                std::from_chars(from.data() + at, from.data() + end, length);
            if (failed != std::errc())
                refuse("'shape' is no list of lengths");
            lengths.push_back(length);
            at = size_t(last - from.data());
        }
        return lengths;
    }
    [[noreturn]] void refuse(const std::string& what) const { reader_.refuse(offset_, what); }

private:
    std::string_view valueOf(std::string_view key) const {
        const size_t at = text_.find(key);
        if (at == std::string_view::npos)
            refuse("its header has no key " + std::string(key));
        const size_t value = text_.find_first_not_of(' ', at + key.size());
        return value == std::string_view::npos ? std::string_view() : text_.substr(value);
    }

    const ContentReader& reader_;
    std::string_view text_;
    uint64_t offset_;
};

/// Returns code points as UTF-8, up to the first 0, which pads texts.
std::vector<uint8_t> utf8Of(std::string_view codes) {
    std::vector<uint8_t> text;
    for (size_t i = 0; i + 4 <= codes.size(); i += 4) {
        uint32_t code;
        std::memcpy(&code, codes.data() + i, 4);
        if (code == 0)
            break;
        if (code < 0x80) {
            text.push_back(uint8_t(code));
            continue;
        }
        code = code > 0x10ffff ? 0xfffd : code;
        const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
        constexpr uint8_t kLeads[] = {0, 0xc0, 0xe0, 0xf0};
        text.push_back(uint8_t(kLeads[more] | code >> (6 * more)));
        for (int k = more - 1; k >= 0; --k)
            text.push_back(uint8_t(0x80 | (code >> (6 * k) & 0x3f)));
    }
    return text;
}

template <class T> void widen(NamedArray& array, std::string_view values) {
    array.type = ArrayType::kDouble;
    array.bytes.resize(values.size() / sizeof(T) * sizeof(double));
    for (size_t i = 0; i < values.size() / sizeof(T); ++i) {
        T value;
        std::memcpy(&value, values.data() + i * sizeof(T), sizeof(T));
        const auto wide = double(value);
        std::memcpy(array.bytes.data() + i * sizeof wide, &wide, sizeof wide);
    }
}

/// Reads a .npy that lies in [offset, offset + size) of the file.
NamedArray readNpy(const ContentReader& reader, const std::string& name, uint64_t offset,
                   uint64_t size) {
    const auto within = [&](uint64_t count, const char* what) {
        if (count > size)
            reader.refuse(offset, "array \"" + name + "\" ends before " + what + " does");
    };
    within(12, "its header");
    if (reader.text(offset, kNumpy.size(), "an array") != kNumpy)
        reader.refuse(offset, "array \"" + name + "\" is no .npy");
    const auto major = reader.get<uint8_t>(offset + 6, "an array's version");
    if (major < 1 || major > 3)
        reader.refuse(offset + 6, "array \"" + name + "\": version " + std::to_string(major) +
                                      " of .npy; known are 1 to 3");
    const uint64_t length = major == 1 ? reader.get<uint16_t>(offset + 8, "an array's header")
                                       : reader.get<uint32_t>(offset + 8, "an array's header");
    const uint64_t before = major == 1 ? 10 : 12;
    within(before + length, "its header");
    const NpyHeader header(reader, reader.text(offset + before, length, "an array's header"),
                           offset + before);
    const NpyType type = header.type();
    const std::vector<uint64_t> shape = header.shape();
    NamedArray array;
    array.name = name;
    if (shape.size() > 2 || (shape.size() == 2 && header.isFortran()))
        header.refuse("array \"" + name + "\" must have one or two axes, row by row");
    array.rows = shape.empty() ? 1 : shape[0];
    const uint64_t columns = shape.size() == 2 ? shape[1] : 1;
    const uint64_t elementBytes = type.kind == 'U' ? 4 * type.bytes : type.bytes;
    const uint64_t left = size - before - length;
    if (columns == 0 || columns > 65536 ||
        array.rows > kMaxArrayFileBytes / (columns * std::max<uint64_t>(elementBytes, 1)) ||
        array.rows * columns * elementBytes != left)
        header.refuse("array \"" + name + "\" has " + std::to_string(left) +
                      " bytes, not those of its shape");
    array.columns = uint32_t(columns);
    const std::string_view values = reader.text(offset + before + length, left, "an array");
    if (type.kind == 'U') {
        array.bytes = utf8Of(values);
        array.rows = array.bytes.size();
        array.columns = 1;
    } else if (type.kind == 'i') {
        type.bytes == 4 ? widen<int32_t>(array, values) : widen<int64_t>(array, values);
    } else {
        array.type = type.kind == 'f'  ? (type.bytes == 4 ? ArrayType::kFloat : ArrayType::kDouble)
                     : type.bytes == 1 ? ArrayType::kUint8
                     : type.bytes == 4 ? ArrayType::kUint32
                                       : ArrayType::kUint64;
        array.bytes.assign(values.begin(), values.end());
    }
    return array;
}

} // namespace

std::string encodeNpz(const std::vector<NamedArray>& arrays) {
    std::string file, central;
    for (const NamedArray& array : arrays) {
        const std::string npy = npyOf(array), name = array.name + ".npy";
        if (file.size() + npy.size() + kLocalBytes + name.size() > 0xfffffffeu)
            throw Error(ErrorKind::kResource, "an .npz over 4 GiB cannot be written; write .rays, "
                                              "or a smaller --size");
        std::string fields;         // of local and central headers alike
        put(fields, 20, 2);         // version that is needed
        put(fields, 0, 2);          // flags
        put(fields, 0, 2);          // stored
        put(fields, 0x00210000, 4); // no time; 1980-01-01
        put(fields, crc32(npy.data(), npy.size()), 4);
        put(fields, npy.size(), 4);
        put(fields, npy.size(), 4);
        put(fields, name.size(), 2);
        put(fields, 0, 2); // no more fields
        put(central, kCentralSignature, 4);
        put(central, 20, 2); // version that wrote it
        central += fields;
        put(central, 0, 2); // no comment
        put(central, 0, 2); // disk
        put(central, 0, 6); // attributes
        put(central, file.size(), 4);
        central += name;
        put(file, kLocalSignature, 4);
        file += fields + name + npy;
    }
    const uint64_t centralOffset = file.size();
    file += central;
    put(file, kEndSignature, 4);
    put(file, 0, 4); // disks
    put(file, arrays.size(), 2);
    put(file, arrays.size(), 2);
    put(file, central.size(), 4);
    put(file, centralOffset, 4);
    put(file, 0, 2); // no comment
    return file;
}

std::vector<NamedArray> decodeNpz(const std::string& content, const std::string& path) {
    const ContentReader reader(content, path);
    if (content.size() < kEndBytes)
        reader.refuse(content.size(), "the file ends before the end of an .npz does");
    const uint64_t end = content.size() - kEndBytes; // archives with a comment are none of numpy's
    if (reader.get<uint32_t>(end, "the end of the archive") != kEndSignature)
        reader.refuse(end, "no .npz ends like this", "write it again with numpy.savez");
    const auto count = reader.get<uint16_t>(end + 10, "the number of arrays");
    if (count > kMaxArrayCount)
        reader.refuse(end + 10, std::to_string(count) + " arrays; " +
                                    std::to_string(kMaxArrayCount) + " at most");
    uint64_t at = reader.get<uint32_t>(end + 16, "the archive's directory");
    std::vector<NamedArray> arrays;
    uint64_t endBefore = 0; // of the last array: bytes are those of one alone
    for (uint32_t i = 0; i < count; ++i) {
        if (reader.get<uint32_t>(at, "an entry of the directory") != kCentralSignature)
            reader.refuse(at, "this is no entry of the archive's directory");
        const auto flags = reader.get<uint16_t>(at + 8, "an entry");
        const auto method = reader.get<uint16_t>(at + 10, "an entry");
        const auto crc = reader.get<uint32_t>(at + 16, "an entry");
        const uint64_t packed = reader.get<uint32_t>(at + 20, "an entry"),
                       size = reader.get<uint32_t>(at + 24, "an entry"),
                       nameBytes = reader.get<uint16_t>(at + 28, "an entry"),
                       extra = reader.get<uint16_t>(at + 30, "an entry"),
                       comment = reader.get<uint16_t>(at + 32, "an entry"),
                       local = reader.get<uint32_t>(at + 42, "an entry");
        std::string name(reader.text(at + kCentralBytes, nameBytes, "an entry's name"));
        if (!name.ends_with(".npy") || name.size() > kMaxArrayName + 4)
            reader.refuse(at, "the entry '" + name + "' is no array of an .npz");
        name.resize(name.size() - 4);
        if (method != 0 || (flags & 1u) != 0)
            reader.refuse(at + 10, "array \"" + name + "\" is compressed",
                          "write it with numpy.savez");
        if (packed != size || size == 0xffffffffu || local == 0xffffffffu)
            reader.refuse(at + 20, "array \"" + name + "\" is of an archive over 4 GiB",
                          "write .rays");
        if (local < endBefore)
            reader.refuse(at + 42, "array \"" + name + "\" begins before the end of the last one",
                          "write it with numpy.savez");
        if (reader.get<uint32_t>(local, "an array's head") != kLocalSignature)
            reader.refuse(local, "array \"" + name + "\" does not begin here");
        const uint64_t offset = local + kLocalBytes +
                                reader.get<uint16_t>(local + 26, "an array's head") +
                                reader.get<uint16_t>(local + 28, "an array's head");
        endBefore = offset + size;
        const std::string_view npy = reader.text(offset, size, "an array");
        if (crc32(npy.data(), npy.size()) != crc)
            reader.refuse(offset, "array \"" + name + "\": its checksum is another",
                          "copy the file again");
        if (findArray(arrays, name))
            reader.refuse(at, "array \"" + name + "\" occurs twice");
        arrays.push_back(readNpy(reader, name, offset, size));
        at += kCentralBytes + nameBytes + extra + comment;
    }
    return arrays;
}

} // namespace shadowdag
