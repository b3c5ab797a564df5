// SPDX-License-Identifier: Apache-2.0
// Embree 4, or 3 where 4 is not installed: the one file that knows their differences. Only for
// files that call Embree. Embree 3 is told by a context how to trace, Embree 4 by the arguments of
// a call.
#pragma once

#include "cuda/macros.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace shadowdag {

/// How calls trace, and a filter of their hits. Keeps pointers into itself.
struct EmbreeQuery {
    /// @param isCoherent the rays of a packet, or of consecutive calls, are similar
    /// @param filter called with the hits of all geometries of a scene with
    /// kEmbreeSceneFlagQueryFilter, args->context being &context; may be null
    explicit EmbreeQuery(bool isCoherent, RTCFilterFunctionN filter = nullptr);
    EmbreeQuery(const EmbreeQuery&) = delete;
    EmbreeQuery& operator=(const EmbreeQuery&) = delete;

#if RTC_VERSION_MAJOR >= 4
    RTCRayQueryContext context; ///< first, so that its address is the query's
    RTCOccludedArguments occludedArguments;
    RTCIntersectArguments intersectArguments;
#else
    RTCIntersectContext context; ///< first, so that its address is the query's
#endif
};

// rtcOccluded1 and its like, by a query. Embree does not change what the query says.

#if RTC_VERSION_MAJOR >= 4

constexpr RTCSceneFlags kEmbreeSceneFlagQueryFilter = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
/// Whether there is rtcOccluded1M, which Embree 4 has not.
constexpr bool kHasEmbreeRayStreams = false;

inline EmbreeQuery::EmbreeQuery(bool isCoherent, RTCFilterFunctionN filter) {
    rtcInitRayQueryContext(&context);
    rtcInitOccludedArguments(&occludedArguments);
    rtcInitIntersectArguments(&intersectArguments);
    const auto flags = RTCRayQueryFlags(
        (isCoherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT) |
        (filter ? RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER : 0));
    occludedArguments.flags = intersectArguments.flags = flags;
    occludedArguments.context = intersectArguments.context = &context;
    occludedArguments.filter = intersectArguments.filter = filter;
}

inline void embreeOccluded1(RTCScene scene, EmbreeQuery& query, RTCRay* ray) {
    rtcOccluded1(scene, ray, &query.occludedArguments);
}
inline void embreeOccluded8(const int* valid, RTCScene scene, EmbreeQuery& query, RTCRay8* rays) {
    rtcOccluded8(valid, scene, rays, &query.occludedArguments);
}
inline void embreeOccluded16(const int* valid, RTCScene scene, EmbreeQuery& query, RTCRay16* rays) {
    rtcOccluded16(valid, scene, rays, &query.occludedArguments);
}
inline void embreeIntersect1(RTCScene scene, EmbreeQuery& query, RTCRayHit* hit) {
    rtcIntersect1(scene, hit, &query.intersectArguments);
}
/// Must not be called: see kHasEmbreeRayStreams.
inline void embreeOccludedStream(RTCScene, EmbreeQuery&, RTCRay*, unsigned) {
    SDAG_ASSERT(kHasEmbreeRayStreams);
}

#else

constexpr RTCSceneFlags kEmbreeSceneFlagQueryFilter = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
constexpr bool kHasEmbreeRayStreams = true;

inline EmbreeQuery::EmbreeQuery(bool isCoherent, RTCFilterFunctionN filter) {
    rtcInitIntersectContext(&context);
    context.flags =
        isCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    context.filter = filter;
}

inline void embreeOccluded1(RTCScene scene, EmbreeQuery& query, RTCRay* ray) {
    rtcOccluded1(scene, &query.context, ray);
}
inline void embreeOccluded8(const int* valid, RTCScene scene, EmbreeQuery& query, RTCRay8* rays) {
    rtcOccluded8(valid, scene, &query.context, rays);
}
inline void embreeOccluded16(const int* valid, RTCScene scene, EmbreeQuery& query, RTCRay16* rays) {
    rtcOccluded16(valid, scene, &query.context, rays);
}
inline void embreeIntersect1(RTCScene scene, EmbreeQuery& query, RTCRayHit* hit) {
    rtcIntersect1(scene, &query.context, hit);
}
/// Traces `count` rays, one after the other in memory.
inline void embreeOccludedStream(RTCScene scene, EmbreeQuery& query, RTCRay* rays, unsigned count) {
    rtcOccluded1M(scene, &query.context, rays, count, sizeof(RTCRay));
}

#endif

} // namespace shadowdag
