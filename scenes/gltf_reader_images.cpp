// SPDX-License-Identifier: Apache-2.0
// What masks and base colour textures share: how a material uses its texture, and the bytes of its
// image. Source: glTF 2.0, sec. 3.8 (textures, images, samplers); KHR_texture_transform.
#include "scenes/gltf_reader.h"

#include "cuda/error.h"
#include "scenes/mesh_shapes.h"

#include <algorithm>
#include <cmath>

namespace shadowdag::gltf {

namespace {

constexpr double kLargestNumber = 1e30;

double number(const Document& document, const tinygltf::Value& value, const std::string& place) {
    if (!value.IsNumber() || !(std::fabs(value.GetNumberAsDouble()) <= kLargestNumber))
        fail(document, place, "is not a number within 1e30");
    return value.GetNumberAsDouble();
}

MaskWrap wrapOf(const Document& document, int mode, const std::string& place) {
    switch (mode) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
        return MaskWrap::kRepeat;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
        return MaskWrap::kMirror;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
        return MaskWrap::kClamp;
    default:
        fail(document, place, "wrap mode " + std::to_string(mode) + " does not exist");
    }
}

void readTransform(const Document& document, const tinygltf::TextureInfo& info,
                   const std::string& place, UvMapping& mapping) {
    const auto found = info.extensions.find("KHR_texture_transform");
    if (found == info.extensions.end())
        return;
    const tinygltf::Value& transform = found->second;
    const std::string where = place + "/KHR_texture_transform";
    const auto pair = [&](const char* key, double fallback) {
        if (!transform.Has(key))
            return glm::dvec2(fallback);
        const tinygltf::Value& value = transform.Get(key);
        if (!value.IsArray() || value.ArrayLen() != 2)
            fail(document, where + "/" + key, "is not a pair of numbers");
        return glm::dvec2(number(document, value.Get(0), where),
                          number(document, value.Get(1), where));
    };
    const glm::dvec2 scale = pair("scale", 1.0);
    const double angle = transform.Has("rotation")
                             ? number(document, transform.Get("rotation"), where + "/rotation")
                             : 0.0;
    constexpr double kTurn = 6.283185307179586;
    const double c = cosTurns(angle / kTurn), s = sinTurns(angle / kTurn);
    // Counter-clockwise as v points down, as in three.js and Khronos' own viewer.
    mapping.uvFromAuthored =
        glm::dmat3(glm::dvec3(c * scale.x, -s * scale.x, 0.0),
                   glm::dvec3(s * scale.y, c * scale.y, 0.0), glm::dvec3(pair("offset", 0.0), 1.0));
    if (transform.Has("texCoord")) {
        const double set = number(document, transform.Get("texCoord"), where + "/texCoord");
        if (!(set >= 0.0 && set < 256.0))
            fail(document, where + "/texCoord", std::to_string(set) + " is no set of coordinates");
        mapping.texCoord = int(set);
    }
}

std::optional<TextureUse> readUse(const Document& document, const tinygltf::TextureInfo& info,
                                  const std::string& where) {
    const tinygltf::Model& model = document.model;
    if (info.index == -1)
        return std::nullopt;
    const auto check = [&](int i, size_t count, const char* kind) {
        if (i < 0 || size_t(i) >= count)
            fail(document, where,
                 std::string("refers to ") + kind + " " + std::to_string(i) + " of " +
                     std::to_string(count));
        return size_t(i);
    };
    TextureUse use;
    use.texture = check(info.index, model.textures.size(), "texture");
    const tinygltf::Texture& texture = model.textures[use.texture];
    if (texture.source == -1)
        return use;
    use.image = document.firstAlike[check(texture.source, model.images.size(), "image")];
    if (texture.sampler != -1) {
        const tinygltf::Sampler& sampler =
            model.samplers[check(texture.sampler, model.samplers.size(), "sampler")];
        use.wrapU = wrapOf(document, sampler.wrapS, where);
        use.wrapV = wrapOf(document, sampler.wrapT, where);
        use.isNearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    if (info.texCoord < 0 || info.texCoord > 255)
        fail(document, where + "/texCoord",
             std::to_string(info.texCoord) + " is no set of coordinates");
    use.uv.texCoord = info.texCoord;
    readTransform(document, info, where, use.uv);
    return use;
}

/// Returns what `decode` returns, and counts it.
template <class Decode>
auto decoded(AccessorReader& accessors, const ImageBytes& bytes, const std::string& place,
             const Decode& decode) {
    // More than a byte of PNG (one bit a texel) or of JPEG may hold.
    constexpr uint64_t kMostTexelsPerByte = 8 * 1032;
    accessors.checkTexels(bytes.own.size(), place);
    try {
        auto image = decode();
        accessors.addTexels(uint64_t(image.width) * image.height);
        return image;
    } catch (const Error&) {
        if (isPng(bytes.data, bytes.count) || isJpeg(bytes.data, bytes.count))
            accessors.addTexels(std::min(kMaxMaskTexels, kMostTexelsPerByte * bytes.count));
        throw;
    }
}

} // namespace

std::optional<TextureUse> readBaseColorUse(const Document& document, size_t material) {
    return readUse(document,
                   document.model.materials[material].pbrMetallicRoughness.baseColorTexture,
                   "materials/" + std::to_string(material) + "/baseColorTexture");
}

std::optional<TextureUse> readOpacityUse(const Document& document, size_t material) {
    if (material >= document.opacityMaps.size())
        return std::nullopt;
    const OpacityMap& map = document.opacityMaps[material];
    tinygltf::TextureInfo info;
    info.index = map.texture;
    info.texCoord = int(map.texCoord);
    std::optional<TextureUse> use =
        readUse(document, info, "materials/" + std::to_string(material) + " (opacity map)");
    if (use)
        use->uv.uvFromAuthored = glm::dmat3(map.uvScale.x, 0.0, 0.0, 0.0, map.uvScale.y, 0.0,
                                            map.uvOffset.x, map.uvOffset.y, 1.0);
    return use;
}

std::string imagePlace(const Document& document, int image) {
    const tinygltf::Image& source = document.model.images[size_t(image)];
    std::string place = "images/" + std::to_string(image);
    if (!source.uri.empty())
        place += " ('" + source.uri.substr(0, 80) + "')";
    else if (!source.name.empty())
        place += " ('" + source.name.substr(0, 80) + "')";
    return place;
}

ImageBytes readImageBytes(const Document& document, const AccessorReader& accessors, int image) {
    const tinygltf::Image& source = document.model.images[size_t(image)];
    const std::string place = imagePlace(document, image);
    ImageBytes bytes;
    if (source.bufferView != -1) {
        const auto [data, count] = accessors.bytesOf(source.bufferView, place);
        bytes.data = data;
        bytes.count = count;
        return bytes;
    }
    const auto problem = document.imageProblems.find(image);
    if (problem != document.imageProblems.end())
        fail(document, place, problem->second);
    if (source.image.empty())
        bytes.own = readBeside(document, source.uri, place);
    bytes.data = source.image.empty() ? bytes.own.data() : source.image.data();
    bytes.count = source.image.empty() ? bytes.own.size() : source.image.size();
    return bytes;
}

ColorImage decodeColors(const Document& document, AccessorReader& accessors,
                        const ImageBytes& bytes, const std::string& place) {
    return decoded(accessors, bytes, place, [&] {
        return readColorImage(bytes.data, bytes.count, document.path + ": " + place);
    });
}

AlphaImage decodeAlpha(const Document& document, AccessorReader& accessors, const ImageBytes& bytes,
                       const std::string& place) {
    return decoded(accessors, bytes, place, [&] {
        return readPngAlpha(bytes.data, bytes.count, document.path + ": " + place);
    });
}

} // namespace shadowdag::gltf
