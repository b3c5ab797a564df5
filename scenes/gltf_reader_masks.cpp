// SPDX-License-Identifier: Apache-2.0
// Alpha masks of materials: which texels of a base colour texture reach the cutoff. Source: glTF
// 2.0, sec. 3.8 (textures, images, samplers), 3.9.4 (alpha coverage); KHR_texture_transform.
#include "scenes/gltf_reader.h"

#include "scenes/mesh_shapes.h"
#include "scenes/png_alpha.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace shadowdag::gltf {

namespace {

constexpr double kMaxMagnitude = 1e30;

/// Where the alpha of a material comes from.
struct MaskSource {
    size_t material;
    int image; ///< -1: no texture
    MaskWrap wrapU = MaskWrap::kRepeat, wrapV = MaskWrap::kRepeat;
    double factor, cutoff;

    /// Alpha is compared as a float, so that decimal factors equal the same decimal cutoffs.
    bool isOpaque(uint8_t alpha) const {
        return float(factor * double(alpha) / 255.0) >= float(cutoff);
    }
};

/// The bytes of an image as stored in its file.
struct ImageBytes {
    const uint8_t* data = nullptr;
    size_t count = 0;
    std::vector<uint8_t> own; ///< behind data, when they were read for this
};

bool isJpeg(const ImageBytes& bytes) {
    return bytes.count >= 3 && bytes.data[0] == 0xff && bytes.data[1] == 0xd8 &&
           bytes.data[2] == 0xff;
}

class MaskReader {
public:
    MaskReader(const Document& document, AccessorReader& accessors, std::vector<AlphaMask>& masks)
        : document_(document), accessors_(accessors), masks_(masks) {}

    MaterialMasks read() {
        result_.materials.resize(model().materials.size());
        result_.isTextureUsed.assign(model().textures.size(), 0);
        for (size_t i = 0; i < model().materials.size(); ++i)
            if (model().materials[i].alphaMode == "MASK")
                readMaterial(i);
        // By image, so that each is decoded once and only one is in memory at a time.
        std::stable_sort(
            sources_.begin(), sources_.end(),
            [](const MaskSource& a, const MaskSource& b) { return a.image < b.image; });
        for (size_t first = 0, end; first < sources_.size(); first = end) {
            for (end = first;
                 end < sources_.size() && sources_[end].image == sources_[first].image;)
                ++end;
            makeMasks(first, end);
        }
        return std::move(result_);
    }

private:
    const tinygltf::Model& model() const { return document_.model; }
    double number(const tinygltf::Value& value, const std::string& place) const {
        if (!value.IsNumber() || !(std::fabs(value.GetNumberAsDouble()) <= kMaxMagnitude))
            fail(document_, place, "is not a number within 1e30");
        return value.GetNumberAsDouble();
    }
    void readMaterial(size_t index);
    void readTransform(const tinygltf::TextureInfo& info, const std::string& place,
                       MaterialMask& mask);
    MaskWrap wrapOf(int mode, const std::string& place) const;
    ImageBytes bytesOf(int image, const std::string& place) const;
    void makeMasks(size_t first, size_t end);
    int addMask(AlphaMask mask);

    const Document& document_;
    AccessorReader& accessors_;
    std::vector<AlphaMask>& masks_;
    std::vector<MaskSource> sources_;
    MaterialMasks result_;
};

MaskWrap MaskReader::wrapOf(int mode, const std::string& place) const {
    switch (mode) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
        return MaskWrap::kRepeat;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
        return MaskWrap::kMirror;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
        return MaskWrap::kClamp;
    default:
        fail(document_, place, "wrap mode " + std::to_string(mode) + " does not exist");
    }
}

void MaskReader::readTransform(const tinygltf::TextureInfo& info, const std::string& place,
                               MaterialMask& mask) {
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
            fail(document_, where + "/" + key, "is not a pair of numbers");
        return glm::dvec2(number(value.Get(0), where), number(value.Get(1), where));
    };
    const glm::dvec2 scale = pair("scale", 1.0);
    const double angle =
        transform.Has("rotation") ? number(transform.Get("rotation"), where + "/rotation") : 0.0;
    constexpr double kTurn = 6.283185307179586;
    const double c = cosTurns(angle / kTurn), s = sinTurns(angle / kTurn);
    // Counter-clockwise as v points down, as in three.js and Khronos' own viewer.
    mask.uvFromAuthored =
        glm::dmat3(glm::dvec3(c * scale.x, -s * scale.x, 0.0),
                   glm::dvec3(s * scale.y, c * scale.y, 0.0), glm::dvec3(pair("offset", 0.0), 1.0));
    if (transform.Has("texCoord")) {
        const double set = number(transform.Get("texCoord"), where + "/texCoord");
        if (!(set >= 0.0 && set < 256.0))
            fail(document_, where + "/texCoord", std::to_string(set) + " is no set of coordinates");
        mask.texCoord = int(set);
    }
}

