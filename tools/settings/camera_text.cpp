// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/camera_text.h"

#include "cuda/error.h"
#include "tools/settings/parse.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

/// Returns the axes of a camera without roll: its right and its up. Straight down and up are as of
/// one that looked along -z and tilted.
std::pair<glm::vec3, glm::vec3> levelAxes(const glm::vec3& forward) {
    const glm::dvec3 along(forward);
    const bool isVertical = std::max(std::abs(along.x), std::abs(along.z)) < 1e-6;
    const glm::dvec3 right =
        isVertical ? glm::dvec3(1, 0, 0) : glm::normalize(glm::cross(along, glm::dvec3(0, 1, 0)));
    return {glm::vec3(right), glm::vec3(glm::cross(right, along))};
}

Camera cameraFromNumbers(const std::string& text, const std::vector<double>& numbers) {
    Camera camera;
    camera.positionWorld = {float(numbers[0]), float(numbers[1]), float(numbers[2])};
    const glm::vec3 target{float(numbers[3]), float(numbers[4]), float(numbers[5])};
    if (target == camera.positionWorld)
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': position and target are the same point; move one");
    // In double: squares of small floats vanish.
    camera.forward =
        glm::vec3(glm::normalize(glm::dvec3(target) - glm::dvec3(camera.positionWorld)));
    const auto [right, up] = levelAxes(camera.forward);
    camera.up = up;
    if (numbers.size() > 6)
        camera.yfov = float(numbers[6] * 3.14159265358979323846 / 180.0);
    if (numbers.size() > 7) {
        camera.znear = float(numbers[7]);
        camera.zfar = float(numbers[8]);
    }
    if (numbers.size() > 9) {
        const double roll = numbers[9] * 3.14159265358979323846 / 180.0;
        camera.up = float(std::cos(roll)) * camera.up + float(std::sin(roll)) * right;
    }
    return camera;
}

} // namespace

Camera cameraFromText(const std::string& text) {
    std::vector<double> numbers;
    size_t begin = 0;
    for (; begin <= text.size();) {
        const size_t end = std::min(text.find(',', begin), text.size());
        numbers.push_back(
            parseNumber("--camera", withoutBlanks(text.substr(begin, end - begin)), -1e9, 1e9));
        begin = end + 1;
    }
    if (numbers.size() != 6 && numbers.size() != 7 && numbers.size() != 9 && numbers.size() != 10)
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text +
                        "': must be six numbers px,py,pz,tx,ty,tz, seven with the vertical angle "
                        "in degrees, nine with the near and far plane in metres, or ten with the "
                        "roll in degrees, not " +
                        std::to_string(numbers.size()));
    if (numbers.size() > 6 && !(numbers[6] >= 1 && numbers[6] <= 170))
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': the angle must be from 1 to 170 degrees");
    if (numbers.size() > 7 && !(float(numbers[7]) > 0 && float(numbers[7]) < float(numbers[8])))
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': the planes must be 0 < near < far");
    if (numbers.size() > 9 && !(std::abs(numbers[9]) <= 180))
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': the roll must be from -180 to 180 degrees");
    return cameraFromNumbers(text, numbers);
}

std::string cameraText(const Camera& camera) {
    const auto [right, up] = levelAxes(camera.forward);
    const glm::dvec3 at = camera.positionWorld, to = at + glm::dvec3(camera.forward);
    char text[256];
    std::snprintf(text, sizeof text, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", at.x,
                  at.y, at.z, to.x, to.y, to.z, glm::degrees(double(camera.yfov)),
                  double(camera.znear), double(camera.zfar),
                  glm::degrees(std::atan2(double(glm::dot(camera.up, right)),
                                          double(glm::dot(camera.up, up)))));
    return text;
}

} // namespace shadowdag
