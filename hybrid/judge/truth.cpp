// SPDX-License-Identifier: Apache-2.0
// The use of Embree for the truth: building, the filter that confirms hits in double, packets. Ray
// setup is in truth_ray.h.
#include "cuda/mutant.h"
#include "hybrid/judge/truth_state.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "hybrid/rays/build_poll.h"
#include "hybrid/rays/embree_device.h"
#include "hybrid/rays/float_mode.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace shadowdag {
namespace {

constexpr uint32_t kPacketWidth = 8;
/// Embree's documentation of RTC_BUFFER_TYPE_VERTEX: larger coordinates make a triangle silently
/// invisible.
constexpr float kEmbreeLimit = 1.0e18f;

void confirmHits(const RTCFilterFunctionNArguments* args);

/// A query with the data of a packet's rays that the filter needs.
struct FilteredQuery {
    EmbreeQuery embree; ///< first, so that Embree's pointer can be cast to this type
    const Truth::State* state;
    const TruthRay* rays; ///< of this packet; a ray's id is its index here

    FilteredQuery(const Truth::State& state, const TruthRay* rays, bool isCoherent)
        : embree(isCoherent, confirmHits), state(&state), rays(rays) {}
};

void confirmHits(const RTCFilterFunctionNArguments* args) {
    const auto& context = *reinterpret_cast<const FilteredQuery*>(args->context);
    for (unsigned lane = 0; lane < args->N; ++lane)
        if (args->valid[lane] == -1) {
            const uint32_t ray = RTCRayN_id(args->ray, args->N, lane);
            const uint32_t triangle = RTCHitN_primID(args->hit, args->N, lane);
            if (!isBetweenEnds(*context.state, context.rays[ray], triangle) &&
                !isMutant(Mutant::kEmbreeFilterOff))
                args->valid[lane] = 0;
        }
}

void traceEight(const Truth::State& state, const TruthRay* rays, uint32_t count, uint8_t* blocked) {
    alignas(32) RTCRay8 packet;
    alignas(32) int valid[kPacketWidth];
    for (uint32_t i = 0; i < kPacketWidth; ++i) {
        const TruthRay& ray = rays[std::min(i, count - 1)];
        valid[i] = i < count && ray.tFar > 0.0f ? -1 : 0;
        packet.org_x[i] = ray.startLocal.x;
        packet.org_y[i] = ray.startLocal.y;
        packet.org_z[i] = ray.startLocal.z;
        packet.dir_x[i] = ray.direction.x;
        packet.dir_y[i] = ray.direction.y;
        packet.dir_z[i] = ray.direction.z;
        packet.tnear[i] = 0.0f;
        packet.tfar[i] = ray.tFar;
        packet.time[i] = 0.0f;
        packet.mask[i] = ~0u;
        packet.id[i] = i;
        packet.flags[i] = 0;
    }
    FilteredQuery query(state, rays, /*isCoherent=*/true);
    embreeOccluded8(valid, state.scene, query.embree, &packet);
    for (uint32_t i = 0; i < count; ++i)
        blocked[i] = valid[i] != 0 && packet.tfar[i] < 0.0f;
}

void onEmbreeError(void* user, RTCError, const char* text) {
    *static_cast<std::string*>(user) = text ? text : "unknown error";
}

} // namespace

Truth::State::State() {
    device = newEmbreeDevice("isa=avx2");
    rtcSetDeviceErrorFunction(device, onEmbreeError, &lastError);
}

Truth::State::~State() {
    if (scene)
        rtcReleaseScene(scene);
    if (device)
        rtcReleaseDevice(device);
}

void Truth::State::build(const TriangleView& source) {
    Box bounds;
    for (const glm::vec3& p : source.positions)
        bounds.add(p);
    for (int a = 0; a < 3; ++a) {
        const float lo = bounds.min[a], hi = bounds.max[a];
        if (!(std::fabs(lo) < kEmbreeLimit && std::fabs(hi) < kEmbreeLimit))
            throw Error(ErrorKind::kInput,
                        "the truth needs coordinates under 1e18, the scene reaches " +
                            std::to_string(std::fabs(lo) > std::fabs(hi) ? lo : hi) + " on axis " +
                            std::to_string(a) + "; scale the scene down");
    }
    const TruthSpace space = truthSpaceOf(source.positions);
    origin = space.origin;
    diagonal = space.diagonal;
    vertices.resize(source.positions.count);
    for (size_t i = 0; i < vertices.size(); ++i)
        vertices[i] = glm::vec4(glm::vec3(glm::dvec3(source.positions[i]) - origin), 0.0f);
    triangles.assign(source.triangles.begin(), source.triangles.end());
    maskSet = AlphaMaskSet(source.masks);

    const EmbreeFloatMode mode;
    if (scene)
        rtcReleaseScene(scene);
    lastError.clear();
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTCSceneFlags(RTC_SCENE_FLAG_ROBUST | kEmbreeSceneFlagQueryFilter));
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(),
                               0, sizeof(glm::vec4), vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles.data(),
                               0, sizeof(glm::uvec3), triangles.size());
    rtcCommitGeometry(mesh);
    rtcAttachGeometryByID(scene, mesh, 0);
    rtcReleaseGeometry(mesh);
    BuildPoll poll;
    rtcSetSceneProgressMonitorFunction(scene, BuildPoll::goesOn, &poll);
    rtcCommitScene(scene);
    rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
    poll.rethrow();
    if (!lastError.empty())
        throw Error(ErrorKind::kResource,
                    "Embree cannot build over " + std::to_string(triangles.size()) +
                        " triangles: " + lastError + "; free memory or use a smaller scene");
}

