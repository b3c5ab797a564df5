// SPDX-License-Identifier: Apache-2.0
// Projects a corner of a triangle to the camera. Window coordinates are pixels of the G-buffer, whose rows
// grow downwards; OpenGL's picture is therefore upside down, but it is never shown.
#include "scenes/geometry.glsl"

uniform dvec3 viewOrigin, viewRight, viewUp, viewForward;
uniform double firstX, firstY, pixelSize, znear, zfar, viewWidth, viewHeight;

flat out uint triangle;
flat out float nearest; // znear / zfar: fragments beyond are discarded

void main() {
    triangle = batchTriangles[uint(gl_VertexID) / 3u];
    dvec3 corner[3];
    for (uint i = 0u; i < 3u; ++i)
        corner[i] = dvec3(vertexWorld(triangle, i)) - viewOrigin;
    // A triangle without area within double rounding is never visible (gbuffer_raster.h).
    precise dvec3 ab = corner[1] - corner[0], ac = corner[2] - corner[0];
    dvec3 normal = crossInOrder(ab, ac);
    bool hasArea = dotInOrder(normal, normal) >
                   SDAG_PARALLEL_SIDES * dotInOrder(ab, ab) * dotInOrder(ac, ac);
    dvec3 c = corner[uint(gl_VertexID) % 3u];
    double x = dotInOrder(c, viewRight), y = dotInOrder(c, viewUp), z = dotInOrder(c, viewForward);
    // Pixel p's sample lies at window coordinate p + 1/2.
    double windowX = (x - firstX * z) / pixelSize + 0.5LF * z;
    double windowY = (firstY * z - y) / pixelSize + 0.5LF * z;
    nearest = float(znear / zfar);
    gl_Position = hasArea ? vec4(2.0LF * windowX / viewWidth - z, 2.0LF * windowY / viewHeight - z,
                                 znear, z)
                          : vec4(0.0, 0.0, -1.0, 0.0);
}
