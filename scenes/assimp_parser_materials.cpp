// SPDX-License-Identifier: Apache-2.0
// Materials, textures and images of Assimp's scene. An opacity map cuts a material out; so does the
// alpha of its colour image where the file says so. Everything else is opaque.
#include "scenes/assimp_parser.h"

#include "scenes/color_image.h"
#include "scenes/png_alpha.h"

#include <assimp/scene.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <tuple>

namespace shadowdag::assimp {

namespace {

/// How a material uses a texture.
struct TextureOf {
    size_t texture;
    size_t image;
    uint32_t texCoord;
    int flags;
    glm::vec2 uvScale, uvOffset; ///< of coordinates whose v points down, as in glTF
};

/// Returns a path as a URI. Source: RFC 3986, sec. 2.
std::string uriOf(const std::string& path) {
    constexpr const char* kHex = "0123456789abcdef";
    std::string uri;
    for (const char c : path) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x80 &&
            (std::isalnum(byte) || std::string_view("/._-~").find(c) != std::string_view::npos))
            uri += c;
        else
            uri += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
    return uri;
}

class MaterialWriter {
public:
    MaterialWriter(const aiScene& scene, Conversion& conversion)
        : scene_(scene), conversion_(conversion) {}

    std::vector<UvSets> write() {
        std::vector<UvSets> sets;
        for (size_t i = 0; i < scene_.mNumMaterials; ++i)
            sets.push_back(writeMaterial(*scene_.mMaterials[i], i));
        conversion_.warn(unreadImageCount_,
                         "embedded images are neither PNG nor JPEG and are ignored.");
        conversion_.warn(turnedCount_, "textures are turned by the file, which is ignored.");
        conversion_.warn(invertedCount_, "inverted opacity maps ignored.");
        return sets;
    }

private:
    glm::vec3 colorOf(const aiMaterial& material, const std::string& place, const char* key,
                      unsigned type, unsigned index, const glm::vec3& otherwise) const;
    std::string fileOf(const std::string& name) const;
    std::optional<size_t> imageOf(const aiString& name);
    std::optional<TextureOf> textureOf(const aiMaterial& material, const std::string& place,
                                       aiTextureType type);
    UvSets writeMaterial(const aiMaterial& material, size_t index);

    const aiScene& scene_;
    Conversion& conversion_;
    std::map<std::string, std::optional<size_t>> images_;
    std::map<std::tuple<size_t, int, int>, size_t> textures_;
    uint64_t unreadImageCount_ = 0, turnedCount_ = 0, invertedCount_ = 0;
};

glm::vec3 MaterialWriter::colorOf(const aiMaterial& material, const std::string& place,
                                  const char* key, unsigned type, unsigned index,
                                  const glm::vec3& otherwise) const {
    aiColor3D color;
    if (material.Get(key, type, index, color) != aiReturn_SUCCESS)
        return otherwise;
    for (const float channel : {color.r, color.g, color.b})
        if (!std::isfinite(channel))
            fail(conversion_, place, "a colour is not a number");
    return {color.r, color.g, color.b};
}

// Returns the path of an image in the scene's folder. A path of another machine is searched for by
// its last part.
std::string MaterialWriter::fileOf(const std::string& name) const {
    std::string path = name;
    std::replace(path.begin(), path.end(), '\\', '/');
    const std::string last = path.substr(path.rfind('/') + 1);
    const bool isOfWindows = path.size() > 1 && path[1] == ':';
    std::error_code error;
    const bool isThere = std::filesystem::exists(conversion_.folder.join(path), error);
    return isOfWindows ||
                   (!isThere && std::filesystem::exists(conversion_.folder.join(last), error))
               ? last
               : path;
}

// Returns an image of the glTF file, or nothing for one that cannot be in it.
std::optional<size_t> MaterialWriter::imageOf(const aiString& name) {
    const auto [known, isNew] = images_.try_emplace(std::string(name.C_Str()));
    if (!isNew)
        return known->second;
    glb::Parts& parts = conversion_.parts;
    const aiTexture* const inside = scene_.GetEmbeddedTexture(name.C_Str());
    if (inside == nullptr) {
        known->second = parts.images.add("{\"uri\":\"" + uriOf(fileOf(name.C_Str())) + "\"}");
        return known->second;
    }
    const auto* bytes = reinterpret_cast<const uint8_t*>(inside->pcData);
    const size_t count = inside->mWidth; // of a compressed image, whose height is 0
    if (inside->mHeight != 0 || bytes == nullptr ||
        !(isPng(bytes, count) || isJpeg(bytes, count))) {
        ++unreadImageCount_;
        return std::nullopt;
    }
    known->second = parts.images.add("{" + glb::nameMember(textOf(name)) + "\"mimeType\":\"image/" +
                                     (isPng(bytes, count) ? "png" : "jpeg") + "\",\"bufferView\":" +
                                     std::to_string(parts.addView(bytes, count)) + "}");
    return known->second;
}

std::optional<TextureOf> MaterialWriter::textureOf(const aiMaterial& material,
                                                   const std::string& place, aiTextureType type) {
    aiString name;
    unsigned texCoord = 0;
    aiTextureMapMode wraps[3] = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap,
                                 aiTextureMapMode_Wrap};
    if (material.GetTexture(type, 0, &name, nullptr, &texCoord, nullptr, nullptr, wraps) !=
            aiReturn_SUCCESS ||
        name.length == 0) // as some exporters write of a material without an image
        return std::nullopt;
    const std::optional<size_t> image = imageOf(name);
    if (!image)
        return std::nullopt;
    const auto modeOf = [](aiTextureMapMode wrap) {
        return wrap == aiTextureMapMode_Wrap     ? 10497
               : wrap == aiTextureMapMode_Mirror ? 33648
                                                 : 33071;
    };
    const auto [known, isNew] =
        textures_.try_emplace({*image, modeOf(wraps[0]), modeOf(wraps[1])}, 0);
    glb::Parts& parts = conversion_.parts;
    if (isNew) {
        const size_t sampler =
            parts.samplers.add("{\"wrapS\":" + std::to_string(modeOf(wraps[0])) +
                               ",\"wrapT\":" + std::to_string(modeOf(wraps[1])) + "}");
        known->second = parts.textures.add("{\"sampler\":" + std::to_string(sampler) +
                                           ",\"source\":" + std::to_string(*image) + "}");
    }
    TextureOf use{known->second, *image, texCoord, 0, glm::vec2(1.0f), glm::vec2(0.0f)};
    material.Get(AI_MATKEY_TEXFLAGS(type, 0), use.flags);
    aiUVTransform transform;
    if (material.Get(AI_MATKEY_UVTRANSFORM(type, 0), transform) == aiReturn_SUCCESS) {
        turnedCount_ += transform.mRotation != 0.0f;
        for (const float value : {transform.mScaling.x, transform.mScaling.y,
                                  transform.mTranslation.x, transform.mTranslation.y})
            if (!std::isfinite(value))
                fail(conversion_, place, "the transform of a texture is not a number");
        // v' = offset + scale v, of which both v point up there and down here.
        use.uvScale = {transform.mScaling.x, transform.mScaling.y};
        use.uvOffset = {transform.mTranslation.x,
                        1.0f - transform.mTranslation.y - transform.mScaling.y};
    }
    return use;
}

