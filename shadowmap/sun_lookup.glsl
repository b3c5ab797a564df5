// SPDX-License-Identifier: Apache-2.0
// The filter for windows of a sun: sun_filter.h. Part of lookup.glsl.

uint lookupSun(ShadowMapInfo map, vec3 positionWorld, vec3 normalWorld) {
    dvec3 q = windowFromWorld(map, dvec3(positionWorld));
    if (!(q.x == q.x && q.y == q.y && q.z == q.z))
        return 0u;
    precise double halfSide = 0.5LF * double(map.faceTexels);
    double perWorld = sqrt(dotInOrder(map.w.xyz, map.w.xyz));
    double perWindow = sqrt(dotInOrder(map.u.xyz, map.u.xyz));
    precise double texel = 1.0LF / (perWindow * halfSide);
    precise double placeX = (q.x + 1.0LF) * halfSide, placeY = (q.y + 1.0LF) * halfSide;
    float w = float(q.z);
    float texelDepth = float(texel * perWorld);
    precise float forgiven = biasTexels * texelDepth;
    precise vec3 largest = abs(positionWorld) + abs(lightPosition(map));
    const double kRounding = 1.0LF / 1048576.0LF;
    precise double rounding =
        kRounding * (double(max(largest.x, max(largest.y, largest.z))) + double(map.rangeWorld)) *
        perWorld;
    const float kDepthRounding = 1.0 / 4194304.0;
    precise float liftAcross = float(rounding) + kDepthRounding;
    dvec3 normal = dvec3(normalWorld);
    precise double facing = dotInOrder(normal, map.w.xyz) / perWorld;
    bool faces = facing > 0.0LF;
    precise double steep = faces ? -texel * perWorld / (facing * perWindow) : 0.0LF;
    precise float slopeX = float(steep * dotInOrder(normal, map.u.xyz));
    precise float slopeY = float(steep * dotInOrder(normal, map.v.xyz));
    const double kLeastFacing = 1.0LF / 1024.0LF;
    precise float liftOwn =
        faces ? float(rounding / max(facing, kLeastFacing)) + kDepthRounding : liftAcross;

    int n = int(map.faceTexels), side = filterSide();
    double xIn = clamp(placeX, 0.0LF, double(n)), yIn = clamp(placeY, 0.0LF, double(n));
    int x0 = min(int(xIn), n - 1), y0 = min(int(yIn), n - 1);
    precise float fx = float(xIn - double(x0)), fy = float(yIn - double(y0));
    if (side == 3) {
        --x0;
        --y0;
    } else if (side == 2) {
        int left = fx < 0.5 ? 1 : 0, below = fy < 0.5 ? 1 : 0;
        x0 -= left;
        y0 -= below;
        fx += float(left) - 0.5;
        fy += float(below) - 0.5;
    }
    float total = side == 3 ? 4.0 : 1.0;
    float low = side > 1 ? kLowTapTexels * texelDepth : 1e30;
    for (int pass = 0; pass < 2; ++pass) {
        missingTapCount = 0u;
        precise float lit = 0.0, leftOut = 0.0;
        for (int j = 0; j < side; ++j) {
            for (int i = 0; i < side; ++i) {
                precise float weight = tapWeight(side, i, fx) * tapWeight(side, j, fy);
                int x = clamp(x0 + i, 0, n - 1), y = clamp(y0 + j, 0, n - 1);
                precise float dx = float(double(x) + 0.5LF - placeX);
                precise float dy = float(double(y) + 0.5LF - placeY);
                precise float own = slopeX * dx + slopeY * dy;
                bool isLow = own > low;
                precise float limit = max(own + liftOwn, liftAcross) + forgiven;
                precise float compared = w + limit;
                uint answer = tapAnswer(map, CubeTexel(kSunFace, uint(x), uint(y)), compared);
                if (isLow && answer != kTapMissing)
                    leftOut += weight;
                else if (answer == kTapLit)
                    lit += weight;
            }
        }
        uint visibility;
        if (endsFilter(lit, leftOut, total, visibility))
            return visibility;
        low = 1e30;
    }
    return 0u;
}
