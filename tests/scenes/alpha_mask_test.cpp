// SPDX-License-Identifier: Apache-2.0
// Alpha masks: the choice of a texel, and masks in the world.
#include "scenes/alpha_mask.h"

#include "scenes/world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace shadowdag {
namespace {

// glTF 2.0, sec. 3.8.4.1: repeat, mirrored repeat, clamp to edge; five texels, so that no size is a
// power of two by chance.
TEST(AlphaMask, WrapModesFoldTexelsAsTheFormatSays) {
    for (int texel = -23; texel <= 23; ++texel) {
        SCOPED_TRACE(texel);
        const int repeated = ((texel % 5) + 5) % 5;
        const int folded = ((texel % 10) + 10) % 10;
        EXPECT_EQ(maskTexel(texel, 5, MaskWrap::kRepeat), uint32_t(repeated));
        EXPECT_EQ(maskTexel(texel, 5, MaskWrap::kMirror),
                  uint32_t(folded < 5 ? folded : 9 - folded));
        EXPECT_EQ(maskTexel(texel, 5, MaskWrap::kClamp), uint32_t(std::clamp(texel, 0, 4)));
    }
}

TEST(AlphaMask, EveryNumberMapsToATexel) {
    for (const MaskWrap wrap : {MaskWrap::kRepeat, MaskWrap::kMirror, MaskWrap::kClamp})
        for (const uint32_t size : {1u, 2u, 5u, 16384u})
            for (const double at :
                 {1e17, -1e17, 1e300, -1e300, 1.7e308, -1e-300,
                  std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                  std::numeric_limits<double>::quiet_NaN()})
                EXPECT_LT(maskTexel(at, size, wrap), size) << at;
}

TEST(AlphaMask, RowsOfAnyWidthKeepTheirTexels) {
    for (const uint32_t width : {1u, 31u, 32u, 33u, 70u}) {
        SCOPED_TRACE(width);
        AlphaMask mask = makeAlphaMask(width, 3);
        EXPECT_FALSE(mask.isAllOpaque());
        for (uint32_t y = 0; y < 3; ++y)
            for (uint32_t x = 0; x < width; ++x) {
                EXPECT_FALSE(mask.isOpaque(x, y));
                setOpaque(mask, x, y);
                EXPECT_TRUE(mask.isOpaque(x, y));
                EXPECT_EQ(mask.isAllOpaque(), y == 2 && x == width - 1);
            }
    }
}

/// Two by two texels, (0, 0) opaque alone; one triangle over the lower left half of the texture.
AlphaMaskSet cornerMask() {
    AlphaMask mask = makeAlphaMask(2, 2);
    setOpaque(mask, 0, 0);
    AlphaMaskSet set;
    set.triangleCut = {kNotCut, 0};
    set.cuts = {{set.add(mask), {{0, 0}, {1, 0}, {0, 1}}}};
    return set;
}

TEST(AlphaMask, WeightsOfAnyScaleAndSignFindThePoint) {
    const AlphaMaskSet set = cornerMask();
    const AlphaMaskView masks = set.view();
    EXPECT_FALSE(masks.isCut(0));
    EXPECT_TRUE(masks.isCut(1));
    for (const double scale : {1.0, -1.0, 1e-200, -3e200})
        for (int i = 1; i < 20; ++i)
            for (int j = 1; i + j < 20; ++j) {
                const double u = i / 20.0 + 0.001, v = j / 20.0 + 0.001;
                EXPECT_EQ(masks.isOpaque(1, scale * (1.0 - u - v), scale * u, scale * v),
                          u < 0.5 && v < 0.5);
            }
}

// A rasterizer's tolerance lets points a little beyond an edge in, and edges lie where the texture
// begins anew: neither must see its other end.
TEST(AlphaMask, PointsOnAnEdgeAndPastItBelongToTheInside) {
    AlphaMaskSet set = cornerMask();
    EXPECT_FALSE(set.view().isOpaque(1, 0.0, 1.0, 0.0)) << "u = 1 is no 0";
    EXPECT_FALSE(set.view().isOpaque(1, 0.0, 0.0, 1.0));
    EXPECT_TRUE(set.view().isOpaque(1, 1.0, 0.0, 0.0));
    EXPECT_TRUE(set.view().isOpaque(1, 0.0, 0.0, 0.0)) << "nowhere is somewhere";
    EXPECT_TRUE(set.view().isOpaque(1, 0.9, 0.1, -1e-9));
    EXPECT_TRUE(set.view().isOpaque(1, 0.9, -1e-9, 0.1));
    EXPECT_FALSE(set.view().isOpaque(1, -1e-9, 0.6, 0.4 + 1e-9));
}

TEST(AlphaMask, CopiesAreEqualAndHashesDependOnContent) {
    AlphaMaskSet set = cornerMask();
    const AlphaMaskSet copy(set.view());
    EXPECT_EQ(copy.triangleCut, set.triangleCut);
    EXPECT_EQ(copy.words, set.words);
    AlphaMask mask = makeAlphaMask(2, 2);
    setOpaque(mask, 0, 0);
    EXPECT_EQ(set.contentHash(set.add(mask)), set.contentHash(0));
    mask.wrapU = MaskWrap::kClamp;
    EXPECT_NE(set.contentHash(set.add(mask)), set.contentHash(0));
    mask.wrapU = MaskWrap::kRepeat;
    setOpaque(mask, 1, 1);
    EXPECT_NE(set.contentHash(set.add(mask)), set.contentHash(0));
}

/// A square board, cut out, placed as it is, mirrored and again as it is; and a solid one.
Scene boards() {
    Scene scene;
    scene.name = "boards";
    scene.materials.resize(2);
    scene.materials[1].alphaMask = 0;
    scene.alphaMasks.push_back(makeAlphaMask(4, 4));
    setOpaque(scene.alphaMasks[0], 2, 1);
    for (const uint32_t material : {1u, 0u}) {
        Mesh mesh;
        mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
        mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
        mesh.triangleMaterial = {material, material};
        if (material)
            mesh.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        scene.meshes.push_back(mesh);
    }
    for (int i = 0; i < 4; ++i) {
        Node node;
        node.mesh = i == 3;
        node.local.translation = glm::vec3(float(3 * i), 0, 0);
        node.local.scale.x = i == 1 ? -1.0f : 1.0f;
        scene.roots.push_back(i);
        scene.nodes.push_back(node);
    }
    return scene;
}

TEST(AlphaMaskWorld, InstancesShareCutsAndMirroredOnesKeepTheirHoles) {
    const Scene scene = boards();
    const World world(scene, {});
    const TriangleView triangles = world.triangles();
    ASSERT_EQ(triangles.count(), 8u);
    EXPECT_EQ(triangles.masks.cuts.count, 4u); // as it is and mirrored
    for (uint32_t t = 0; t < 8; ++t) {
        EXPECT_EQ(triangles.masks.isCut(t), t < 6);
        if (t >= 6)
            continue;
        for (const glm::dvec3 w : {glm::dvec3(0.7, 0.1, 0.2), glm::dvec3(0.1, 0.5, 0.4),
                                   glm::dvec3(0.3, 0.3, 0.4), glm::dvec3(0.2, 0.75, 0.05)}) {
            glm::dvec3 p(0.0);
            for (int corner = 0; corner < 3; ++corner)
                p += w[corner] * glm::dvec3(triangles.vertex(t, corner));
            const double u = t / 2 == 1 ? 3.0 - p.x : p.x - 3.0 * (t / 2);
            EXPECT_EQ(triangles.masks.isOpaque(t, w[0], w[1], w[2]),
                      u >= 0.5 && u < 0.75 && p.z >= 0.25 && p.z < 0.5)
                << "triangle " << t << " at " << u << " " << p.z;
        }
    }
    EXPECT_EQ(triangles.masks.triangleCut[4], triangles.masks.triangleCut[0]);
    EXPECT_NE(triangles.masks.triangleCut[2], triangles.masks.triangleCut[0]);
}

TEST(AlphaMaskWorld, SolidScenesHaveNoMasks) {
    Scene scene = boards();
    scene.materials[1].alphaMask = kNone;
    const World world(scene, {});
    EXPECT_TRUE(world.triangles().masks.triangleCut.empty());
    EXPECT_TRUE(world.triangles().masks.words.empty());
    EXPECT_FALSE(world.triangles().masks.isCut(7));
}

TEST(AlphaMaskWorld, GeometryHashDependsOnHolesNotOnMaskNumbers) {
    const Scene scene = boards();
    const std::string hash = World(scene, {}).geometryHash();
    {
        Scene other = scene;
        setOpaque(other.alphaMasks[0], 0, 0);
        EXPECT_NE(World(other, {}).geometryHash(), hash) << "a texel";
    }
    {
        Scene other = scene;
        other.alphaMasks[0].wrapV = MaskWrap::kClamp;
        EXPECT_NE(World(other, {}).geometryHash(), hash) << "a wrap mode";
    }
    {
        Scene other = scene;
        other.meshes[0].uv[2].x += 0.25f;
        EXPECT_NE(World(other, {}).geometryHash(), hash) << "a texture coordinate";
    }
    {
        Scene other = scene;
        other.materials[1].alphaMask = kNone;
        EXPECT_NE(World(other, {}).geometryHash(), hash) << "no mask";
    }
    {
        Scene other = scene;
        other.alphaMasks.insert(other.alphaMasks.begin(), makeAlphaMask(1, 1));
        other.materials[1].alphaMask = 1;
        EXPECT_EQ(World(other, {}).geometryHash(), hash) << "another number";
    }
}

} // namespace
} // namespace shadowdag
