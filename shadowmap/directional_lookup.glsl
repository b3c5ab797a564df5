// SPDX-License-Identifier: Apache-2.0
// The filter for windows of directional lights (directional_filter.h). Part of lookup.glsl.

uint lookupDirectional(ShadowMapInfo map, vec3 positionWorld, vec3 normalWorld) {
    DirectionalReceiver r = makeWindowReceiver(windowFromWorld(map, dvec3(positionWorld)), map.u.xyz, map.v.xyz,
                                       map.w.xyz, lightPosition(map), map.rangeWorld, map.faceTexels, 0.0,
                                       positionWorld, normalWorld, biasTexels);
    if (!r.isValid)
        return 0u;
    int n = int(map.faceTexels), side = int(filterSide(filterTaps));
    float fx, fy;
    int x0 = windowTexel(r.x, n, fx), y0 = windowTexel(r.y, n, fy);
    moveToFirstTap(side, x0, fx);
    moveToFirstTap(side, y0, fy);
    float low = side > 1 ? kLowTapTexels * r.texelDepth : kNoLowTap;
    for (int pass = 0; pass < 2; ++pass) {
        missingTapCount = 0u;
        precise float lit = 0.0, leftOut = 0.0;
        for (int j = 0; j < side; ++j) {
            for (int i = 0; i < side; ++i) {
                precise float weight = tapWeight(side, i, fx) * tapWeight(side, j, fy);
                int x = clamp(x0 + i, 0, n - 1), y = clamp(y0 + j, 0, n - 1);
                bool isLow;
                float limit = windowTapLimit(r, x, y, low, isLow);
                uint answer = tapResult(map, CubeTexel(kDirectionalFace, uint(x), uint(y)), limit);
                if (isLow && answer != kTapMissing)
                    leftOut += weight;
                else if (answer == kTapLit)
                    lit += weight;
            }
        }
        uint visibility;
        if (endsFilter(lit, leftOut, filterTotal(side), visibility))
            return visibility;
        low = kNoLowTap;
    }
    return 0u;
}
