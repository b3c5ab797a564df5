// SPDX-License-Identifier: Apache-2.0
// A tracer as a plug-in that shares nothing with this project or with Embree: the hierarchy of
// triangles that games ask with Bullet, one ray after the other, on as many threads as it is asked
// to use. Built as libbullet_tracer.so where Debian's libbullet-dev is installed; docs/rays.md says
// how to run it.
#include "tools/workspace/tracer_api.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

namespace {

struct Built {
    btTriangleIndexVertexArray triangles;
    std::unique_ptr<btBvhTriangleMeshShape> shape;
};

void* build(const ShadowdagTriangles* of, ShadowdagError error) {
    if (of->triangle_count > uint64_t(INT32_MAX) / 3 || of->triangle_count == 0) {
        std::snprintf(error.text, error.size, "Bullet takes 1 to %d triangles", INT32_MAX / 3);
        return nullptr;
    }
    btIndexedMesh mesh; // of the caller's arrays, which live until destroy
    mesh.m_numTriangles = int(of->triangle_count);
    mesh.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(of->triangles);
    mesh.m_triangleIndexStride = 3 * sizeof(uint32_t);
    mesh.m_numVertices = int(of->vertex_count);
    mesh.m_vertexBase = reinterpret_cast<const unsigned char*>(of->positions);
    mesh.m_vertexStride = 3 * sizeof(float);
    mesh.m_vertexType = PHY_FLOAT;
    auto built = std::make_unique<Built>();
    built->triangles.addIndexedMesh(mesh, PHY_INTEGER);
    // Boxes of floats: those of 16 bits lose what is small in a large scene, and hold 2^21
    // triangles.
    built->shape = std::make_unique<btBvhTriangleMeshShape>(&built->triangles, false);
    return built.release();
}

/// Notes whether any triangle but the receiver is hit.
struct AnyHit : btTriangleRaycastCallback {
    AnyHit(const btVector3& from, const btVector3& to, uint32_t receiverTriangle)
        : btTriangleRaycastCallback(from, to), receiver(receiverTriangle) {}
    btScalar reportHit(const btVector3&, btScalar fraction, int, int triangle) override {
        if (uint32_t(triangle) == receiver)
            return m_hitFraction;
        isHit = true;
        return fraction;
    }
    uint32_t receiver;
    bool isHit = false;
};

int occluded(void* of, const ShadowdagSegments* segments, uint8_t* blocked, ShadowdagError) {
    btBvhTriangleMeshShape& shape = *static_cast<Built*>(of)->shape;
    constexpr uint64_t kSlice = 4096;
    std::atomic<uint64_t> next{0};
    const auto work = [&] {
        for (uint64_t first; (first = next.fetch_add(kSlice)) < segments->count;)
            for (uint64_t i = first; i < std::min(first + kSlice, segments->count); ++i) {
                const float *p = segments->samples + 3 * i, *n = segments->normals + 3 * i,
                            *light = segments->ends + 3 * i;
                // Off the surface, by 2^-16 of the largest coordinate: floats end at 2^-24 of it.
                const float lift =
                    0x1p-16f * std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2]), 1.0f});
                const btVector3 from(p[0] + lift * n[0], p[1] + lift * n[1], p[2] + lift * n[2]),
                    to(light[0], light[1], light[2]);
                AnyHit hit(from, to, segments->receivers[i]);
                shape.performRaycast(&hit, from, to);
                blocked[i] = hit.isHit;
            }
    };
    std::vector<std::jthread> others;
    while (others.size() + 1 < segments->thread_count)
        others.emplace_back(work);
    work();
    others.clear(); // waits for them
    return 0;
}

constexpr ShadowdagTracer kTracer = {SHADOWDAG_TRACER_VERSION, "Bullet", build, occluded,
                                     [](void* built) { delete static_cast<Built*>(built); }};

} // namespace

extern "C" const ShadowdagTracer* shadowdag_tracer() {
    return &kTracer;
}
