/* SPDX-License-Identifier: Apache-2.0 */
/* The interface of tracers that `shadowdag rays --tracer LIBRARY` loads at run time: C, no other
 * header. A library exports one function, shadowdag_tracer, which returns a table that lives as
 * long as the library. docs/rays.md shows how; examples/embree_tracer.cpp is one. The program calls
 * from one thread at a time; a tracer starts threads of its own. Strings are UTF-8. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Raised when a struct below changes; a library with another version is refused. */
#define SHADOWDAG_TRACER_VERSION 2u

/* World triangles. Valid until `destroy`. */
typedef struct ShadowdagTriangles {
    const float* positions; /* 3 * vertex_count */
    uint64_t vertex_count;
    const uint32_t* triangles; /* 3 * triangle_count: vertices */
    uint64_t triangle_count;
    uint32_t thread_count; /* how many to build with: --threads */
} ShadowdagTriangles;

/* Segments from samples to lights; neighbours are coherent. Valid during the call. */
typedef struct ShadowdagSegments {
    uint64_t count;
    const float* samples;      /* 3 * count: on the receivers, not lifted off them */
    const float* normals;      /* 3 * count: unit, on the light's side */
    const float* ends;         /* 3 * count: the lights */
    const uint32_t* receivers; /* count: the triangle of each sample, which must not block */
    uint32_t thread_count;     /* how many to answer with: --threads */
} ShadowdagSegments;

/* Where a call writes why it failed: at most `size` bytes with the final 0. */
typedef struct ShadowdagError {
    char* text;
    size_t size;
} ShadowdagError;

typedef struct ShadowdagTracer {
    uint32_t version; /* SHADOWDAG_TRACER_VERSION */
    const char* name; /* of rows and charts; at most 64 bytes */
    /* Returns what the other two get as `built`, or null after an error. */
    void* (*build)(const ShadowdagTriangles* triangles, ShadowdagError error);
    /* Sets blocked[i] to 1 if a triangle lies between sample and end i, else to 0. Returns 0, or
     * anything else after an error. Called several times with the same segments, and timed. */
    int (*occluded)(void* built, const ShadowdagSegments* segments, uint8_t* blocked,
                    ShadowdagError error);
    void (*destroy)(void* built);
} ShadowdagTracer;

/* The one symbol that a library exports. */
typedef const ShadowdagTracer* (*ShadowdagTracerFunction)(void);
#define SHADOWDAG_TRACER_SYMBOL "shadowdag_tracer"

#ifdef __cplusplus
}
#endif