UvSets MaterialWriter::writeMaterial(const aiMaterial& material, size_t index) {
    aiString name;
    material.Get(AI_MATKEY_NAME, name);
    const std::string place = placeOf("material", index, name);
    auto color = textureOf(material, place, aiTextureType_BASE_COLOR);
    if (!color)
        color = textureOf(material, place, aiTextureType_DIFFUSE);
    auto opacity = textureOf(material, place, aiTextureType_OPACITY);
    if (opacity && (opacity->flags & aiTextureFlags_Invert) != 0) {
        ++invertedCount_;
        opacity.reset();
    }

    const glm::vec3 diffuse = colorOf(material, place, AI_MATKEY_COLOR_DIFFUSE, glm::vec3(1.0f));
    glm::vec3 base = colorOf(material, place, AI_MATKEY_BASE_COLOR, diffuse);
    if (color && base == glm::vec3(0.0f))
        base = glm::vec3(1.0f); // which would hide the texture
    std::string text =
        "{" + glb::nameMember(textOf(name)) +
        "\"pbrMetallicRoughness\":{\"baseColorFactor\":" + glb::numbers(glm::vec4(base, 1.0f), 4);
    UvSets sets;
    if (color) {
        text += ",\"baseColorTexture\":{\"index\":" + std::to_string(color->texture) +
                ",\"texCoord\":" + std::to_string(color->texCoord);
        if (color->uvScale != glm::vec2(1.0f) || color->uvOffset != glm::vec2(0.0f)) {
            text += ",\"extensions\":{\"KHR_texture_transform\":{\"offset\":" +
                    glb::numbers(color->uvOffset, 2) +
                    ",\"scale\":" + glb::numbers(color->uvScale, 2) + "}}";
            conversion_.parts.hasTextureTransform = true;
        }
        text += "}";
        sets.push_back(color->texCoord);
    }
    text += "},";

    OpacityMap map;
    // Of one image for both, alpha alone can mean opacity.
    const bool isOneImage = color && opacity && color->image == opacity->image;
    if (opacity && !isOneImage) {
        map = {int(opacity->texture), opacity->texCoord, !conversion_.isFbx, opacity->uvScale,
               opacity->uvOffset};
        sets.push_back(opacity->texCoord);
    }
    float factor = 1.0f;
    material.Get(AI_MATKEY_OPACITY, factor);
    if (opacity || (color && (color->flags & aiTextureFlags_UseAlpha) != 0))
        text += "\"alphaMode\":\"MASK\",";
    else if (factor < 1.0f)
        text += "\"alphaMode\":\"BLEND\",";
    conversion_.source.opacityMaps.push_back(map);

    float strength = 1.0f;
    material.Get(AI_MATKEY_EMISSIVE_INTENSITY, strength);
    const glm::vec3 emission =
        strength * colorOf(material, place, AI_MATKEY_COLOR_EMISSIVE, glm::vec3(0.0f));
    if (!std::isfinite(emission.x + emission.y + emission.z))
        fail(conversion_, place, "its emission is not a number");
    text += conversion_.parts.emissionMembers(emission);
    conversion_.parts.materials.add(glb::closed(text));
    return sets;
}

} // namespace

std::vector<UvSets> writeMaterials(const aiScene& scene, Conversion& conversion) {
    return MaterialWriter(scene, conversion).write();
}

} // namespace shadowdag::assimp
