// SPDX-License-Identifier: Apache-2.0
// Base colour textures of materials. They matter to pictures alone, so that one which cannot be
// shown is a warning, where a mask's image is an error. TextureSource: glTF 2.0, sec. 3.9.2.
#include "scenes/gltf_reader.h"

#include "cuda/error.h"

#include <algorithm>
#include <string_view>

namespace shadowdag::gltf {

namespace {

constexpr size_t kMaxWarnings = 4;

struct TextureSource {
    size_t material;
    TextureUse use;
};

class TextureReader {
public:
    TextureReader(const Document& document, AccessorReader& accessors, const MaterialMasks& masks,
                  TextureSet& textures)
        : document_(document), accessors_(accessors), masks_(masks), textures_(textures) {}

    MaterialTextures read() {
        const tinygltf::Model& model = document_.model;
        result_.materials.resize(model.materials.size());
        result_.isTextureUsed.assign(model.textures.size(), 0);
        std::vector<TextureSource> sources;
        for (size_t i = 0; i < model.materials.size(); ++i)
            if (const std::optional<TextureUse> use = readBaseColorUse(document_, i)) {
                result_.isTextureUsed[use->texture] = 1;
                sources.push_back({i, *use});
            }
        // By image, so that each is decoded once and only one is in memory at a time.
        std::stable_sort(sources.begin(), sources.end(),
                         [](const TextureSource& a, const TextureSource& b) {
                             return a.use.image < b.use.image;
                         });
        for (auto first = sources.begin(), end = first; first != sources.end(); first = end) {
            end = std::find_if(first, sources.end(), [&](const TextureSource& source) {
                return source.use.image != first->use.image;
            });
            try {
                readTextures({first, end});
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kInput)
                    throw;
                for (auto source = first; source != end; ++source)
                    leaveOut(*source, error.what());
            }
        }
        if (leftOutCount_ > kMaxWarnings)
            result_.warnings.push_back(
                std::to_string(leftOutCount_ - kMaxWarnings) +
                " more materials have their base colour factor alone, for such reasons.");
        textures_.texels.shrink_to_fit();
        return std::move(result_);
    }

private:
    /// Reads the textures of materials that have the same image.
    void readTextures(const std::vector<TextureSource>& sources) {
        const int index = sources.front().use.image;
        if (index == kNone)
            fail(document_, "its texture",
                 "has an image only by an extension; only PNG and JPEG are read");
        const std::string place = imagePlace(document_, index);
        const ImageBytes bytes = readImageBytes(document_, accessors_, index);
        const ColorImage image = decodeColors(document_, accessors_, bytes, place);
        if (isOneColor(image)) {
            const std::vector<float>& linear = linearFromSrgb();
            for (const TextureSource& source : sources)
                result_.materials[source.material].color = {
                    linear[image.rgb[0]], linear[image.rgb[1]], linear[image.rgb[2]]};
            return;
        }
        const size_t firstOfImage = textures_.textures.size();
        for (const TextureSource& source : sources) {
            const TextureUse& use = source.use;
            const MaterialMask& mask = masks_.materials[source.material];
            if (mask.mask != kNone && mask.needsUv && mask.uv != use.uv) {
                leaveOut(source, "its texture and its opacity map have different texture "
                                 "coordinates, and a vertex has one pair; give both the same");
                continue;
            }
            const auto known = std::find_if(textures_.textures.begin() + ptrdiff_t(firstOfImage),
                                            textures_.textures.end(), [&](const TextureInfo& t) {
                                                return t.wrapU == use.wrapU &&
                                                       t.wrapV == use.wrapV &&
                                                       t.isNearest == uint32_t(use.isNearest);
                                            });
            int texture = int(known - textures_.textures.begin());
            if (known == textures_.textures.end()) {
                const uint64_t count = uint64_t(image.width) * image.height;
                if (texelCount_ + count > kMaxSceneTexels) {
                    leaveOut(source, place + ": the scene's textures would have more than " +
                                         std::to_string(kMaxSceneTexels) +
                                         " texels; scale them down");
                    continue;
                }
                texelCount_ += count;
                texture = int(textures_.add(image, use.wrapU, use.wrapV, use.isNearest));
            }
            result_.materials[source.material].texture = texture;
            result_.materials[source.material].uv = use.uv;
        }
    }

    static bool isOneColor(const ColorImage& image) {
        for (size_t i = 3; i < image.rgb.size(); ++i)
            if (image.rgb[i] != image.rgb[i - 3])
                return false;
        return true;
    }

    void leaveOut(const TextureSource& source, std::string_view reason) {
        if (++leftOutCount_ > kMaxWarnings)
            return;
        const std::string path = document_.path + ": ";
        if (reason.starts_with(path))
            reason.remove_prefix(path.size());
        const std::string& name = document_.model.materials[source.material].name;
        result_.warnings.push_back("materials/" + std::to_string(source.material) +
                                   (name.empty() ? "" : " ('" + name.substr(0, 80) + "')") +
                                   " has its base colour factor alone: " + std::string(reason) +
                                   ".");
    }

    const Document& document_;
    AccessorReader& accessors_;
    const MaterialMasks& masks_;
    TextureSet& textures_;
    MaterialTextures result_;
    uint64_t texelCount_ = 0;
    size_t leftOutCount_ = 0;
};

} // namespace

MaterialTextures readBaseColorTextures(const Document& document, AccessorReader& accessors,
                                       const MaterialMasks& masks, TextureSet& textures) {
    return TextureReader(document, accessors, masks, textures).read();
}

} // namespace shadowdag::gltf
