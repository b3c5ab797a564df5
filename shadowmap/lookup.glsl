// SPDX-License-Identifier: Apache-2.0
// Reading a virtual cube map: shadow_map_lookup.h, where filters, bias and low taps are explained.
#include "shadowmap/cube_face.glsl"

layout(std430, binding = SDAG_PAGE_TABLE_BINDING) readonly buffer PageTable { uint pageTable[]; };
uniform uint pageTexelsLog2;
uniform float biasTexels;
uniform uint filterTaps;

#ifdef SDAG_SPARSE_PAGES
#include "shadowmap/sparse_depth.glsl"
#else
layout(std430, binding = SDAG_DEPTHS_BINDING) readonly buffer Depths { uint depths[]; };
layout(std430, binding = SDAG_MORE_DEPTHS_BINDING) readonly buffer MoreDepths { uint moreDepths[]; };
#endif

const uint kTapLit = 0u, kTapDark = 1u, kTapMissing = 2u;
const float kLowTapTexels = 6.0;

struct CubeTexel {
    uint face, x, y;
};

// Of the lookup that runs.
uint missingTapCount;

uint tapAnswer(ShadowMapInfo map, CubeTexel texel, float limit) {
    uint page = pageTable[pageTableIndex(map, texel.face, texel.x >> pageTexelsLog2,
                                         texel.y >> pageTexelsLog2)];
    if (page == kNoPage) {
        ++missingTapCount;
        return kTapMissing;
    }
#ifdef SDAG_SPARSE_PAGES
    float w = sparseDepth(map, texel.face, texel.x, texel.y);
#else
    uint inPage = (1u << pageTexelsLog2) - 1u;
    uint index = (page << (2u * pageTexelsLog2)) + ((texel.y & inPage) << pageTexelsLog2) +
                 (texel.x & inPage);
    float w = uintBitsToFloat(index < SDAG_CHUNK_TEXELS ? depths[index]
                                                        : moreDepths[index - SDAG_CHUNK_TEXELS]);
#endif
    return w > limit ? kTapDark : kTapLit;
}

CubeTexel wrapTexel(uint face, int x, int y, uint faceTexels) {
    int n = int(faceTexels);
    if (x >= 0 && x < n && y >= 0 && y < n)
        return CubeTexel(face, uint(x), uint(y));
    vec3 d = lightFromFace(face, vec3(faceCellCentre(x, faceTexels), faceCellCentre(y, faceTexels), 1.0));
    uint neighbour = faceOf(d);
    vec3 q = faceFromLight(neighbour, d);
    return CubeTexel(neighbour, faceCell(quotient(q.x, q.z), faceTexels),
                     faceCell(quotient(q.y, q.z), faceTexels));
}

int filterSide() { return filterTaps >= 9u ? 3 : filterTaps >= 4u ? 2 : 1; }

float tapWeight(int side, int i, float f) {
    return side == 1 || i + i + 1 == side ? 1.0 : i == 0 ? 1.0 - f : f;
}

// The first texel of the filter along one side, and the place in it.
void firstTexel(int side, int end, float s, out int first, out float f) {
    first = min(int(s), end - 1);
    f = s - float(first);
    if (side == 3) {
        --first;
    } else if (side == 2) {
        int left = f < 0.5 ? 1 : 0;
        first -= left;
        f += float(left) - 0.5;
    }
}

// Whether a filter has its answer, of the taps that were not left out. Where all were, they are all
// there is: asked again with none left out.
bool endsFilter(float lit, float leftOut, float total, out uint visibility) {
    visibility = 0u;
    precise float most = 0.99 * total, counted = total - leftOut;
    if (leftOut != 0.0 && !(leftOut < most))
        return false;
    precise float value = lit * quotient(255.0, counted) + 0.5;
    visibility = uint(value);
    return true;
}

#include "shadowmap/sun_lookup.glsl"

