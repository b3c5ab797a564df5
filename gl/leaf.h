// SPDX-License-Identifier: Apache-2.0
// Leaf texts: headers named x_leaf.h that C++, CUDA and GLSL compile from one text.
//
// How to add one. Include this file first. Put all between SDAG_LEAF_BEGIN and SDAG_LEAF_END.
// Write each function as `SDAG_LEAF type name(SDAG_IN(vec3) in, SDAG_OUT(float) out)`, each
// constant as `SDAG_CONST float kName = 0.5f;`, each local value whose last bit matters as
// `SDAG_EXACT float x = ...`: GLSL may contract or reorder what is not marked. Divide floats by
// quotient(), and use lesser, greater, magnitude and squareRoot instead of min, max, abs and sqrt.
// Write uint, 1u and 1.0f; return structs by assigning their fields. Every double constant must
// follow exactly from float literals, because GLSL reads 0.1 as a float. No const locals,
// templates, pointers, references, default arguments, or GLSL keywords (sample, flat, half, filter,
// input, output) as names. Code for C++ alone is in #ifdef __cplusplus ... #endif, which GLSL
// ignores. Then add the file to sdag_embed_glsl of the folder's CMakeLists.txt, and include it
// from the C++ header and from the shader. tests/house/shared_texts.py rejects a text that is
// written twice.
#pragma once

#ifdef __cplusplus
#include "cuda/macros.h"

#include <glm/glm.hpp>

#include <cmath>
#include <cstdint>

#define SDAG_LEAF_BEGIN namespace shadowdag {
#define SDAG_LEAF_END }
#define SDAG_LEAF SDAG_HD inline
#define SDAG_CONST constexpr
#define SDAG_IN(type) const type&
#define SDAG_OUT(type) type&
#define SDAG_INOUT(type) type&
#define SDAG_EXACT

namespace shadowdag {

using uint = uint32_t;
using glm::dvec3;
using glm::uvec3;
using glm::vec3;

// Arguments by value: device code may read a constant of the host, but not refer to it.
template <class T> SDAG_HD inline T lesser(T a, T b) {
    return glm::min(a, b);
}
template <class T> SDAG_HD inline T greater(T a, T b) {
    return glm::max(a, b);
}
template <class T> SDAG_HD inline T magnitude(T a) {
    return glm::abs(a);
}
template <class T> SDAG_HD inline T squareRoot(T a) {
    return glm::sqrt(a);
}
SDAG_HD inline float quotient(float a, float b) {
    return a / b;
}
SDAG_HD inline float fusedMultiplyAdd(float a, float b, float c) {
    return fmaf(a, b, c);
}
template <class Vec> SDAG_HD inline auto dotInOrder(const Vec& a, const Vec& b) {
    return glm::dot(a, b);
}
template <class Vec> SDAG_HD inline Vec crossInOrder(const Vec& a, const Vec& b) {
    return glm::cross(a, b);
}

} // namespace shadowdag
#else
#include "gl/numerics.glsl"
#define SDAG_LEAF_BEGIN
#define SDAG_LEAF_END
#define SDAG_LEAF
#define SDAG_CONST const
#define SDAG_IN(type) type
#define SDAG_OUT(type) out type
#define SDAG_INOUT(type) inout type
#define SDAG_EXACT precise
#define lesser min
#define greater max
#define magnitude abs
#define squareRoot sqrt
#endif
