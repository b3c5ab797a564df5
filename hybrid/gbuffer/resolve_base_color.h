// SPDX-License-Identifier: Apache-2.0
// Base colours of the samples of a frame, by the textures of their materials. The OpenGL backend
// runs this pass on the CPU, as it does ResolveSamples, and gives its shader the colours.
#pragma once

#include "hybrid/gbuffer/gbuffer_raster.h"
#include "hybrid/gbuffer/shade_model.h"

namespace shadowdag {

/// Finds the base colour of a sample: its material's factor times its texture, filtered over the
/// pixel. The pixel's footprint is the derivative of the texture coordinates, in the plane of the
/// triangle, from the pixel to its right and lower neighbours: neighbouring pixels, which may see
/// other triangles, do not matter.
/// triangle: the G-buffer's. baseColor: its count; zero where nothing is seen.
struct ResolveBaseColor {
    TriangleView triangles;
    ViewRays view;
    View<const uint32_t> triangle;
    View<const uint32_t> triangleMaterial, triangleInstance; ///< by world triangle
    View<const SurfaceColor> materials;
    BaseColorView colors;
    View<glm::vec3> baseColor;

    size_t itemCount() const { return triangle.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t index = triangle[i];
        if (index == kBackground) {
            baseColor[i] = glm::vec3(0.0f);
            return;
        }
        const uint32_t material = triangleMaterial[index];
        const glm::vec3 factor = materials[material].baseColor;
        const uint32_t texture = colors.materialTexture[material];
        baseColor[i] = texture == kNoTexture
                           ? factor
                           : factor * textureColor(index, colors.textures[texture],
                                                   view.direction(uint32_t(i % view.width),
                                                                  uint32_t(i / view.width)));
    }

private:
    /// A quantity along the pixels: its value, and its change to the right and lower neighbour.
    struct Along {
        double at, perX, perY;
    };

    SDAG_HD glm::vec3 textureColor(uint32_t index, const TextureInfo& texture,
                                   const glm::dvec3& direction) const {
        const ViewTriangle t = loadViewTriangle(triangles, index, view.origin);
        const uint32_t toUv = colors.instanceUv[triangleInstance[index]];
        // A corner's weight is the function of the edge opposite to it (coverPixels), linear in the
        // pixel; coordinates are the weighted mean: the quotient of two such functions.
        Along u{}, v{}, sum{};
        for (int corner = 0; corner < 3; ++corner) {
            const glm::dvec3 edge =
                glm::cross(t.corner[(corner + 1) % 3], t.corner[(corner + 2) % 3]);
            const Along weight{glm::dot(edge, direction), glm::dot(edge, view.stepX),
                               glm::dot(edge, view.stepY)};
            const glm::vec2 uv = colors.uv[triangles.triangles[index][corner] + toUv];
            add(sum, weight, 1.0);
            add(u, weight, double(uv.x));
            add(v, weight, double(uv.y));
        }
        const glm::dvec2 at(u.at / sum.at, v.at / sum.at);
        // (n / d)' = (n' - d' n / d) / d
        const glm::dvec2 perX = (glm::dvec2(u.perX, v.perX) - sum.perX * at) / sum.at;
        const glm::dvec2 perY = (glm::dvec2(u.perY, v.perY) - sum.perY * at) / sum.at;
        return colors.filtered(texture, at, perX, perY);
    }
    SDAG_HD static void add(Along& sum, const Along& weight, double factor) {
        sum.at += weight.at * factor;
        sum.perX += weight.perX * factor;
        sum.perY += weight.perY * factor;
    }
};

} // namespace shadowdag