Truth::Truth(const World& world) : Truth(world.triangles()) {}
Truth::Truth(const TriangleView& triangles) : state_(std::make_unique<State>()) {
    state_->build(triangles);
}
Truth::~Truth() = default;
void Truth::update(const World& world) {
    state_->build(world.triangles());
}
void Truth::update(const TriangleView& triangles) {
    state_->build(triangles);
}
const glm::dvec3& Truth::originWorld() const {
    return state_->origin;
}

void Truth::traceBlocked(const TruthRay* rays, size_t count, uint8_t* blocked) const {
    const EmbreeFloatMode mode;
    for (size_t i = 0; i < count; i += kPacketWidth)
        traceEight(*state_, rays + i, uint32_t(std::min<size_t>(kPacketWidth, count - i)),
                   blocked + i);
}

uint32_t Truth::traceFirst(const TruthRay& ray, float* t) const {
    if (!(ray.tFar > 0.0f))
        return kBackground;
    const EmbreeFloatMode mode;
    alignas(16) RTCRayHit query;
    query.ray.org_x = ray.startLocal.x;
    query.ray.org_y = ray.startLocal.y;
    query.ray.org_z = ray.startLocal.z;
    query.ray.dir_x = ray.direction.x;
    query.ray.dir_y = ray.direction.y;
    query.ray.dir_z = ray.direction.z;
    query.ray.tnear = 0.0f;
    query.ray.tfar = ray.tFar;
    query.ray.time = 0.0f;
    query.ray.mask = ~0u;
    query.ray.id = 0;
    query.ray.flags = 0;
    query.hit.geomID = query.hit.primID = RTC_INVALID_GEOMETRY_ID;
    FilteredQuery filtered(*state_, &ray, /*isCoherent=*/false);
    embreeIntersect1(state_->scene, filtered.embree, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return kBackground;
    if (t)
        *t = float(planeCrossing(*state_, ray, query.hit.primID));
    return query.hit.primID;
}

void Truth::forTrianglesNear(const glm::dvec3& centerWorld, double radiusWorld,
                             const std::function<void(uint32_t)>& visit) const {
    const glm::vec3 center(centerWorld - state_->origin);
    // The local centre is rounded by half an ulp per axis, so grow by more.
    const float reach = std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)});
    RTCPointQuery query;
    query.x = center.x;
    query.y = center.y;
    query.z = center.z;
    query.time = 0.0f;
    query.radius = float(radiusWorld * 1.000001) + 4.0f * 5.9604645e-8f * reach;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    const EmbreeFloatMode mode;
    rtcPointQuery(
        state_->scene, &query, &context,
        [](RTCPointQueryFunctionArguments* args) {
            (*static_cast<const std::function<void(uint32_t)>*>(args->userPtr))(args->primID);
            return false; // the radius stays
        },
        const_cast<std::function<void(uint32_t)>*>(&visit));
}

std::vector<uint8_t> Truth::visibility(const GBufferView& gbuffer, const std::vector<Light>& lights,
                                       const PairList& pairs) const {
    std::vector<uint8_t> result(pairs.count());
    // Within a screen tile the rays of one light are neighbours; tiles run in parallel.
    constexpr uint32_t kTile = 16;
    const uint32_t tilesX = (gbuffer.width + kTile - 1) / kTile,
                   tilesY = (gbuffer.height + kTile - 1) / kTile;
    cpuParallelRanges(size_t(tilesX) * tilesY, 4, [&](size_t begin, size_t end) {
        struct Item {
            uint32_t light;
            uint32_t receiver; ///< of this tile
            uint64_t pair;
        };
        TruthStarts startOf(*state_);
        std::vector<TruthStart> starts;
        std::vector<glm::vec3> samplesWorld;
        std::vector<Item> items;
        std::vector<TruthRay> rays;
        std::vector<uint8_t> blocked;
        for (size_t tile = begin; tile < end; ++tile) {
            items.clear();
            starts.clear();
            samplesWorld.clear();
            for (uint32_t k = 0; k < kTile * kTile; ++k) {
                // 4 x 2 blocks of samples: a packet is as square as 8 allows.
                const uint32_t block = k / 8;
                const uint32_t x = uint32_t(tile % tilesX) * kTile + block % 4 * 4 + k % 4;
                const uint32_t y = uint32_t(tile / tilesX) * kTile + block / 4 * 2 + k % 8 / 4;
                if (x >= gbuffer.width || y >= gbuffer.height)
                    continue;
                const uint32_t sample = y * gbuffer.width + x;
                const uint64_t first = pairs.sampleStart[sample];
                const uint64_t last = pairs.sampleStart[sample + 1];
                if (first == last)
                    continue;
                for (uint64_t p = first; p < last; ++p)
                    items.push_back({pairs.light[p], uint32_t(starts.size()), p});
                samplesWorld.push_back(gbuffer.positionWorld[sample]);
                starts.push_back(startOf.make(gbuffer.positionWorld[sample],
                                              gbuffer.normalWorld[sample],
                                              gbuffer.triangle[sample]));
            }
            std::stable_sort(items.begin(), items.end(),
                             [](const Item& a, const Item& b) { return a.light < b.light; });
            rays.resize(items.size());
            blocked.resize(items.size());
            for (size_t i = 0; i < items.size(); ++i) {
                const TruthStart& start = starts[items[i].receiver];
                rays[i] = truthRay(start.plane, start.startLocal,
                                   glm::dvec3(pointAtLight(lights[items[i].light],
                                                           samplesWorld[items[i].receiver])) -
                                       state_->origin);
            }
            traceBlocked(rays.data(), rays.size(), blocked.data());
            for (size_t i = 0; i < items.size(); ++i)
                result[items[i].pair] = blocked[i] ? 0 : kLit;
        }
    });
    return result;
}

std::string embreeVersion() {
    return RTC_VERSION_STRING;
}

} // namespace shadowdag
