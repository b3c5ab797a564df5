// SPDX-License-Identifier: Apache-2.0
// Alpha masks of materials: which texels of a base colour texture reach the cutoff. Source: glTF
// 2.0, sec. 3.9.4 (alpha coverage).
#include "scenes/gltf_reader.h"

#include "scenes/png_alpha.h"

#include <algorithm>
#include <cmath>

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
        return std::move(result_);
    }

private:
    const tinygltf::Model& model() const { return document_.model; }
    void readMaterial(size_t index);
    void makeMasks(size_t first, size_t end);
    int addMask(AlphaMask mask);

    const Document& document_;
    AccessorReader& accessors_;
    std::vector<AlphaMask>& masks_;
    std::vector<MaskSource> sources_;
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

    const std::optional<TextureUse> use = readBaseColorUse(document_, index);
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
    if (image != -1) {
        const std::string place = imagePlace(document_, image);
        const ImageBytes bytes = readImageBytes(document_, accessors_, image);
        if (isPng(bytes.data, bytes.count)) {
            alpha = readPngAlpha(bytes.data, bytes.count, document_.path + ": " + place);
        } else if (!isJpeg(bytes.data, bytes.count)) { // which has no alpha
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
