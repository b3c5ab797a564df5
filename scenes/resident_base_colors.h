// SPDX-License-Identifier: Apache-2.0
// Base colour textures of the host, made available to passes.
#pragma once

#include "cuda/resident.h"
#include "scenes/base_color.h"

namespace shadowdag {

/// Copies of what a BaseColorView shows, on one backend; on the CPU the arrays themselves, which
/// outlive this in place.
class ResidentBaseColors {
public:
    explicit ResidentBaseColors(Backend backend)
        : materialTexture_(backend, "textures of materials"),
          instanceUv_(backend, "texture coordinates of instances"),
          uv_(backend, "texture coordinates"), textures_(backend, "textures"),
          texels_(backend, "texels"), linear_(backend, "linear values of sRGB") {}

    /// Makes all of it available.
    void set(const BaseColorView& host) {
        materialTexture_.set(host.materialTexture);
        instanceUv_.set(host.instanceUv);
        uv_.set(host.uv);
        textures_.set(host.textures);
        texels_.set(host.texels);
        linear_.set(host.linear);
    }

    BaseColorView view() const {
        return {materialTexture_.view(), instanceUv_.view(), uv_.view(),
                textures_.view(),        texels_.view(),     linear_.view()};
    }

private:
    Resident<uint32_t> materialTexture_, instanceUv_;
    Resident<glm::vec2> uv_;
    Resident<TextureInfo> textures_;
    Resident<uint32_t> texels_;
    Resident<float> linear_;
};

} // namespace shadowdag
