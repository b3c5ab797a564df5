// SPDX-License-Identifier: Apache-2.0
// The bindings with which geometry_gl.h binds the world's triangles for geometry.glsl. A leaf text
// (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

SDAG_CONST uint kPositionsAt = 2u, kTrianglesAt = 3u, kBatchTrianglesAt = 4u;
SDAG_CONST uint kTriangleCutAt = 7u, kCutsAt = 8u, kMasksAt = 9u, kMaskWordsAt = 10u;

SDAG_LEAF_END
