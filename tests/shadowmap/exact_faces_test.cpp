// SPDX-License-Identifier: Apache-2.0
// The choice of a face and a texel at the edges and corners of a cube map, compared with integers:
// the 26 directions, those a rounding beside them, and texels beyond a face's border.
#include "shadowmap/shadow_map_lookup.h"

#include "tools/workspace/cube_texel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace shadowdag {
namespace {

TEST(ExactFaces, The26DirectionsAndThoseARoundingBesideThemHaveOneFace) {
    size_t ties = 0;
    for (int d = 0; d < 27; ++d)
        for (int nudge = 0; nudge < 27; ++nudge)
            for (const float length : {1.0f, 3.0f, 1e-20f, 1e5f, 0.1f}) {
                if (d == 13)
                    continue;
                glm::vec3 v = length * glm::vec3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
                int exponent = 0;
                std::frexp(length, &exponent);
                Int3 integer;
                for (int a = 0; a < 3; ++a) {
                    const int by = (a == 0 ? nudge % 3 : a == 1 ? nudge / 3 % 3 : nudge / 9) - 1;
                    if (by != 0 && v[a] != 0.0f)
                        v[a] = std::nextafter(v[a], float(by) * INFINITY);
                    integer[size_t(a)] = int64_t(std::ldexp(double(v[a]), 30 - exponent));
                }
                const uint32_t face = faceOf(v);
                ASSERT_EQ(face, exactFace(integer)) << d << " " << nudge << " " << length;
                // On its face the direction has coordinates in [-1, 1], so its texel is one of it.
                const glm::vec3 q = faceFromLight(face, v);
                ASSERT_GT(q.z, 0.0f);
                ASSERT_LE(std::abs(q.x / q.z), 1.0f);
                ASSERT_LE(std::abs(q.y / q.z), 1.0f);
                ASSERT_EQ(lightFromFace(face, q), v);
                size_t largest = 0;
                for (size_t a = 0; a < 3; ++a)
                    largest += std::abs(integer[a]) == std::abs(integer[face / 2]);
                ties += largest > 1;
                // Masks are conservative: a box that is the point reaches the face it is looked up
                // on, and the rectangle holds its coordinates.
                Box box;
                box.add(v);
                FaceRect rect;
                ASSERT_TRUE(projectBox(box, face, 0.0f, rect)) << d << " " << nudge;
                ASSERT_TRUE(rect.uMin <= q.x / q.z && q.x / q.z <= rect.uMax &&
                            rect.vMin <= q.y / q.z && q.y / q.z <= rect.vMax)
                    << d << " " << nudge;
            }
    EXPECT_GT(ties, 500u);
}

TEST(ExactFaces, TexelsBeyondABorderEqualTheIntegerReference) {
    size_t ties = 0, judged = 0;
    for (const int32_t n : {1, 2, 3, 4, 16, 97, 1024, 8191, 8192})
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            const int32_t reach = std::min(n, 2); // of a filter
            for (int32_t along = -reach; along < n + reach; ++along)
                for (const int32_t across : {-2, -1, n, n + 1})
                    for (const bool isColumn : {false, true}) {
                        if (across < -reach || across >= n + reach)
                            continue;
                        const int32_t x = isColumn ? across : along, y = isColumn ? along : across;
                        const ExactTexel exact = exactTexel(face, x, y, n);
                        const CubeTexel texel = wrapTexel(face, x, y, uint32_t(n));
                        ASSERT_EQ(texel.face, exact.face)
                            << n << " face " << face << " " << x << " " << y;
                        ties += exact.x.isTie() || exact.y.isTie();
                        ++judged;
                        ASSERT_TRUE(exact.x.holds(texel.x))
                            << n << " face " << face << " " << x << " " << y;
                        ASSERT_TRUE(exact.y.holds(texel.y))
                            << n << " face " << face << " " << x << " " << y;
                    }
        }
    EXPECT_LT(ties * 20, judged); // nearly all texels are decided
}

// A direction on an edge of the cube, or a rounding beside it, is looked up on one of the faces
// that meet there; which one must not show: the texel that either face would read is at the border.
TEST(ExactFaces, OnEdgesAndCornersEitherFacesTexelIsAtTheBorder) {
    constexpr uint32_t kTexels = 64;
    for (int d = 0; d < 27; ++d) {
        const glm::vec3 v(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
        if (glm::dot(v, v) < 2.0f)
            continue;
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            const glm::vec3 q = faceFromLight(face, v);
            if (q.z != 1.0f)
                continue;
            const uint32_t x = faceCell(q.x, kTexels), y = faceCell(q.y, kTexels);
            EXPECT_TRUE(x == 0 || x == kTexels - 1 || y == 0 || y == kTexels - 1) << d;
            EXPECT_EQ(q.x == 0.0f, x == kTexels / 2); // half open: the upper of two
        }
    }
}

} // namespace
} // namespace shadowdag
