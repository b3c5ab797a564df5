// SPDX-License-Identifier: Apache-2.0
// Alpha masks of materials: which texels of a base colour texture reach the cutoff. Source: glTF
// 2.0, sec. 3.9.4 (alpha coverage).
#include "scenes/gltf_reader.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace shadowdag::gltf {

namespace {

constexpr double kMaxMagnitude = 1e30;

/// Where the alpha of a material comes from.
struct MaskSource {
    size_t material;
    int image; ///< -1: no texture
    MaskWrap wrapU = MaskWrap::kRepeat, wrapV = MaskWrap::kRepeat;
    double factor, cutoff;
    bool mayBeGrey = false; ///< OpacityMap::mayBeGrey

    /// Alpha is compared as a float, so that decimal factors equal the same decimal cutoffs.
    bool isOpaque(uint8_t alpha) const {
        return float(factor * double(alpha) / 255.0) >= float(cutoff);
    }
};

/// Source: ITU-R BT.601, sec. 2.5.1 (luminance); exact for greys.
AlphaImage luminanceOf(const ColorImage& image) {
    AlphaImage grey{image.width, image.height, {}};
    grey.alpha.reserve(size_t(image.width) * image.height);
    for (size_t i = 0; i < image.rgb.size(); i += 3)
        grey.alpha.push_back(uint8_t(
            (299u * image.rgb[i] + 587u * image.rgb[i + 1] + 114u * image.rgb[i + 2]) / 1000u));
    return grey;
}

class MaskReader {
public:
    MaskReader(const Document& document, AccessorReader& accessors, std::vector<AlphaMask>& masks)
        : document_(document), accessors_(accessors), masks_(masks) {}

    MaterialMasks read() {
        result_.materials.resize(model().materials.size());
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
        // Last, as these images are decoded for a warning alone.
        for (size_t i = 0; i < model().materials.size() && !document_.opacityMaps.empty(); ++i)
            if (model().materials[i].alphaMode != "MASK")
                result_.unusedAlphaCount += hasTransparentTexels(i);
        return std::move(result_);
    }

private:
    const tinygltf::Model& model() const { return document_.model; }
    void readMaterial(size_t index);
    bool hasTransparentTexels(size_t material);
    bool isTransparent(int image);
    void makeMasks(size_t first, size_t end);
    int addMask(AlphaMask mask);

    const Document& document_;
    AccessorReader& accessors_;
    std::vector<AlphaMask>& masks_;
    std::vector<MaskSource> sources_;
    std::map<int, bool> isImageTransparent_;
    MaterialMasks result_;
};

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

    std::optional<TextureUse> use = readOpacityUse(document_, index);
    if (use)
        from.mayBeGrey = document_.opacityMaps[index].mayBeGrey != 0;
    else
        use = readBaseColorUse(document_, index);
    if (!use) {
        sources_.push_back(from);
        return;
    }
    if (use->image == kNone) {
        ++result_.unreadableCount;
        return;
    }
    from.image = use->image;
    from.wrapU = use->wrapU;
    from.wrapV = use->wrapV;
    mask.uv = use->uv;
    mask.needsUv = true;
    sources_.push_back(from);
}

// Returns whether the colour image of a material has texels that would cut it out.
bool MaskReader::hasTransparentTexels(size_t material) {
    const std::optional<TextureUse> use = readBaseColorUse(document_, material);
    if (!use || use->image == kNone)
        return false;
    const auto [known, isNew] = isImageTransparent_.try_emplace(use->image, false);
    if (isNew)
        known->second = isTransparent(use->image);
    return known->second;
}

// False for an image that cannot be read, which the reader of textures reports.
bool MaskReader::isTransparent(int image) {
    try {
        const ImageBytes bytes = readImageBytes(document_, accessors_, image);
        if (!isPng(bytes.data, bytes.count) || !mayHaveAlpha(bytes.data, bytes.count))
            return false;
        const std::vector<uint8_t> alpha = decodeAlpha(document_, accessors_, bytes, "").alpha;
        return std::any_of(alpha.begin(), alpha.end(), [](uint8_t a) { return a < 128; });
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput)
            throw;
        return false;
    }
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
    AlphaImage alpha{1, 1, {255}};
    std::optional<AlphaImage> grey; // the luminance of an image that is opaque everywhere
    ImageBytes bytes;
    const std::string place = image == -1 ? "" : imagePlace(document_, image);
    if (image != -1) {
        bytes = readImageBytes(document_, accessors_, image);
        if (isPng(bytes.data, bytes.count)) {
            alpha = decodeAlpha(document_, accessors_, bytes, place);
        } else if (!isJpeg(bytes.data, bytes.count)) { // which has no alpha
            result_.unreadableCount += end - first;
            return;
        }
        if (std::any_of(sources_.begin() + ptrdiff_t(first), sources_.begin() + ptrdiff_t(end),
                        [](const MaskSource& from) { return from.mayBeGrey; }) &&
            std::all_of(alpha.alpha.begin(), alpha.alpha.end(), [](uint8_t a) { return a == 255; }))
            grey = luminanceOf(decodeColors(document_, accessors_, bytes, place));
    }
    // Materials that cut the image alike share a mask: by its wrapping and which alphas are opaque.
    std::map<std::tuple<MaskWrap, MaskWrap, bool, std::string>, int> known;
    for (size_t i = first; i < end; ++i) {
        const MaskSource& from = sources_[i];
        const bool isGrey = from.mayBeGrey && grey;
        const AlphaImage& opacity = isGrey ? *grey : alpha;
        std::string isOpaque(256, 0);
        for (int a = 0; a < 256; ++a)
            isOpaque[size_t(a)] = char(from.isOpaque(uint8_t(a)));
        const auto [found, isNew] =
            known.try_emplace({from.wrapU, from.wrapV, isGrey, isOpaque}, kNone);
        if (isNew) {
            const std::string material = "materials/" + std::to_string(from.material);
            accessors_.checkTexels(0, material);
            accessors_.addTexels(uint64_t(opacity.width) * opacity.height);
            AlphaMask mask = makeAlphaMask(opacity.width, opacity.height, from.wrapU, from.wrapV);
            for (uint32_t y = 0; y < opacity.height; ++y)
                for (uint32_t x = 0; x < opacity.width; ++x)
                    if (isOpaque[opacity.alpha[size_t(y) * opacity.width + x]])
                        setOpaque(mask, x, y);
            const size_t before = masks_.size();
            found->second = addMask(std::move(mask));
            if (masks_.size() > before) // it stays
                accessors_.charge(uint64_t(maskRowWords(opacity.width)) * 4 * opacity.height,
                                  material);
        }
        result_.materials[from.material].mask = found->second;
    }
}

} // namespace

MaterialMasks readMaterialMasks(const Document& document, AccessorReader& accessors,
                                std::vector<AlphaMask>& masks) {
    return MaskReader(document, accessors, masks).read();
}

} // namespace shadowdag::gltf