uint lookupVisibility(uint mapIndex, vec3 positionWorld, vec3 normalWorld) {
    missingTapCount = 0u;
    ShadowMapInfo map = maps[mapIndex];
    if (map.isSun != 0u)
        return lookupSun(map, positionWorld, normalWorld);
    precise vec3 d = positionWorld - lightPosition(map);
    float dd = dotInOrder(d, d);
    if (dd == 0.0)
        return 255u;
    if (!(dd > 0.0))
        return 0u;
    uint n = map.faceTexels;
    int end = int(n);
    float rTexels = quotient(1.0, float(n));
    uint face = faceOf(d);
    vec3 q = faceFromLight(face, d);
    float rDepth = quotient(1.0, q.z);
    precise float sx = clamp((q.x * rDepth + 1.0) * (0.5 * float(n)), 0.0, float(n));
    precise float sy = clamp((q.y * rDepth + 1.0) * (0.5 * float(n)), 0.0, float(n));

    const float kPlaceRounding = 1.0 / 4194304.0, kRounding = 1.0 / 1048576.0;
    vec3 place = abs(positionWorld), way = abs(d);
    precise float rounding = kPlaceRounding * max(place.x, max(place.y, place.z)) +
                             kRounding * max(way.x, max(way.y, way.z));
    float height = -dotInOrder(normalWorld, d);
    bool faces = height > 0.0;
    float forgiven = quotient(1.0, 1.0 - min(quotient(2.0 * biasTexels, float(n)), 0.5));
    precise float lifted = max(height - rounding, 0.5 * height);
    float rHeight = faces ? quotient(forgiven, lifted) : 0.0;
    precise float apart = dd * (1.0 - min(rounding * rDepth + kRounding, 0.5));
    float rAcross = quotient(forgiven, apart);

    precise vec3 ownWorld = faces ? normalWorld * -rHeight : vec3(0.0);
    precise vec3 acrossWorld = d * rAcross;
    vec3 own = faceFromLight(face, ownWorld), across = faceFromLight(face, acrossWorld);

    int side = filterSide();
    int x0, y0;
    float fx, fy;
    firstTexel(side, end, sx, x0, fx);
    firstTexel(side, end, sy, y0, fy);
    bool isInFace = x0 >= 0 && y0 >= 0 && x0 + side <= end && y0 + side <= end;
    precise float low = side > 1 ? max(1.0 - 2.0 * kLowTapTexels * rTexels, 0.0) : 0.0;
    float total = side == 3 ? 4.0 : 1.0;
    for (int pass = 0; pass < 2; ++pass) {
        missingTapCount = 0u;
        precise float lit = 0.0, leftOut = 0.0;
        for (int j = 0; j < side; ++j) {
            for (int i = 0; i < side; ++i) {
                precise float weight = tapWeight(side, i, fx) * tapWeight(side, j, fy);
                CubeTexel texel = CubeTexel(face, uint(x0 + i), uint(y0 + j));
                if (!isInFace) {
                    texel = wrapTexel(face, x0 + i, y0 + j, n);
                    own = faceFromLight(texel.face, ownWorld);
                    across = faceFromLight(texel.face, acrossWorld);
                }
                precise float u = float(2 * int(texel.x) + 1 - end) * rTexels;
                precise float v = float(2 * int(texel.y) + 1 - end) * rTexels;
                precise float ownHere = own.x * u + own.y * v + own.z;
                precise float acrossHere = across.x * u + across.y * v + across.z;
                precise float lowest = ownHere * low;
                bool isLow = low > 0.0 && lowest > acrossHere;
                uint answer = tapAnswer(map, texel, max(ownHere, acrossHere));
                if (isLow && answer != kTapMissing)
                    leftOut += weight;
                else if (answer == kTapLit)
                    lit += weight;
            }
        }
        uint visibility;
        if (endsFilter(lit, leftOut, total, visibility))
            return visibility;
        low = 0.0;
    }
    return 0u;
}
