// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/exact_stream.h"

#include "cuda/mutant.h"
#include "hybrid/rays/exact_ray.h"
#include "hybrid/rays/exact_stream_work.h"
#include "voxel/stream_kernel.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {
namespace {

/// The rays of one call, for the test in double.
struct Rays {
    const TruthGeometry& geometry;
    const Light& light;
    View<const TruthStart> starts;
    View<const glm::vec3> positionsWorld;
    View<const uint32_t> which;

    glm::dvec3 lightLocal(uint32_t sample) const {
        const glm::vec3 at = light.kind == Light::kSun ? pointAtLight(light, positionsWorld[sample])
                                                       : light.positionWorld;
        const double beside = mutated(Mutant::kExactLightMoved, 0.0, 0x1p-10 * light.rangeWorld);
        return glm::dvec3(at) - geometry.origin + glm::dvec3(beside, 0.0, 0.0);
    }
    TruthRay ray(size_t i) const {
        const TruthStart& start = starts[which[i]];
        return truthRay(start.plane, start.startLocal, lightLocal(which[i]));
    }
};

float manhattan(const glm::vec3& v) {
    return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
}

bool confirm(void* user, uint32_t ray, uint32_t triangle) {
    const Rays& rays = *static_cast<const Rays*>(user);
    return !isMutant(Mutant::kExactDoubtLit) &&
           blocksTruthRay(rays.geometry, rays.ray(ray), triangle);
}

} // namespace

bool isFarLight(const glm::vec3& lightLocal, double diagonal) {
    constexpr double kRounding = 0x1p-24, kFarShare = 0x1p-10;
    return 16.0 * kRounding * 2.0 * double(glm::length(lightLocal)) > kFarShare * diagonal;
}

ExactStream::ExactStream(const TruthGeometry& geometry, const TriangleBvhView& bvh, StreamIsa isa)
    : geometry_(geometry), bvh_(bvh), isa_(isa) {
    SDAG_ASSERT(hasStreamIsa(isa));
}

void ExactStream::trace(const Light& light, View<const TruthStart> starts,
                        View<const glm::vec3> positionsWorld, View<const uint32_t> which,
                        View<uint8_t> blocked) {
    SDAG_ASSERT(blocked.count >= which.count);
    std::fill_n(blocked.data, which.count, uint8_t(0));
    if (bvh_.root == kNoTriangleChild || which.empty())
        return;
    const Rays rays{geometry_, light, starts, positionsWorld, which};
    const bool isDirectional = light.kind == Light::kSun;
    starts_.resize(3 * which.count);
    receivers_.resize(which.count);
    empty_.clear();
    const glm::vec3 origin =
        isDirectional ? starts[which[0]].startLocal : glm::vec3(rays.lightLocal(which[0]));
    double endError = 0; // how far the end of a ray is from the light, or from straight towards it
    for (size_t i = 0; i < which.count; ++i) {
        const TruthStart& start = starts[which[i]];
        for (int a = 0; a < 3; ++a)
            starts_[3 * i + size_t(a)] = start.startLocal[a];
        receivers_[i] = start.plane.triangle;
        double error = start.plane.lift(rays.lightLocal(which[i]));
        if (isDirectional)
            error += glm::distance(glm::dvec3(start.startLocal) + rays.geometry.origin,
                                   glm::dvec3(positionsWorld[which[i]]));
        else if (manhattan(start.startLocal - origin) < 4.0 * (start.plane.clearance + error) &&
                 !(rays.ray(i).tFar > 0.0f))
            empty_.push_back(uint32_t(i));
        endError = std::max(endError, error);
    }
    stream::ExactWork work{};
    work.nodes = bvh_.nodes.data;
    work.leaves = bvh_.leaves.data;
    work.root = bvh_.root;
    for (int a = 0; a < 3; ++a) {
        work.origin[a] = origin[a];
        work.direction[a] = -light.directionWorld[a];
    }
    // pointAtLight turns a ray by 2^-23 at most; rounding it and the direction adds as much.
    work.endError =
        1.000001f * float(isDirectional
                              ? endError / double(light.directionalDistanceWorld) + 0x1p-22
                              : endError);
    work.size = 1.000001f * float(rays.geometry.diagonal + endError);
    if (!isDirectional && isFarLight(origin, rays.geometry.diagonal)) {
        for (size_t i = 0; i < which.count; ++i)
            blocked[i] = isBlockedExactly({geometry_, bvh_}, rays.ray(i));
        return;
    }
    work.starts = starts_.data();
    work.receivers = receivers_.data();
    work.count = which.count;
    work.blocked = blocked.data;
    work.confirm = confirm;
    work.user = const_cast<Rays*>(&rays);
    SDAG_KERNEL_OF(isa_, stream::traceExact)(work, isDirectional);
    for (const uint32_t i : empty_)
        blocked[i] = 0;
    for (size_t i = 15; i < which.count && isMutant(Mutant::kExactLaneLost); i += 16)
        blocked[i] = 0;
    confirmCount_ += work.confirmCount;
}

} // namespace shadowdag
