// SPDX-License-Identifier: Apache-2.0
// Cameras as texts: what is read is finite, and written so that it is read again.
#include "tests/fuzz/fuzz_target.h"
#include "tools/settings/camera_text.h"

#include <cmath>

namespace shadowdag::fuzz::camera {

namespace {

bool isUnit(const glm::vec3& v) {
    return std::abs(glm::length(v) - 1) < 1e-3f;
}

void fuzzOne(const uint8_t* data, size_t size) {
    const Camera camera = cameraFromText({data, data + size});
    fuzzCheck(isUnit(camera.forward) && isUnit(camera.up) &&
                  std::abs(glm::dot(camera.forward, camera.up)) < 1e-3f,
              "a camera has unit axes");
    fuzzCheck(std::isfinite(camera.yfov) && camera.znear > 0 && camera.znear < camera.zfar,
              "a camera has an angle and planes");
    const std::string text = cameraText(camera);
    fuzzCheck(!text.empty(), "a camera has a text");
}

std::vector<std::string> seeds() {
    return {"0,1,5,0,0,0", "0,1,5,0,0,0,60", "1e3,-2.5,5,1000,-3,4,45,0.1,1000",
            "0,0,0,0,1,0,170,0.001,1e9,-180"};
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "camera",
                   .maxBytes = 512,
                   .fuzzOne = fuzzOne,
                   .seeds = seeds,
                   .words = {",", "-", ".", "e", "1e9", "-1e-38", "1e-45", "0x1p3"}});

} // namespace

} // namespace shadowdag::fuzz::camera
