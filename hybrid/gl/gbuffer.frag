// SPDX-License-Identifier: Apache-2.0
// Writes the triangle that is visible in a pixel. The hardware's depth test finds the nearest by znear / z.
#include "scenes/geometry.glsl"

uniform dvec3 viewOrigin, viewFirst, viewStepX, viewStepY;

flat in uint triangle;
flat in float nearest;
layout(location = 0) out uint seen;

void main() {
    if (gl_FragCoord.z < nearest)
        discard;
    if (isCut(triangle)) {
        dvec3 ray = viewFirst + double(floor(gl_FragCoord.x)) * viewStepX +
                    double(floor(gl_FragCoord.y)) * viewStepY;
        dvec3 a = dvec3(vertexWorld(triangle, 0u)) - viewOrigin;
        dvec3 b = dvec3(vertexWorld(triangle, 1u)) - viewOrigin;
        dvec3 c = dvec3(vertexWorld(triangle, 2u)) - viewOrigin;
        if (!isOpaque(triangle, dotInOrder(crossInOrder(b, c), ray),
                      dotInOrder(crossInOrder(c, a), ray), dotInOrder(crossInOrder(a, b), ray)))
            discard;
    }
    seen = triangle;
}
