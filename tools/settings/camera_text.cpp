// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/camera_text.h"

#include "cuda/error.h"
#include "tools/settings/parse.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
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

/// Returns the direction of a way that is not zero, however short.
glm::vec3 directionAlong(const glm::dvec3& way) {
    const glm::dvec3 size = glm::abs(way); // squares of small numbers vanish
    return glm::vec3(glm::normalize(way / std::max({size.x, size.y, size.z})));
}

/// Appends a number of so many digits to a text, after a comma unless it is the first. Returns what
/// the text says.
double appendNumber(std::string& text, double number, int digits) {
    char spelled[32];
    const char* const end =
        std::to_chars(spelled, spelled + sizeof spelled, number, std::chars_format::general, digits)
            .ptr;
    text += (text.empty() ? "" : ",") + std::string(spelled, size_t(end - spelled));
    double said = 0;
    std::from_chars(spelled, end, said);
    return said;
}

Camera cameraFromNumbers(const std::string& text, const std::vector<double>& numbers) {
    Camera camera;
    // As they are given: far from the origin floats would turn the view.
    const glm::dvec3 position{numbers[0], numbers[1], numbers[2]},
        target{numbers[3], numbers[4], numbers[5]};
    if (target == position)
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': position and target are the same point; move one");
    camera.positionWorld = glm::vec3(position);
    camera.forward = directionAlong(target - position);
    const auto [right, up] = levelAxes(camera.forward);
    camera.up = up;
    if (numbers.size() > 6)
        camera.yfov = std::max(float(numbers[6] * 3.14159265358979323846 / 180.0), kMinFieldOfView);
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
        // Scenes reach to 1e9, views of them farther, and planes as far as floats do.
        const double most = numbers.size() == 7 || numbers.size() == 8
                                ? double(std::numeric_limits<float>::max())
                                : 1e10;
        numbers.push_back(
            parseNumber("--camera", withoutBlanks(text.substr(begin, end - begin)), -most, most));
        begin = end + 1;
    }
    if (numbers.size() != 6 && numbers.size() != 7 && numbers.size() != 9 && numbers.size() != 10)
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text +
                        "': must be six numbers px,py,pz,tx,ty,tz, seven with the vertical angle "
                        "in degrees, nine with the near and far plane in metres, or ten with the "
                        "roll in degrees, not " +
                        std::to_string(numbers.size()));
    if (numbers.size() > 6 && !(numbers[6] >= kLeastDegrees && numbers[6] <= kMostDegrees))
        throw Error(ErrorKind::kUsage, "--camera '" + text + "': the angle must be from " +
                                           numberText(kLeastDegrees) + " to " +
                                           numberText(kMostDegrees) + " degrees");
    if (numbers.size() > 7 && !(float(numbers[7]) > 0 && float(numbers[7]) < float(numbers[8])))
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': the planes must be 0 < near < far");
    if (numbers.size() > 9 && !(std::abs(numbers[9]) <= 180))
        throw Error(ErrorKind::kUsage,
                    "--camera '" + text + "': the roll must be from -180 to 180 degrees");
    return cameraFromNumbers(text, numbers);
}

std::string viewText(const glm::dvec3& positionWorld, const glm::dvec3& forward) {
    constexpr int kFloatDigits = 9, kDoubleDigits = 17;
    std::string text;
    // Ahead of large coordinates, where doubles are a coarse grid for a direction, a metre is
    // little.
    constexpr double kNear = 1 << 20;
    const glm::dvec3 size = glm::abs(positionWorld);
    const double far = std::max({size.x, size.y, size.z}) / kNear;
    const double ahead = far > 1.0 ? std::exp2(std::ceil(std::log2(far))) : 1.0;
    glm::dvec3 from, to;
    for (int axis = 0; axis < 3; ++axis)
        from[axis] = appendNumber(text, positionWorld[axis], kFloatDigits);
    for (int digits = kFloatDigits;; ++digits) {
        std::string view = text;
        for (int axis = 0; axis < 3; ++axis)
            to[axis] = appendNumber(view, from[axis] + ahead * forward[axis], digits);
        if (digits == kDoubleDigits ||
            (to != from && directionAlong(to - from) == directionAlong(forward)))
            return view;
    }
}

std::string cameraText(const Camera& camera) {
    const auto [right, up] = levelAxes(camera.forward);
    std::string text = viewText(camera.positionWorld, camera.forward);
    for (const double number :
         {glm::degrees(double(camera.yfov)), double(camera.znear), double(camera.zfar),
          glm::degrees(
              std::atan2(double(glm::dot(camera.up, right)), double(glm::dot(camera.up, up))))})
        appendNumber(text, number, 9);
    return text;
}

} // namespace shadowdag
