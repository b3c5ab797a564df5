// SPDX-License-Identifier: Apache-2.0
// Builds the rays of a camera's pixels.
#include "hybrid/gbuffer/view_rays.h"

#include "hybrid/gbuffer/gbuffer_raster.h"

#include "cuda/error.h"

#include <cmath>
#include <string>

namespace shadowdag {

namespace {

constexpr uint32_t kMaxImageSide = 16384;
// The parts of a triangle that fills a picture.
static_assert(RasterizeSlots::partsOf(kMaxImageSide) * RasterizeSlots::partsOf(kMaxImageSide) <=
              kMaxSplitParts);

void check(bool ok, const std::string& what) {
    if (!ok)
        throw Error(ErrorKind::kUsage, what);
}

bool isFinite(const glm::dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

} // namespace

ViewRays makeViewRays(const Camera& camera, uint32_t width, uint32_t height) {
    check(width >= 1 && height >= 1 && width <= kMaxImageSide && height <= kMaxImageSide,
          "image size " + std::to_string(width) + "x" + std::to_string(height) +
              " is out of range; use 1 to " + std::to_string(kMaxImageSide) + " pixels a side");
    check(camera.znear > 0.0f && camera.znear < camera.zfar && std::isfinite(camera.zfar),
          "camera planes " + std::to_string(camera.znear) + " to " + std::to_string(camera.zfar) +
              " m; use 0 < near < far");
    check(camera.yfov >= kMinFieldOfView && camera.yfov < 3.1f,
          "camera field of view " + std::to_string(camera.yfov) +
              " rad; use 0.001 to less than 3.1");

    ViewRays rays;
    rays.origin = camera.positionWorld;
    rays.forward = glm::normalize(glm::dvec3(camera.forward));
    rays.right = glm::normalize(glm::cross(rays.forward, glm::dvec3(camera.up)));
    rays.up = glm::cross(rays.right, rays.forward);
    check(isFinite(rays.origin) && isFinite(rays.up),
          "camera axes are not finite or parallel; forward and up must span a plane");

    const double tangent = std::tan(0.5 * double(camera.yfov));
    rays.pixelSize = 2.0 * tangent / height;
    rays.firstX = rays.pixelSize * (0.5 - 0.5 * width);
    rays.firstY = rays.pixelSize * (0.5 * height - 0.5);
    rays.stepX = rays.right * rays.pixelSize;
    rays.stepY = rays.up * -rays.pixelSize;
    rays.first = rays.forward + rays.firstX * rays.right + rays.firstY * rays.up;
    rays.znear = camera.znear;
    rays.zfar = camera.zfar;
    rays.width = width;
    rays.height = height;
    return rays;
}

} // namespace shadowdag
