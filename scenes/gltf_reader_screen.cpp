// SPDX-License-Identifier: Apache-2.0
#include "scenes/gltf_reader_screen.h"

#include "scenes/data_uri.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <initializer_list>
#include <string_view>

namespace shadowdag::gltf {

namespace {

// Deeper than any glTF; tinygltf recurses over what nests.
constexpr int kMaxDepth = 256;
// More than the largest scenes that exporters write.
constexpr uint64_t kMaxObjectCount = 2'000'000;
// Each takes tinygltf 2.5 KB, however short it is; large scenes have hundreds.
constexpr uint64_t kMaxMaterialCount = 16'384;

// Elements of glTF become objects of hundreds of bytes, however short their text is. As accessors
// may (gltf_reader_accessors.cpp), they may take 64 times the text that states them; files of a
// million honest elements take half of that.
constexpr uint64_t kParsedGrowthLimit = 64;
constexpr uint64_t kFreeParsedBytes = 64u << 20;

/// What an element of a list takes at most, as measured: tinygltf's object, three times while its
/// vector grows, its JSON, and what Scene has of it. Objects within it are counted for themselves.
struct ElementCost {
    std::string_view list; ///< of the document
    int depth;             ///< of the list that the element is in
    uint64_t bytes;
};
constexpr ElementCost kElementCosts[] = {
    {"nodes", 2, 1500},      {"meshes", 2, 1350},      {"meshes", 4, 1700},
    {"scenes", 2, 1100},     {"bufferViews", 2, 1650}, {"accessors", 2, 1900},
    {"images", 2, 1200},     {"textures", 2, 1050},    {"samplers", 2, 1050},
    {"skins", 2, 1700},      {"buffers", 2, 1650},     {"animations", 2, 1150},
    {"animations", 4, 1800}, {"cameras", 2, 4000},     {"extensions", 4, 2200},
};
constexpr uint64_t kObjectBytes = 200; // of JSON, anywhere else
constexpr uint64_t kValueBytes = 300;  // within "extensions", whose values tinygltf keeps
constexpr uint64_t kKeptObjectBytes = 600;

/// A part of the text; empty where there is none.
struct Span {
    size_t from = 0, end = 0;
    bool empty() const { return from == end; }
};

/// Scans a text; see screenJson.
class Screen {
public:
    Screen(const Document& document, char* text, size_t length)
        : document_(document), text_(text), length_(length) {}

    JsonSummary scan() {
        for (size_t i = 0; i < length_; ++i)
            switch (text_[i]) {
            case '"': {
                const size_t start = i + 1;
                for (++i; i < length_ && text_[i] != '"'; ++i)
                    if (text_[i] == '\\')
                        ++i;
                if (i >= length_)
                    return std::move(summary_);
                const size_t colon = skipSpace(i + 1);
                if (colon < length_ && text_[colon] == ':')
                    takeKey(std::string_view(text_ + start, i - start), start, colon);
                break;
            }
            case '{':
                addElement();
                if (++objectCount_ > kMaxObjectCount)
                    fail(document_, "JSON",
                         "more than " + std::to_string(kMaxObjectCount) +
                             " objects; split the scene");
                if (depth_ == 2 && topKey_ == "materials" && ++materialCount_ > kMaxMaterialCount)
                    fail(document_, "materials",
                         "more than " + std::to_string(kMaxMaterialCount) +
                             "; join those that are alike");
                beginObject();
                [[fallthrough]];
            case '[':
                addValue();
                if (++depth_ > kMaxDepth)
                    fail(document_, "JSON",
                         "nested deeper than " + std::to_string(kMaxDepth) + " levels at byte " +
                             std::to_string(i));
                break;
            case '}':
                endObject(i);
                [[fallthrough]];
            case ']':
                endExtras(i);
                endExtensions();
                --depth_;
                break;
            case ',':
                endExtras(i);
                endExtensions();
                addValue();
                break;
            default:
                break;
            }
        return std::move(summary_);
    }

private:
    size_t skipSpace(size_t i) const {
        while (i < length_ && text_[i] != 0 && std::strchr(" \t\r\n", text_[i]))
            ++i;
        return i;
    }

    /// Depths: 1 the document, 3 a buffer or a mesh, 4 a buffer's extensions, 5 a primitive, 6 its
    /// extensions. @param start of the key without its quote
    void takeKey(std::string_view key, size_t start, size_t colon) {
        if (depth_ == 1) {
            if (key.find('\\') != std::string_view::npos)
                fail(document_, "JSON",
                     "the top-level key \"" + std::string(key) +
                         "\" contains escape sequences; write it without");
            topKey_ = key;
            list_ = listOf(key);
        }
        if (topKey_ == "extensions" && depth_ == 2)
            extension_ = key;
        if (key == "extensions" && extensionsDepth_ < 0)
            extensionsDepth_ = depth_;
        checkType(key, skipSpace(colon + 1));
        if (key == "uri" && depth_ == 3 && (topKey_ == "buffers" || topKey_ == "images"))
            takeDataUri(skipSpace(colon + 1));
        if (topKey_ == "buffers" && !summary_.buffers.empty())
            takeBufferKey(key, start, skipSpace(colon + 1));
        if (topKey_ == "meshes" && depth_ == 5) {
            isInExtensions_ = key == "extensions";
            if (key == "indices")
                indicesAt_ = start;
        }
        if (topKey_ == "meshes" && depth_ == 6 && isInExtensions_ && key == kDracoCompression)
            isDraco_ = true;
        if (key == "extras" && extrasDepth_ < 0) {
            extrasDepth_ = depth_;
            extrasFrom_ = colon + 1;
        }
    }

