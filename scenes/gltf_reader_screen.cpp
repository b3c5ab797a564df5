// SPDX-License-Identifier: Apache-2.0
#include "scenes/gltf_reader_screen.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <initializer_list>
#include <string_view>

namespace shadowdag::gltf {

namespace {

// Deeper than any glTF; tinygltf recurses over what nests.
constexpr int kMaxDepth = 256;
// tinygltf keeps up to a kilobyte for an empty JSON object; two million are more than the largest
// scenes that exporters write, and cost what a workstation has.
constexpr uint64_t kMaxObjectCount = 2'000'000;
// Each takes tinygltf 2.5 KB, however short it is; large scenes have hundreds.
constexpr uint64_t kMaxMaterialCount = 16'384;

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
                --depth_;
                break;
            case ',':
                endExtras(i);
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
        }
        if (topKey_ == "extensions" && depth_ == 2)
            extension_ = key;
        checkType(key, skipSpace(colon + 1));
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
            for (++value; value < length_ && text_[value] != '"'; ++value)
                if (text_[value] != '\\') // of "\/" alone; other escapes match no file
                    buffer.uri += text_[value];
        }
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

    const Document& document_;
    char* const text_;
    const size_t length_;
    JsonSummary summary_;
    uint64_t objectCount_ = 0, materialCount_ = 0;
    int depth_ = 0;
    std::string_view topKey_;      // of the root object
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
