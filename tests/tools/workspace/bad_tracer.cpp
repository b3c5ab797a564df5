// SPDX-License-Identifier: Apache-2.0
// A plug-in with the fault that the environment variable SDAG_BAD_TRACER names, for tests.
#include "tools/workspace/tracer_api.h"

#include <cfenv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace {

bool hasFault(const char* name) {
    const char* const fault = std::getenv("SDAG_BAD_TRACER");
    return fault && std::strcmp(fault, name) == 0;
}

int callCount = 0;

void* build(const ShadowdagTriangles* triangles, ShadowdagError error) {
    callCount = 0;
    if (hasFault("writing"))
        const_cast<float*>(triangles->positions)[0] += 1.0f;
    if (!hasFault("build"))
        return &callCount;
    std::snprintf(error.text, error.size, "no room");
    return nullptr;
}

int occluded(void*, const ShadowdagSegments* segments, uint8_t* blocked, ShadowdagError) {
    ++callCount;
    if (hasFault("throwing"))
        throw std::runtime_error("out of cells");
    if (hasFault("rounding"))
        std::fesetround(FE_UPWARD);
    for (uint64_t i = 0; i < segments->count; ++i)
        if (i + 1 < segments->count || !hasFault("unanswered"))
            blocked[i] = hasFault("changing") ? uint8_t(callCount % 2) : 0;
    return hasFault("occluded") ? 1 : 0;
}

void destroy(void*) {}

} // namespace

extern "C" const ShadowdagTracer* shadowdag_tracer() {
    static ShadowdagTracer tracer;
    tracer = {hasFault("version") ? 99 : SHADOWDAG_TRACER_VERSION, hasFault("name") ? "" : "bad",
              build, hasFault("table") ? nullptr : occluded, destroy};
    return hasFault("null") ? nullptr : &tracer;
}