    /// Throws where a value that matters to shadows is of another type than glTF gives it: tinygltf
    /// would take the default without a word. @param value where it begins
    void checkType(std::string_view key, size_t value) const {
        const auto isOneOf = [key](std::initializer_list<std::string_view> keys) {
            return std::find(keys.begin(), keys.end(), key) != keys.end();
        };
        const bool isNode = topKey_ == "nodes" && depth_ == 3;
        const bool isLight = topKey_ == "extensions" && extension_ == "KHR_lights_punctual";
        const bool isList =
            (isNode && isOneOf({"translation", "rotation", "scale", "matrix", "children"})) ||
            (isLight && depth_ == 5 && key == "color");
        const bool isNumber =
            (isNode && isOneOf({"mesh", "skin", "camera"})) ||
            (isLight && depth_ == 5 && isOneOf({"intensity", "range"})) ||
            (isLight && depth_ == 6 && isOneOf({"innerConeAngle", "outerConeAngle"})) ||
            (topKey_ == "materials" && depth_ == 3 && key == "alphaCutoff");
        const char first = value < length_ ? text_[value] : '\0';
        if (isList && first != '[')
            fail(document_, std::string(topKey_) + "/.../" + std::string(key),
                 "is no list; export the file again");
        if (isNumber && first != '-' && !(first >= '0' && first <= '9'))
            fail(document_, std::string(topKey_) + "/.../" + std::string(key),
                 "is no number; export the file again");
    }

    void takeBufferKey(std::string_view key, size_t start, size_t value) {
        JsonSummary::Buffer& buffer = summary_.buffers.back();
        if (depth_ == 4 && isInExtensions_ && key == kMeshoptCompression)
            buffer.isAbsent = true;
        if (depth_ != 3)
            return;
        isInExtensions_ = key == "extensions";
        if (isInExtensions_)
            extensions_ = {start - 1, start - 1};
        if (key == "byteLength") {
            const char* const end =
                std::from_chars(text_ + value, text_ + length_, buffer.byteLength).ptr;
            byteLength_ = {value, size_t(end - text_)};
        } else if (key == "uri" && value < length_ && text_[value] == '"') {
            buffer.uri.clear();
            constexpr std::string_view kZero = "\\u0000"; // a byte with which no name is opened
            for (++value; value < length_ && text_[value] != '"'; ++value) {
                if (std::string_view(text_ + value, length_ - value).starts_with(kZero)) {
                    buffer.uri += '\0';
                    value += kZero.size() - 1;
                } else if (text_[value] != '\\') { // of "\/" alone; other escapes match no file
                    buffer.uri += text_[value];
                }
            }
        }
    }

    /// Takes the data out of a string that is a data URI and leaves a short URI in its place, which
    /// is no name of a file.
    void takeDataUri(size_t value) {
        if (value >= length_ || text_[value] != '"')
            return;
        const size_t from = value + 1;
        size_t end = from;
        while (end < length_ && text_[end] != '"')
            end += text_[end] == '\\' ? 2 : 1;
        if (end >= length_ || !isDataUri({text_ + from, end - from}))
            return;
        DataUri data = decodeDataUri(unescaped({text_ + from, end - from}));
        const std::string name = "data:" + std::to_string(summary_.dataUris.size());
        if (name.size() > end - from) // no room: it is too short for any data
            fail(document_, std::string(topKey_) + "/" + std::to_string(elementCount() - 1),
                 data.problem);
        std::copy(name.begin(), name.end(), text_ + from);
        text_[from + name.size()] = '"';
        std::fill(text_ + from + name.size() + 1, text_ + end + 1, ' ');
        summary_.dataUris.push_back(std::move(data));
    }

    /// Returns the text of a JSON string, but for escapes that no data URI needs.
    static std::string unescaped(std::string_view text) {
        std::string plain;
        plain.reserve(text.size());
        for (size_t i = 0; i < text.size(); ++i) {
            unsigned code = 0;
            if (text[i] != '\\' || i + 1 == text.size()) {
                plain += text[i];
            } else if (const char c = text[++i]; c == 'n' || c == 'r' || c == 't') {
                plain += ' ';
            } else if (c == 'u' && i + 4 < text.size() &&
                       std::from_chars(&text[i + 1], &text[i + 1] + 4, code, 16).ptr ==
                           &text[i + 1] + 4 &&
                       code < 128) {
                plain += char(code);
                i += 4;
            } else {
                plain += c;
            }
        }
        return plain;
    }

