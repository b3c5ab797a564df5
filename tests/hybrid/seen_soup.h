// SPDX-License-Identifier: Apache-2.0
// Random triangles around a camera, drawn into a G-buffer, for tests of the frame's passes.
#pragma once

#include "hybrid/gbuffer/gbuffer_pass.h"
#include "tests/hybrid/triangle_soup.h"

#include <random>

namespace shadowdag::test {

/// Returns a camera at the origin that looks along -Z.
inline Camera frontCamera() {
    Camera camera;
    camera.znear = 0.1f;
    camera.zfar = 100.0f;
    return camera;
}

/// Returns `count` triangles within 12 m of the origin, from slivers to walls: some pass through
/// the camera's plane, every 17th is degenerate.
inline TriangleSoup randomSoup(uint64_t seed, int count) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<float> place(-12.0f, 12.0f), unit(-1.0f, 1.0f),
        sizes(0.0f, 1.0f);
    const auto point = [&](float size) {
        const float x = unit(random), y = unit(random), z = unit(random);
        return glm::vec3(x, y, z) * size;
    };
    TriangleSoup soup;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 center(place(random), place(random), place(random));
        const float size = 9.0f * sizes(random) * sizes(random);
        const glm::vec3 a = center + point(size), b = center + point(size);
        soup.add(a, b, i % 17 == 0 ? b : center + point(size));
    }
    return soup;
}

/// Draws a soup into a G-buffer on the CPU.
/// @param largeCount room for large triangles, of drawing by slot
inline GBuffer drawSoup(const TriangleSoup& soup, const ViewRays& view,
                        GBufferDraw draw = GBufferDraw::kByBatch,
                        size_t largeCount = GBuffer::kLargeTriangles) {
    const BatchSet batches(soup.view(), std::vector<uint32_t>(soup.triangles.size(), 0));
    GBuffer gbuffer(Backend::kCpu);
    gbuffer.large = SplitWork(Backend::kCpu, "test/large triangles", largeCount);
    drawGBuffer(Backend::kCpu, soup.view(), batches.view(), view, gbuffer, draw);
    return gbuffer;
}

} // namespace shadowdag::test