void MaskReader::readMaterial(size_t index) {
    const tinygltf::Material& source = model().materials[index];
    const std::string place = "materials/" + std::to_string(index);
    MaterialMask& mask = result_.materials[index];
    MaskSource from{index, -1, MaskWrap::kRepeat, MaskWrap::kRepeat, 1.0, source.alphaCutoff};
    const std::vector<double>& factor = source.pbrMetallicRoughness.baseColorFactor;
    if (factor.size() == 4)
        from.factor = factor[3];
    if (!(std::fabs(from.factor) <= kMaxMagnitude) || !(std::fabs(from.cutoff) <= kMaxMagnitude))
        fail(document_, place, "alpha factor or cutoff is not a number within 1e30");

    const tinygltf::TextureInfo& info = source.pbrMetallicRoughness.baseColorTexture;
    if (info.index == -1) {
        sources_.push_back(from);
        return;
    }
    const std::string where = place + "/baseColorTexture";
    const auto check = [&](int i, size_t count, const char* kind) {
        if (i < 0 || size_t(i) >= count)
            fail(document_, where,
                 std::string("refers to ") + kind + " " + std::to_string(i) + " of " +
                     std::to_string(count));
        return size_t(i);
    };
    const size_t textureIndex = check(info.index, model().textures.size(), "texture");
    const tinygltf::Texture& texture = model().textures[textureIndex];
    if (texture.source == -1) { // only an extension knows the image
        ++result_.unreadableCount;
        return;
    }
    from.image = int(check(texture.source, model().images.size(), "image"));
    if (texture.sampler != -1) {
        const tinygltf::Sampler& sampler =
            model().samplers[check(texture.sampler, model().samplers.size(), "sampler")];
        from.wrapU = wrapOf(sampler.wrapS, where);
        from.wrapV = wrapOf(sampler.wrapT, where);
    }
    if (info.texCoord < 0 || info.texCoord > 255)
        fail(document_, where + "/texCoord",
             std::to_string(info.texCoord) + " is no set of coordinates");
    mask.texCoord = info.texCoord;
    mask.needsUv = true;
    readTransform(info, where, mask);
    result_.isTextureUsed[textureIndex] = 1;
    sources_.push_back(from);
}

ImageBytes MaskReader::bytesOf(int image, const std::string& place) const {
    const tinygltf::Image& source = model().images[size_t(image)];
    ImageBytes bytes;
    if (source.bufferView != -1) {
        const auto [data, count] = accessors_.bytesOf(source.bufferView, place);
        bytes.data = data;
        bytes.count = count;
        return bytes;
    }
    if (source.image.empty())
        bytes.own = readBeside(document_, source.uri, place);
    bytes.data = source.image.empty() ? bytes.own.data() : source.image.data();
    bytes.count = source.image.empty() ? bytes.own.size() : source.image.size();
    return bytes;
}

int MaskReader::addMask(AlphaMask mask) {
    if (mask.isAllOpaque())
        return kNone;
    const auto known = std::find(masks_.begin(), masks_.end(), mask);
    if (known != masks_.end())
        return int(known - masks_.begin());
    masks_.push_back(std::move(mask));
    return int(masks_.size() - 1);
}

// Makes the masks of sources [first, end), which have one image.
void MaskReader::makeMasks(size_t first, size_t end) {
    const int image = sources_[first].image;
    AlphaImage alpha{1, 1, false, {255}};
    if (image != -1) {
        const tinygltf::Image& source = model().images[size_t(image)];
        std::string place = "images/" + std::to_string(image);
        if (!source.uri.empty())
            place += " ('" + source.uri.substr(0, 80) + "')";
        else if (!source.name.empty())
            place += " ('" + source.name.substr(0, 80) + "')";
        const ImageBytes bytes = bytesOf(image, place);
        if (isPng(bytes.data, bytes.count)) {
            alpha = readPngAlpha(bytes.data, bytes.count, document_.path + ": " + place);
            result_.colorCount += alpha.hasColor;
        } else if (isJpeg(bytes)) {
            ++result_.colorCount; // which has no alpha
        } else {
            result_.unreadableCount += end - first;
            return;
        }
    }
    for (size_t i = first; i < end; ++i) {
        const MaskSource& from = sources_[i];
        accessors_.charge(uint64_t(maskRowWords(alpha.width)) * 4 * alpha.height,
                          "materials/" + std::to_string(from.material));
        AlphaMask mask = makeAlphaMask(alpha.width, alpha.height, from.wrapU, from.wrapV);
        for (uint32_t y = 0; y < alpha.height; ++y)
            for (uint32_t x = 0; x < alpha.width; ++x)
                if (from.isOpaque(alpha.alpha[size_t(y) * alpha.width + x]))
                    setOpaque(mask, x, y);
        result_.materials[from.material].mask = addMask(std::move(mask));
    }
}

} // namespace

MaterialMasks readMaterialMasks(const Document& document, AccessorReader& accessors,
                                std::vector<AlphaMask>& masks) {
    return MaskReader(document, accessors, masks).read();
}

} // namespace shadowdag::gltf