    static size_t listOf(std::string_view key) {
        return size_t(std::find(kLists.begin(), kLists.end(), key) - kLists.begin());
    }
    /// Returns how many elements of the present list began.
    uint64_t elementCount() const {
        return list_ < kLists.size() ? summary_.elementCounts[list_] : 0;
    }

    /// With depth_ outside of the object that begins.
    void addElement() {
        if (depth_ == 2 && list_ < kLists.size())
            ++summary_.elementCounts[list_];
        uint64_t bytes = extensionsDepth_ >= 0 ? kKeptObjectBytes : kObjectBytes;
        const bool isOfOtherExtension =
            topKey_ == "extensions" && extension_ != "KHR_lights_punctual";
        for (const ElementCost& cost : kElementCosts)
            if (cost.depth == depth_ && cost.list == topKey_ && !isOfOtherExtension)
                bytes = cost.bytes;
        charge(bytes);
    }

    /// Of an array or an object that begins, or after a comma.
    void addValue() {
        if (extensionsDepth_ >= 0)
            charge(kValueBytes);
    }

    void charge(uint64_t bytes) {
        if (extrasDepth_ >= 0) // which are not parsed
            return;
        bytes_ += bytes;
        if (bytes_ > kFreeParsedBytes + kParsedGrowthLimit * length_)
            fail(document_, "JSON",
                 "its objects would take more than " +
                     std::to_string((kFreeParsedBytes + kParsedGrowthLimit * length_) >> 20) +
                     " MiB, far more than such a text of " + std::to_string(length_) +
                     " bytes explains; leave out those that are empty, or split the scene");
    }

    /// With depth_ outside of the object.
    void beginObject() {
        if (depth_ == 2 && topKey_ == "buffers") {
            summary_.buffers.emplace_back();
            extensions_ = byteLength_ = {};
            isInExtensions_ = false;
        }
        if (depth_ == 4 && topKey_ == "meshes") {
            indicesAt_ = 0;
            isDraco_ = isInExtensions_ = false;
        }
    }

    /// With depth_ inside of the object that ends at `end`.
    void endObject(size_t end) {
        if (topKey_ == "buffers" && !summary_.buffers.empty()) {
            if (depth_ == 4 && isInExtensions_)
                extensions_.end = end + 1;
            if (depth_ == 3)
                replaceAbsent();
        }
        if (topKey_ == "meshes" && depth_ == 5 && isDraco_ && indicesAt_ != 0)
            text_[indicesAt_] = '-';
    }

    /// Gives the buffer that ends a byte of data if it has none of its own.
    void replaceAbsent() {
        JsonSummary::Buffer& buffer = summary_.buffers.back();
        buffer.isAbsent =
            buffer.isAbsent && buffer.uri.empty() && !extensions_.empty() && !byteLength_.empty();
        if (!buffer.isAbsent)
            return;
        // No longer than the key "extensions" with the extension's name in an object.
        constexpr std::string_view kByte = R"("uri":"data:text/plain;base64,AA==")";
        std::fill(text_ + extensions_.from, text_ + extensions_.end, ' ');
        std::copy(kByte.begin(), kByte.end(), text_ + extensions_.from);
        std::fill(text_ + byteLength_.from, text_ + byteLength_.end, ' ');
        text_[byteLength_.from] = '1';
    }

    void endExtras(size_t end) {
        if (depth_ != extrasDepth_)
            return;
        std::fill(text_ + extrasFrom_, text_ + end, ' ');
        text_[extrasFrom_] = '0';
        extrasDepth_ = -1;
    }

    void endExtensions() {
        if (depth_ == extensionsDepth_)
            extensionsDepth_ = -1;
    }

    const Document& document_;
    char* const text_;
    const size_t length_;
    JsonSummary summary_;
    uint64_t objectCount_ = 0, materialCount_ = 0, bytes_ = 0;
    int depth_ = 0;
    std::string_view topKey_;      // of the root object
    size_t list_ = kLists.size();  // of kLists
    int extensionsDepth_ = -1;     // of an extensions value; -1: none
    std::string_view extension_;   // of its "extensions"
    size_t extrasFrom_ = 0;        // start of an extras value
    int extrasDepth_ = -1;         // its depth; -1: none
    Span extensions_, byteLength_; // of the buffer: with the key, the value
    bool isInExtensions_ = false;  // the last key of the buffer or the primitive
    size_t indicesAt_ = 0;         // of the primitive; 0: it has none
    bool isDraco_ = false;         // the primitive
};

} // namespace

JsonSummary screenJson(const Document& document, char* text, size_t length) {
    return Screen(document, text, length).scan();
}

} // namespace shadowdag::gltf
